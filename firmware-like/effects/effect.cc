#include "firmware-like/effects/effect.h"

#include <algorithm>

namespace plumbline::effects {

bool IsEventTime(const ParameterSpec& spec) {
  return spec.role == ParameterRole::kShape && (spec.name == "time" || spec.name == "row");
}

bool IsOfTwoJoints(const ParameterSpec& spec) {
  return spec.name.rfind("q#") != spec.name.find("q#");
}

bool IsOfJointAndLink(const ParameterSpec& spec) {
  return spec.name.find("link#") != std::string_view::npos;
}

std::uint32_t PrismaticJoints(const model::Robot& robot) {
  std::uint32_t bits = 0;
  for (std::size_t k = 0; k < robot.joints.size(); ++k) {
    if (robot.joints[k].type == model::JointType::kPrismatic) bits |= std::uint32_t{1} << k;
  }
  return bits;
}

namespace {

bool HasOtherUnit(const ParameterSpec& spec, std::uint32_t prismatic, int joint) {
  return !spec.prismatic_unit.empty() && joint >= 0 && ((prismatic >> joint) & 1U) != 0;
}

}  // namespace

std::string_view UnitOf(const ParameterSpec& spec, std::uint32_t prismatic, int joint) {
  return HasOtherUnit(spec, prismatic, joint) ? spec.prismatic_unit : spec.unit;
}

model::Interval PlausibleOf(const ParameterSpec& spec, std::string_view word,
                            std::uint32_t prismatic, int joint) {
  model::Interval range =
      HasOtherUnit(spec, prismatic, joint) ? spec.prismatic_plausible : spec.plausible;
  if (!spec.not_negative_with.empty() && word == spec.not_negative_with)
    range.low = std::max(range.low, 0.0);
  return range;
}

bool IsCycles(const ParameterSpec& spec) {
  return spec.role == ParameterRole::kShape && spec.unit == "1/turn";
}

bool EffectTraits::Needs(Signal signal, std::string_view word) const {
  return std::ranges::find(needs, signal) != needs.end() ||
         std::ranges::any_of(word_needs, [&](const VariantSignal& need) {
           return need.word == word && need.signal == signal;
         });
}

}  // namespace plumbline::effects
