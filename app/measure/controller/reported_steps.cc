#include "app/measure/controller/reported_steps.h"

#include <cmath>

namespace plumbline::measure {
namespace {

/// Relative spacing of the numbers of a type, times the largest that occurs; 0 for integers, whose
/// step is their scale.
double StepOfValue(const robot::RegisterValue& value, double largest) {
  constexpr double kFloat = 1.2e-7;
  return value.type == robot::RegisterType::kFloat32 ? kFloat * largest : std::abs(value.scale);
}

}  // namespace

void StepsOf(const robot::RobotProfile& profile, ControllerSample& sample) {
  if (!profile.tcp) return;
  constexpr double kFarthest_m = 4, kLargest = 3.2;
  sample.convention = static_cast<int>(profile.tcp->convention);  // in the order of the table
  sample.position_step = StepOfValue(profile.tcp->position[0], kFarthest_m);
  sample.angle_step = StepOfValue(profile.tcp->orientation[0], kLargest);
}

}  // namespace plumbline::measure
