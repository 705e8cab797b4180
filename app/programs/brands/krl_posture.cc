#include "app/programs/brands/krl_posture.h"

#include <algorithm>
#include <cmath>

namespace plumbline::programs::krl {

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
