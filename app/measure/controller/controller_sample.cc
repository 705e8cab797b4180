#include "app/measure/controller/controller_sample.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

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

double StepOf(const std::vector<double>& values, double unit) {
  constexpr double kRounding = 1e-9;
  const double largest =
      std::accumulate(values.begin(), values.end(), 0.0,
                      [](double most, double value) { return std::max(most, std::abs(value)); });
  if (!(largest > 0)) return 0;
  for (int power = 2; power >= -7; --power) {
    const double step = unit * std::pow(10.0, power);
    const bool multiples = std::all_of(values.begin(), values.end(), [&](double value) {
      const double count = value / step;
      const double rounding = std::clamp(kRounding * std::abs(count), 1e-6, 0.05);
      return std::abs(count - std::round(count)) <= rounding;
    });
    if (multiples) return step;
  }
  return 0;
}

void FindSteps(ControllerSample& sample) {
  std::vector<double> joints, positions, angles;
  for (const ControllerPosture& posture : sample.postures) {
    joints.insert(joints.end(), posture.q.begin(), posture.q.end());
    positions.insert(positions.end(), posture.p.begin(), posture.p.end());
    angles.insert(angles.end(), posture.angles.begin(), posture.angles.end());
  }
  const auto find = [](double& step, const std::vector<double>& values, double unit, double other) {
    if (step > 0) return;
    step = std::max(StepOf(values, unit), StepOf(values, other));
  };
  find(sample.joint_step, joints, kRadPerDeg, 1e-3);
  find(sample.position_step, positions, kMetrePerMm, kMetrePerMm);
  if (sample.convention >= 0) find(sample.angle_step, angles, kRadPerDeg, 1e-3);
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
