#include "app/measure/controller/controller_sample.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::measure {

const std::vector<AngleConvention>& AngleConventions() {
  static const std::vector<AngleConvention> kConventions = {
      {"rotation_vector", "axis times angle", {-1, -1, -1}, {0, 1, 2}},
      {"roll_pitch_yaw", "Rz(3rd) Ry(2nd) Rx(1st)", {2, 1, 0}, {2, 1, 0}},
      {"a_b_c", "Rz(1st) Ry(2nd) Rx(3rd)", {2, 1, 0}, {0, 1, 2}},
      {"zyz", "Rz(1st) Ry(2nd) Rz(3rd)", {2, 1, 2}, {0, 1, 2}},
      {"xyz", "Rx(1st) Ry(2nd) Rz(3rd)", {0, 1, 2}, {0, 1, 2}},
      {"xyz from the last", "Rx(3rd) Ry(2nd) Rz(1st)", {0, 1, 2}, {2, 1, 0}},
      {"zxz", "Rz(1st) Rx(2nd) Rz(3rd)", {2, 0, 2}, {0, 1, 2}},
      {"zxy", "Rz(1st) Rx(2nd) Ry(3rd)", {2, 0, 1}, {0, 1, 2}},
      {"yxz", "Ry(1st) Rx(2nd) Rz(3rd)", {1, 0, 2}, {0, 1, 2}},
      {"yzx", "Ry(1st) Rz(2nd) Rx(3rd)", {1, 2, 0}, {0, 1, 2}},
      {"xzy", "Rx(1st) Rz(2nd) Ry(3rd)", {0, 2, 1}, {0, 1, 2}},
  };
  return kConventions;
}

Mat3 RotationFromNumbers(const Vec3& numbers, const AngleConvention& convention) {
  if (convention.axes[0] < 0) return RotationFromVector(numbers);
  Mat3 R = Mat3::Identity();
  for (std::size_t k = 0; k < 3; ++k) {
    R = R * Eigen::AngleAxisd(numbers[convention.number[k]], Vec3::Unit(convention.axes[k]))
                .toRotationMatrix();
  }
  return R;
}

namespace {

/// The largest unit * 10^k, k from `high` down to `low`, of which all values are multiples up to a
/// rounding to `printed`; 0 if there is none.
double LargestStep(const std::vector<double>& values, double unit, int high, int low,
                   double printed) {
  constexpr double kRelative = 1e-12, kLeast = 1e-6, kMost = 0.05;  // of doubles; of a step
  for (int power = high; power >= low; --power) {
    const double step = unit * std::pow(10.0, power);
    const bool multiples = std::all_of(values.begin(), values.end(), [&](double value) {
      const double count = value / step;
      const double rounding =
          std::clamp(kRelative * std::abs(count) + 0.51 * printed / step, kLeast, kMost);
      return std::abs(count - std::round(count)) <= rounding;
    });
    if (multiples) return step;
  }
  return 0;
}

}  // namespace

double StepOf(const std::vector<double>& values, double unit) {
  if (std::ranges::all_of(values, [](double value) { return value == 0; })) return 0;
  // What was printed is a multiple of a power of ten, of SI or of a degree.
  constexpr int kFinest = -13;
  const double printed = std::max(LargestStep(values, 1.0, 0, kFinest, 0),
                                  LargestStep(values, kRadPerDeg, 0, kFinest, 0));
  return LargestStep(values, unit, 2, -7, printed);
}

void FindSteps(ControllerSample& sample) {
  std::vector<double> joints, positions, angles;
  for (const ControllerPosture& posture : sample.postures) {
    joints.insert(joints.end(), posture.q.begin(), posture.q.end());
    positions.insert(positions.end(), posture.p.begin(), posture.p.end());
    angles.insert(angles.end(), posture.angles.begin(), posture.angles.end());
  }
  const auto find = [](double& step, const std::vector<double>& values,
                       std::initializer_list<double> units) {
    if (step > 0) return;
    for (const double unit : units) step = std::max(step, StepOf(values, unit));
  };
  constexpr double kMilli = 1e-3;
  find(sample.joint_step, joints, {kRadPerDeg, kMilli});
  find(sample.position_step, positions, {kMetrePerMm});
  if (sample.convention < 0) return;
  // Also of numbers that were converted once too often.
  find(sample.angle_step, angles,
       {kRadPerDeg, kMilli, kRadPerDeg * kRadPerDeg, kMilli * kRadPerDeg, kMilli * kDegPerRad});
}

double DistanceToNearest(const std::vector<ControllerPosture>& postures,
                         const model::JointVector& q) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const ControllerPosture& posture : postures) {
    nearest = std::min(nearest, (posture.q - q).cwiseAbs().maxCoeff());
  }
  return nearest;
}

}  // namespace plumbline::measure
