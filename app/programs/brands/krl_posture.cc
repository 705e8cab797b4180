#include "app/programs/brands/krl_posture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace plumbline::programs::krl {
namespace {

constexpr double kDegPerRad = 180 / std::numbers::pi;

/// The angle that differs from `angle` by whole turns and is nearest to `old` [deg].
double NearestTurn(double angle, double old) {
  return old + std::remainder(angle - old, 360.0);
}

}  // namespace

std::vector<double> AnglesNear(const Mat3& R, std::span<const double> old) {
  std::array<double, 3> reference = {0, 0, 0};
  std::copy_n(old.begin(), std::min<std::size_t>(old.size(), 3), reference.begin());
  const double cosine = std::hypot(R(0, 0), R(1, 0));
  const double b = std::atan2(-R(2, 0), cosine) * kDegPerRad;
  // Below this, A and C follow from rounding errors alone: the sum or difference keeps the pose.
  constexpr double kSingularCosine = 1e-9;
  if (cosine < kSingularCosine) {
    // Rz(A) Ry(+-90) Rx(C): R(0,1) = -sin(A -+ C), R(1,1) = cos(A -+ C).
    const double sign = b > 0 ? 1 : -1;
    const double fixed = std::atan2(-R(0, 1), R(1, 1)) * kDegPerRad;
    const double change = std::remainder(fixed - (reference[0] - sign * reference[2]), 360.0) / 2;
    return {reference[0] + change, NearestTurn(b, reference[1]), reference[2] - sign * change};
  }
  const double a = std::atan2(R(1, 0), R(0, 0)) * kDegPerRad;
  const double c = std::atan2(R(2, 1), R(2, 2)) * kDegPerRad;
  std::vector<double> best;
  double best_change = 0;
  for (const std::array<double, 3>& solution : {std::array{a, b, c}, {a + 180, 180 - b, c + 180}}) {
    std::vector<double> angles(3);
    double change = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      angles[i] = NearestTurn(solution[i], reference[i]);
      change = std::max(change, std::abs(angles[i] - reference[i]));
    }
    if (best.empty() || change < best_change) {
      best = angles;
      best_change = change;
    }
  }
  return best;
}

std::optional<Posture> PostureOf(const kinematics::Chain& chain, const model::JointVector& q) {
  constexpr int kAxes = 6;
  // Half of the last digit that a taught pose has, seen through the arm: generous, because the
  // postures that a status separates are far apart.
  constexpr double kOpenAngle_rad = 1e-3, kOpenLength_m = 1e-3;
  if (chain.size() != kAxes || q.size() != kAxes) return std::nullopt;
  for (int i = 0; i < kAxes; ++i) {
    if (chain.type(i) != model::JointType::kRevolute) return std::nullopt;
  }
  kinematics::Posture frames;
  chain.Evaluate(q, frames);
  const auto& axis = frames.axis_B;
  const auto& point = frames.point_B;

  // Wrist centre: the point on axis 5 that is nearest to axis 4.
  const Vec3 between = point[4] - point[3];
  const double cosine = axis[3].dot(axis[4]);
  const double sine2 = 1 - cosine * cosine;
  if (sine2 < 1e-6) return std::nullopt;
  const double along = (cosine * axis[3].dot(between) - axis[4].dot(between)) / sine2;
  const Vec3 wrist = point[4] + along * axis[4];

  Posture posture;
  const auto decide = [](std::int64_t& bits, std::int64_t& open, int bit, double value,
                         double tolerance) {
    if (value < 0) bits |= std::int64_t{1} << bit;
    if (std::abs(value) < tolerance) open |= std::int64_t{1} << bit;
  };
  const Vec3 forward = Eigen::AngleAxisd(q[0], axis[0]) * Vec3::UnitX();
  decide(posture.status, posture.open_status, 0, forward.dot(wrist - point[0]), kOpenLength_m);
  // z of B and forward span the plane of the arm; a positive turn about `side` bends it forward.
  const Vec3 side = Vec3::UnitZ().cross(forward);
  const Vec3 upper = point[2] - point[1], fore = wrist - point[2];
  const double bend = side.dot(upper.cross(fore)) / std::max(upper.norm() * fore.norm(), 1e-9);
  decide(posture.status, posture.open_status, 1, -bend, kOpenAngle_rad);
  decide(posture.status, posture.open_status, 2, std::sin(q[4]), kOpenAngle_rad);
  for (int i = 0; i < kAxes; ++i) {
    decide(posture.turn, posture.open_turn, i, q[i], kOpenAngle_rad);
  }
  return posture;
}

}  // namespace plumbline::programs::krl
