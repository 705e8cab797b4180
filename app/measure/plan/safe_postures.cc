#include "app/measure/plan/safe_postures.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace plumbline::measure {
namespace {

constexpr double kFreeTurn = std::numbers::pi;
constexpr double kFreeTravel_m = 1;
constexpr int kMinMoveSteps = 12;
constexpr double kPlaneTolerance_m = 1e-4;  // a tip on the plane has not crossed it

/// Distance between two segments [Ericson, Real-Time Collision Detection, 5.1.9].
double SegmentDistance(const Vec3& p1, const Vec3& q1, const Vec3& p2, const Vec3& q2) {
  const Vec3 d1 = q1 - p1, d2 = q2 - p2, r = p1 - p2;
  const double a = d1.squaredNorm(), e = d2.squaredNorm(), f = d2.dot(r), c = d1.dot(r);
  const double b = d1.dot(d2), denominator = a * e - b * b;
  double s = denominator > 1e-12 ? std::clamp((b * f - c * e) / denominator, 0.0, 1.0) : 0;
  double t = e > 1e-12 ? (b * s + f) / e : 0;
  if (t < 0 || t > 1) {
    t = std::clamp(t, 0.0, 1.0);
    s = a > 1e-12 ? std::clamp((b * t - c) / a, 0.0, 1.0) : 0;
  }
  return (p1 + s * d1 - p2 - t * d2).norm();
}

}  // namespace

PostureCheck::PostureCheck(const model::CellModel& cell, const SafetyRules& rules)
    : cell_(cell), arm_(cell), rules_(rules), reach_m_(std::max(0.1, arm_.chain().Reach())) {
  if (rules_.link_radius_m <= 0) rules_.link_radius_m = reach_m_ / 20;
}

double PostureCheck::Dexterity(const model::JointVector& q) const {
  kinematics::Posture posture;
  arm_.chain().Evaluate(q, posture);
  kinematics::Jacobian jacobian;
  arm_.chain().JacobianAt(posture, posture.X_BF() * arm_.X_FT().p, jacobian);
  jacobian.topRows<3>() /= reach_m_;
  const Eigen::VectorXd values = Eigen::MatrixXd(jacobian).jacobiSvd().singularValues();
  return values.minCoeff() / std::max(1e-12, values.maxCoeff());
}

bool PostureCheck::IsFree(const model::JointVector& q) const {
  kinematics::Posture posture;
  arm_.chain().Evaluate(q, posture);
  std::vector<Vec3> points = {Vec3::Zero()};
  const auto add = [&](const Vec3& p) {
    if ((p - points.back()).norm() > 1e-6) points.push_back(p);
  };
  for (int i = 0; i < arm_.size(); ++i) add(posture.X_BL[i].p);
  const Vec3 tip_B = posture.X_BF() * arm_.X_FT().p;
  add(tip_B);
  for (std::size_t i = 2; i < points.size(); ++i) {
    const bool is_tip = i + 1 == points.size();
    if (points[i].z() < rules_.floor_m + (is_tip ? 0 : rules_.link_radius_m)) return false;
  }
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    for (std::size_t k = i + 2; k + 1 < points.size(); ++k) {
      // Short links between two segments let these be close without touching.
      double between_m = 0;
      for (std::size_t j = i + 1; j < k; ++j) between_m += (points[j + 1] - points[j]).norm();
      const double distance_m = SegmentDistance(points[i], points[i + 1], points[k], points[k + 1]);
      if (distance_m < std::min(2 * rules_.link_radius_m, 0.6 * between_m)) return false;
    }
  }
  const Pose X_BW = cell_.robot.X_WB.Inverse();
  for (const model::Artefact& plane : cell_.artefacts) {
    if (plane.kind != model::ArtefactKind::kPlane || !plane.place || !plane.direction) continue;
    const Vec3 p_B = plane.in_base ? *plane.place : X_BW * *plane.place;
    const Vec3 n_B = plane.in_base ? *plane.direction : X_BW.R * *plane.direction;
    // The arm stays on the side of the plane on which its base is.
    const double side = n_B.dot(-p_B) < 0 ? -1 : 1;
    if (side * n_B.dot(tip_B - p_B) < -kPlaneTolerance_m) return false;
  }
  return true;
}

bool PostureCheck::IsSafe(const model::JointVector& q) const {
  for (int i = 0; i < arm_.size(); ++i) {
    const double margin = arm_.chain().type(i) == model::JointType::kRevolute
                              ? rules_.limit_margin
                              : rules_.limit_margin / 10;
    const double usable = std::min(
        margin, (arm_.chain().upper()[i] - arm_.chain().lower()[i]) / 4);  // a narrow joint
    if (q[i] < arm_.chain().lower()[i] + usable || q[i] > arm_.chain().upper()[i] - usable) {
      return false;
    }
  }
  return Dexterity(q) >= rules_.least_dexterity && IsFree(q);
}

bool PostureCheck::IsMoveFree(const model::JointVector& from, const model::JointVector& to) const {
  // Between two checks no point of the arm moves farther than half a link's radius.
  double travel_m = 0;
  for (int i = 0; i < arm_.size(); ++i) {
    const bool turns = arm_.chain().type(i) == model::JointType::kRevolute;
    travel_m += std::abs(to[i] - from[i]) * (turns ? reach_m_ : 1);
  }
  const int steps =
      std::max(kMinMoveSteps, static_cast<int>(std::ceil(2 * travel_m / rules_.link_radius_m)));
  for (int step = 1; step < steps; ++step) {
    const double share = static_cast<double>(step) / steps;
    if (!IsFree(from + share * (to - from))) return false;
  }
  return true;
}

model::JointVector PostureCheck::FromUnit(const model::JointVector& u) const {
  model::JointVector q(arm_.size());
  for (int i = 0; i < arm_.size(); ++i) {
    const bool turns = arm_.chain().type(i) == model::JointType::kRevolute;
    const double free = turns ? kFreeTurn : kFreeTravel_m;
    const double lower = arm_.chain().lower()[i], upper = arm_.chain().upper()[i];
    // Readings beyond half a turn need no other posture.
    const double low = turns || !std::isfinite(lower) ? std::max(lower, -free) : lower;
    const double high = turns || !std::isfinite(upper) ? std::min(upper, free) : upper;
    q[i] = low + (std::max(low, high) - low) * u[i];
  }
  return q;
}

bool PostureCheck::MoveTipTo(const Vec3& p_W, const Eigen::MatrixXd& across,
                             model::JointVector& q) const {
  constexpr int kIterations = 25;
  constexpr double kReached_m = 1e-7;
  kinematics::Posture posture;
  kinematics::Jacobian jacobian;
  for (int k = 0; k < kIterations; ++k) {
    arm_.chain().Evaluate(q, posture);
    const Vec3 tip_B = posture.X_BF() * arm_.X_FT().p;
    const Eigen::VectorXd error = across.transpose() * (p_W - cell_.robot.X_WB * tip_B);
    if (error.norm() < kReached_m) return IsSafe(q);
    arm_.chain().JacobianAt(posture, tip_B, jacobian);
    const Eigen::MatrixXd J = across.transpose() * cell_.robot.X_WB.R * jacobian.topRows<3>();
    const Eigen::MatrixXd damped =
        J * J.transpose() + 1e-9 * Eigen::MatrixXd::Identity(J.rows(), J.rows());
    Eigen::VectorXd step = J.transpose() * damped.ldlt().solve(error);
    const double largest = step.cwiseAbs().maxCoeff();
    if (largest > 0.3) step *= 0.3 / largest;
    q += step;
  }
  return false;
}

}  // namespace plumbline::measure
