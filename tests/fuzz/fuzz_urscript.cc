// Fuzzer: arbitrary URScript. Places lie inside the file and numbers are what stands there; each
// jump has its label; a motion can be refined or is refused.
#include <cstdint>
#include <cstdlib>
#include <set>
#include <string>
#include <vector>

#include "app/programs/brands/urscript.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  namespace programs = plumbline::programs;
  const programs::Brand& brand = programs::UniversalRobots();
  // A zero separates two files of one program.
  const std::string all(reinterpret_cast<const char*>(data), size);
  std::vector<programs::SourceFile> files = {{"a.script", all.substr(0, all.find('\0'))}};
  if (all.find('\0') != std::string::npos) {
    files.push_back({"b.script", all.substr(all.find('\0') + 1)});
  }
  const programs::Program program = brand.Read(files).program;
  const auto check = [](bool right) {
    if (!right) std::abort();
  };
  for (const programs::Point& point : program.points) {
    check(point.place.line > 0);
    std::size_t before = 0;
    for (const auto& number : point.numbers) {
      const std::string& bytes = program.files.at(number->span.file).bytes;
      check(before <= number->span.begin && number->span.begin < number->span.end &&
            number->span.end <= bytes.size());
      before = number->span.end;
      const std::string text =
          bytes.substr(number->span.begin, number->span.end - number->span.begin);
      check(std::strtod(text.c_str(), nullptr) == number->value);
    }
  }
  std::set<std::string> names;
  for (const programs::Routine& routine : program.routines) {
    check(names.insert(routine.name).second);
    std::set<std::string> labels;
    for (const programs::Step& step : routine.steps) {
      if (step.kind == programs::StepKind::kLabel) check(labels.insert(step.label).second);
    }
    for (const programs::Step& step : routine.steps) {
      if (step.kind == programs::StepKind::kJump || step.kind == programs::StepKind::kBranch) {
        check(labels.contains(step.label));
      }
      if (step.kind == programs::StepKind::kUse) check(*step.point < program.points.size());
      if (step.kind != programs::StepKind::kMotion) continue;
      const std::vector<double> numbers(6, 0.5);
      if (const auto inserted = brand.InsertedMotion(program, step.motion, numbers, 0.05)) {
        check(inserted->find("0.5") != std::string::npos);
      }
    }
  }
  return 0;
}
