// Parameters of effects as the summary, the report and the certificate show them.
#pragma once

#include <optional>
#include <string>

#include "app/measure/diagnosis/diagnosis_text.h"

namespace plumbline::measure {

/// Scale and unit in which a parameter is shown: lengths that files have in metres are shown in mm.
struct ShownUnit {
  double scale = 1;
  std::string unit;
};

inline ShownUnit ShownUnitOf(const model::EffectParameter& parameter) {
  if (parameter.unit == "m") return {1e3, "mm"};
  return {1, parameter.unit};
}

/// Value of a parameter in its shown unit, with `deviations` times its standard deviation, or its
/// word.
inline ValueText ShownValueOf(const model::EffectParameter& parameter, double deviations = 1) {
  if (!parameter.word.empty()) return {parameter.word, ""};
  const double scale = ShownUnitOf(parameter).scale;
  const auto sd = parameter.sd ? std::optional(scale * deviations * *parameter.sd) : std::nullopt;
  return ValueTextOf(scale * parameter.value, sd);
}

}  // namespace plumbline::measure
