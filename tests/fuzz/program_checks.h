// What holds for every reading of a robot program, whatever its bytes are.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "app/programs/brand.h"

/// Aborts unless places and spans lie inside the files, numbers are what is written there, and
/// steps refer to points that exist.
inline void CheckReading(const plumbline::programs::Brand& brand,
                         const std::vector<plumbline::programs::SourceFile>& files) {
  namespace programs = plumbline::programs;
  for (const programs::SourceFile& file : files) (void)brand.Recognises(file);
  const programs::Reading reading = brand.Read(files);
  const programs::Program& program = reading.program;
  const auto check = [](bool right) {
    if (!right) std::abort();
  };
  check(program.files.size() == files.size() && program.marks.size() == files.size());
  const auto text_of = [&](const programs::Span& span) {
    const std::string& bytes = program.files.at(span.file).bytes;
    check(span.begin <= span.end && span.end <= bytes.size());
    return bytes.substr(span.begin, span.end - span.begin);
  };
  const auto check_number = [&](const std::optional<programs::Number>& number) {
    if (!number) return;
    check(std::isfinite(number->value));
    check(std::strtod(text_of(number->span).c_str(), nullptr) == number->value);
  };
  for (const programs::Point& point : program.points) {
    check(point.place.file < files.size() && point.place.line > 0);
    for (const auto& number : point.numbers) check_number(number);
    for (const auto& number : point.external_axes) check_number(number);
    for (const auto& field : point.configuration.fields) check(text_of(field.span) == field.text);
  }
  for (const programs::Routine& routine : program.routines) {
    for (const programs::Step& step : routine.steps) {
      check(step.place.file < files.size());
      if (step.point) check(*step.point < program.points.size());
      if (step.kind != programs::StepKind::kMotion) continue;
      (void)text_of(step.motion.statement);
      if (step.motion.end.point) check(*step.motion.end.point < program.points.size());
      if (step.motion.via && step.motion.via->point)
        check(*step.motion.via->point < program.points.size());
    }
  }
  for (const programs::Refusal& refusal : reading.refusals) {
    check(refusal.file < files.size() && !refusal.remedy.empty());
  }
}
