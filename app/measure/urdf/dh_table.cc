#include "app/measure/urdf/dh_table.h"

#include <algorithm>
#include <cmath>

#include "firmware-like/model/link_twist.h"

namespace plumbline::measure {
namespace {

constexpr double kLeastSine = 0.02;      // of the angle between axes with a usable common normal
constexpr double kCoincident = 1e-11;    // m: a perpendicular of this length has no direction
constexpr double kParallelSine = 1e-12;  // the cross product has no direction

/// The line of a joint's axis, or the place of the tip.
struct Target {
  Vec3 p;
  Vec3 z;
};

/// The row's end: a point of the next axis, and the direction x of its common perpendicular.
struct RowEnd {
  Vec3 p;
  Vec3 x;
};

double Snapped(double value) {
  return std::abs(value) < 1e-14 ? 0 : value;
}

/// A perpendicular from the axis of frame L to a point; if the point lies on the axis, a direction
/// perpendicular to both axes, else the frame's own x.
RowEnd TowardsPoint(const Pose& L, const Target& next) {
  const Vec3 z = L.R.col(2), arm = next.p - L.p;
  const Vec3 across = arm - arm.dot(z) * z;
  if (across.norm() > kCoincident) return {next.p, across.normalized()};
  const Vec3 normal = z.cross(next.z);
  if (normal.norm() > kParallelSine) return {next.p, normal.normalized()};
  return {next.p, L.R.col(0)};
}

RowEnd TowardsAxis(const Pose& L, const Target& next) {
  const Vec3 z = L.R.col(2), normal = z.cross(next.z);
  if (normal.norm() < kLeastSine) return TowardsPoint(L, next);
  const Vec3 x = normal.normalized() * (normal.dot(L.R.col(0)) < -1e-9 ? -1 : 1);
  // The point of the next axis that is nearest to this one.
  const double along = (next.p - L.p).cross(z).dot(normal) / normal.squaredNorm();
  return {next.p + along * next.z, x};
}

/// Fills in theta, d and a of the row that leads from frame L to its end, and returns the frame
/// that these numbers give. The frame is made from them, not from `end`, so that the error of a
/// direction found from a short perpendicular ends here and no frame ever leaves orthonormality.
Pose WithLengths(const Pose& L, const RowEnd& end, model::Joint& row) {
  const Vec3 z = L.R.col(2), arm = end.p - L.p;
  row.theta_offset_rad = Snapped(std::atan2(end.x.dot(L.R.col(1)), end.x.dot(L.R.col(0))));
  Pose D;
  D.R = L.R * Eigen::AngleAxisd(row.theta_offset_rad, Vec3::UnitZ()).toRotationMatrix();
  row.d_m = Snapped(arm.dot(z));
  row.a_m = Snapped(arm.dot(D.R.col(0)));
  D.p = L.p + row.d_m * z + row.a_m * D.R.col(0);
  return D;
}

/// alpha, beta and gamma of R = Rx(alpha) Ry(beta) Rz(gamma). The second row of
/// Rx(-alpha) R = Ry(beta) Rz(gamma) does not depend on beta: exact also near beta = 90 degrees,
/// where alpha alone is undetermined.
void SetAngles(const Mat3& R, model::Joint& row) {
  const double cos_beta = std::hypot(R(0, 0), R(0, 1));
  row.beta_rad = Snapped(std::atan2(R(0, 2), cos_beta));
  row.alpha_rad = cos_beta < 1e-13 ? 0 : Snapped(std::atan2(-R(1, 2), R(2, 2)));
  const double c = std::cos(row.alpha_rad), s = std::sin(row.alpha_rad);
  row.gamma_rad = Snapped(std::atan2(c * R(1, 0) + s * R(2, 0), c * R(1, 1) + s * R(2, 1)));
}

/// alpha and beta that turn z into `direction`, given in the frame after theta, d and a.
void SetTwist(const Vec3& direction, model::Joint& row) {
  row.beta_rad = Snapped(std::atan2(direction.x(), std::hypot(direction.y(), direction.z())));
  row.alpha_rad = Snapped(std::atan2(-direction.y(), direction.z()));
}

model::Joint RowOf(const ChainJoint& joint) {
  model::Joint row;
  row.type = joint.type;
  if (joint.limits) row.min = joint.limits->low, row.max = joint.limits->high;
  row.link_mass_kg = joint.mass_kg;
  return row;
}

}  // namespace

Pose AxisFrame(const Vec3& axis) {
  // R = I + [v]x + [v]x^2 / (1 + c) with v = z x axis, c = z . axis; where c is negative,
  // 1 / (1 + c) = (1 - c) / |v|^2 is taken, with the direction of v found before its length.
  const double sine = std::hypot(axis.x(), axis.y()), c = axis.z();
  const double ux = sine > 0 ? axis.x() / sine : 0, uy = sine > 0 ? axis.y() / sine : 1;
  const double bend = c > 0 ? sine * sine / (1 + c) : 1 - c;
  Pose X;
  X.R << 1 - bend * ux * ux, -bend * ux * uy, axis.x(),  //
      -bend * ux * uy, 1 - bend * uy * uy, axis.y(),     //
      -axis.x(), -axis.y(), c;
  return X;
}

model::Robot RobotFromChain(const JointChain& chain) {
  model::Robot robot;
  robot.name = chain.name.empty() ? chain.base + " to " + chain.tip : chain.name;
  std::vector<Pose> X_BJ;  // joint frames at q = 0
  for (const ChainJoint& joint : chain.joints) {
    X_BJ.push_back(X_BJ.empty() ? joint.X_prev : X_BJ.back() * joint.X_prev);
  }
  const Pose X_tip = X_BJ.back() * chain.X_last_tip;
  const Vec3 z = X_BJ.front().R * chain.joints.front().axis;
  robot.X_WB = AxisFrame(z);
  robot.X_WB.p = X_BJ.front().p - X_BJ.front().p.dot(z) * z;
  Pose L = robot.X_WB;
  for (std::size_t i = 0; i < chain.joints.size(); ++i) {
    const ChainJoint& joint = chain.joints[i];
    model::Joint row = RowOf(joint);
    if (i + 1 < chain.joints.size()) {
      const Target next{X_BJ[i + 1].p, X_BJ[i + 1].R * chain.joints[i + 1].axis};
      L = WithLengths(L, TowardsAxis(L, next), row);
      SetTwist(L.R.transpose() * next.z, row);
    } else {
      L = WithLengths(L, TowardsPoint(L, {X_tip.p, X_tip.R.col(2)}), row);
      SetAngles(L.R.transpose() * X_tip.R, row);
    }
    L.R = L.R * model::LinkTwist(row);
    if (joint.mass_kg) row.link_com_m = L.Inverse() * (X_BJ[i] * joint.com);
    robot.joints.push_back(row);
  }
  return robot;
}

}  // namespace plumbline::measure
