// Fuzzer: arbitrary bytes as two RAPID modules: every span lies in its file, every number is the
// one that its bytes are, every label that is jumped to exists, and the mark is found again.
#include <cstdint>
#include <cstdlib>
#include <set>
#include <string>
#include <string_view>

#include "app/programs/brands/rapid.h"

using namespace plumbline::programs;

namespace {

void Require(bool holds) {
  if (!holds) std::abort();
}

void CheckSpan(const Program& program, const Span& span) {
  Require(span.file < program.files.size() && span.begin <= span.end &&
          span.end <= program.files[span.file].bytes.size());
}

void CheckTarget(const Program& program, const Target& target) {
  Require(target.point ? *target.point < program.points.size() : !target.computed.empty());
}

void CheckRoutine(const Program& program, const Routine& routine) {
  std::set<std::string> labels;
  for (const Step& step : routine.steps) {
    if (step.kind == StepKind::kLabel) Require(labels.insert(step.label).second);
  }
  for (const Step& step : routine.steps) {
    Require(step.place.file < program.files.size() && step.place.line > 0);
    if (step.kind == StepKind::kJump || step.kind == StepKind::kBranch) {
      Require(labels.count(step.label) == 1);
    }
    if (step.kind == StepKind::kCall) Require(!step.label.empty());  // may be in no file
    if (step.kind == StepKind::kUse) Require(step.point && *step.point < program.points.size());
    if (step.kind != StepKind::kMotion) continue;
    CheckTarget(program, step.motion.end);
    if (step.motion.via) CheckTarget(program, *step.motion.via);
    CheckSpan(program, step.motion.statement);
    Require(step.motion.tool && step.motion.base);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::size_t half = text.find('\0');
  const std::string first(text.substr(0, half));
  const std::string second(half == std::string_view::npos ? "" : text.substr(half + 1));
  const Brand& brand = Rapid();
  const SourceFile file{"a.mod", first};
  brand.Recognises(file);
  const Program program = brand.Read({file, {"b.sys", second}}).program;
  Require(program.files.size() == 2 && program.files[0].bytes == first &&
          program.marks.size() == 2);
  for (const Point& point : program.points) {
    for (const auto& number : point.numbers) {
      if (number) CheckSpan(program, number->span);
    }
    for (const auto& field : point.configuration.fields) {
      CheckSpan(program, field.span);
      Require(program.files[field.span.file].bytes.substr(
                  field.span.begin, field.span.end - field.span.begin) == field.text);
    }
  }
  std::set<std::string> routines;
  for (const Routine& routine : program.routines) Require(routines.insert(routine.name).second);
  const std::vector<double> pose{1, 2, 3, 1, 0, 0, 0};
  for (const Routine& routine : program.routines) {
    CheckRoutine(program, routine);
    for (const Step& step : routine.steps) {
      if (step.kind == StepKind::kMotion) brand.InsertedMotion(program, step.motion, pose, 0.05);
    }
  }
  if (const auto insertion = brand.Mark(file, "seen")) {
    std::string marked = first;
    marked.insert(insertion->at, insertion->text);
    Require(program.marks[0].empty() ? brand.Read({{"a.mod", marked}}).program.marks[0] == "seen"
                                     : true);
  }
  return 0;
}
