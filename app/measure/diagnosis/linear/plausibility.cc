#include "app/measure/diagnosis/linear/plausibility.h"

#include <fmt/format.h>

#include <cmath>

#include "app/measure/diagnosis/linear/blocks.h"
#include "firmware-like/effects/parameter_name.h"

namespace plumbline::measure {
namespace {

std::string PlausibilityNumber(double value) {
  return fmt::format("{:.3g}", value);
}

/// A value outside its range as a multiple of the exceeded bound; infinite if the signs differ.
double TimesBeyond(const model::Interval& range, double value) {
  const double bound = value > range.high ? range.high : range.low;
  return bound * value > 0 ? value / bound : HUGE_VAL;
}

}  // namespace

Implausible ImplausibilityOf(const Dataset& data, const effects::ActiveEffect& effect) {
  const effects::EffectTraits& traits = effect.term.effect->traits();
  if (traits.empirical) return {};
  for (std::size_t k = 0; k < effect.values.size(); ++k) {
    const effects::TermParameter& parameter = effect.term.parameters[k];
    const effects::ParameterSpec& spec = traits.parameters[parameter.spec];
    if (spec.role != effects::ParameterRole::kSize) continue;
    const double in_file = spec.inverse ? 1 / effect.values[k] : effect.values[k] / spec.to_SI;
    const std::uint32_t prismatic = effect.term.prismatic;
    const std::string_view unit = UnitOf(spec, prismatic, parameter.joint);
    const std::string_view word =
        IsDeclared(data.cell, traits.id) ? std::string_view() : effect.term.word;
    const model::Interval plausible = effects::PlausibleOf(spec, word, prismatic, parameter.joint);
    if (in_file < 0 && !word.empty() && word == spec.not_negative_with) {
      return {fmt::format("joint q{} would yield against its load: {} = {} {} is negative",
                          parameter.joint + 1, effects::NameFromParameter(traits, parameter),
                          PlausibilityNumber(in_file), unit),
              HUGE_VAL};
    }
    if (!plausible.Contains(in_file)) {
      return {
          fmt::format("{} = {}{}{} is outside {}..{}, the plausible range of a healthy machine",
                      effects::NameFromParameter(traits, parameter), PlausibilityNumber(in_file),
                      unit == "1" ? "" : " ", unit == "1" ? "" : unit,
                      PlausibilityNumber(plausible.low), PlausibilityNumber(plausible.high)),
          TimesBeyond(plausible, in_file)};
    }
    if (traits.adds_compliance) {
      const double declared =
          data.cell.robot.joints[parameter.joint].compliance_rad_per_Nm.value_or(0);
      if (declared + effect.values[k] < 0) {
        return {
            fmt::format("joint q{} would yield against its load: its total compliance would be "
                        "negative ({} {})",
                        parameter.joint + 1, PlausibilityNumber(declared + effect.values[k]), unit),
            HUGE_VAL};
      }
    }
  }
  return {};
}

}  // namespace plumbline::measure
