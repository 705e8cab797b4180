#include "firmware-like/effects/catalogue.h"

#include <algorithm>
#include <array>
#include <tuple>

#include "firmware-like/effects/empirical.h"
#include "firmware-like/effects/frame_effects.h"
#include "firmware-like/effects/instrument_effects.h"
#include "firmware-like/effects/joint_effects.h"
#include "firmware-like/effects/motion_effects.h"
#include "firmware-like/effects/structure_effects.h"
#include "firmware-like/effects/tool_effects.h"

namespace plumbline::effects {
namespace {

template <typename... Formulas>
std::span<const Effect* const> OneOfEach() {
  static const std::tuple<EffectOf<Formulas>...> effects;
  static const auto catalogue = std::apply(
      [](const auto&... effect) { return std::array{static_cast<const Effect*>(&effect)...}; },
      effects);
  return catalogue;
}

}  // namespace

/// In the order of docs/effects.md. A new effect needs only its line here, its struct in the file
/// of its family, and its picture.
std::span<const Effect* const> Catalogue() {
  return OneOfEach<  // clang-format off
      BaseFrame,
      ToolFrame,
      JointOffset,
      GearRatio,
      AxisCoupling,
      LinkGeometry,
      JointCompliance,
      ComplianceAsymmetry,
      JointHardening,
      Counterbalance,
      ToolStiffness,
      ToolShear,
      ToolRootCompliance,
      PayloadMass,
      PayloadCog,
      GravityDirection,
      PedestalCompliance,
      BearingTilt,
      LinkBending,
      AxisBending,
      GuidePlay,
      GravitySag,
      Backlash,
      ApproachLag,
      FollowingError,
      ArrivalFriction,
      GearPeriodic,
      ThermalGrowth,
      ThermalDrift,
      Latency,
      DynamicInertia,
      MeasurementScale,
      StepEvent,
      TiltEvent,
      OffsetEvent,
      BaseTilt,
      RangeZero,
      RangeAnchor,
      CameraTagSize,
      CameraZoom,
      CameraLens,
      CameraFrame
      >();  // clang-format on
}

const Effect* FindEffect(std::string_view id) {
  if (id == Empirical().traits().id) return &Empirical();
  const auto catalogue = Catalogue();
  const auto found = std::ranges::find_if(
      catalogue, [id](const Effect* effect) { return effect->traits().id == id; });
  return found == catalogue.end() ? nullptr : *found;
}

}  // namespace plumbline::effects
