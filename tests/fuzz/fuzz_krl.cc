// Fuzzer: arbitrary bytes as KRL modules: spans lie in their files and hold the numbers, indices
// are valid, and reading twice gives the same.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "app/programs/brands/krl.h"

namespace {

using namespace plumbline::programs;

void Require(bool condition) {
  if (!condition) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // A zero byte separates the files.
  std::string_view text(reinterpret_cast<const char*>(data), size);
  std::vector<SourceFile> files;
  constexpr const char* kNames[] = {"a.src", "a.dat", "$config.dat", "b.src"};
  for (const char* const name : kNames) {
    const std::size_t end = text.find('\0');
    files.push_back({name, std::string(text.substr(0, end))});
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  const Brand& brand = KrlBrand();
  const Reading reading = brand.Read(files);
  const Program& program = reading.program;
  Require(program.files.size() == files.size() && program.marks.size() == files.size());
  for (const Point& point : program.points) {
    Require(point.place.file < files.size() && point.numbers.size() == 6);
    for (const auto& number : point.numbers) {
      if (!number) continue;
      const Span& span = number->span;
      Require(span.file < files.size() && span.begin < span.end &&
              span.end <= files[span.file].bytes.size());
    }
    for (const Configuration::Field& field : point.configuration.fields) {
      Require(files[field.span.file].bytes.substr(field.span.begin,
                                                  field.span.end - field.span.begin) == field.text);
    }
  }
  for (const Routine& routine : program.routines) {
    for (const Step& step : routine.steps) {
      Require(!step.point || *step.point < program.points.size());
      Require(!step.motion.end.point || *step.motion.end.point < program.points.size());
      if (step.kind != StepKind::kMotion) continue;
      const std::vector<double> numbers = {1, 2, 3, 4, 5, 6};
      brand.InsertedMotion(program, step.motion, numbers, 0.05);
    }
  }
  for (const SourceFile& file : files) {
    brand.Recognises(file);
    const auto mark = brand.Mark(file, "mark");
    if (!mark) continue;
    Require(mark->at <= file.bytes.size());
    SourceFile marked = file;
    marked.bytes.insert(mark->at, mark->text);
    Require(brand.Read({marked}).program.marks.at(0) == "mark");
  }
  return 0;
}
