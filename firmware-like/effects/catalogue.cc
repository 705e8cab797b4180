#include "firmware-like/effects/catalogue.h"

#include <algorithm>
#include <array>

#include "firmware-like/effects/empirical.h"

namespace plumbline::effects {

/// In the order of the table in the file-format description. A new effect needs only its line here
/// and its two files.
// clang-format off
#define PLUMBLINE_EFFECTS(EFFECT) \
  EFFECT(BaseFrame) \
  EFFECT(ToolFrame) \
  EFFECT(JointOffset) \
  EFFECT(GearRatio) \
  EFFECT(AxisCoupling) \
  EFFECT(LinkGeometry) \
  EFFECT(JointCompliance) \
  EFFECT(JointHardening) \
  EFFECT(Counterbalance) \
  EFFECT(ToolStiffness) \
  EFFECT(ToolShear) \
  EFFECT(ToolRootCompliance) \
  EFFECT(PayloadMass) \
  EFFECT(PayloadCog) \
  EFFECT(GravityDirection) \
  EFFECT(PedestalCompliance) \
  EFFECT(BearingTilt) \
  EFFECT(LinkBending) \
  EFFECT(AxisBending) \
  EFFECT(GuidePlay) \
  EFFECT(GravitySag) \
  EFFECT(Backlash) \
  EFFECT(ApproachLag) \
  EFFECT(FollowingError) \
  EFFECT(ArrivalFriction) \
  EFFECT(GearPeriodic) \
  EFFECT(ThermalGrowth) \
  EFFECT(ThermalDrift) \
  EFFECT(Latency) \
  EFFECT(DynamicInertia) \
  EFFECT(MeasurementScale) \
  EFFECT(StepEvent) \
  EFFECT(TiltEvent) \
  EFFECT(BaseTilt) \
  EFFECT(RangeZero) \
  EFFECT(RangeAnchor) \
  EFFECT(CameraTagSize) \
  EFFECT(CameraZoom) \
  EFFECT(CameraLens) \
  EFFECT(CameraFrame)
// clang-format on

#define EFFECT(name) const Effect& name();
PLUMBLINE_EFFECTS(EFFECT)
#undef EFFECT

std::span<const Effect* const> Catalogue() {
  static const std::array catalogue = {
#define EFFECT(name) &name(),
      PLUMBLINE_EFFECTS(EFFECT)
#undef EFFECT
  };
  return catalogue;
}

const Effect* FindEffect(std::string_view id) {
  if (id == Empirical().traits().id) return &Empirical();
  const auto catalogue = Catalogue();
  const auto found = std::find_if(catalogue.begin(), catalogue.end(),
                                  [id](const Effect* effect) { return effect->traits().id == id; });
  return found == catalogue.end() ? nullptr : *found;
}

}  // namespace plumbline::effects
