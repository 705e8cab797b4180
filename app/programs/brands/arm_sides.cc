#include "app/programs/brands/arm_sides.h"

#include <cmath>

namespace plumbline::programs {
namespace {

ArmSides Measures(const kinematics::Chain& chain, const model::JointVector& q) {
  kinematics::Posture posture;
  chain.Evaluate(q, posture);
  // The wrist's centre: the point of the fifth axis next to the fourth.
  const Vec3 &a4 = posture.axis_B[3], &a5 = posture.axis_B[4];
  const Vec3 between = posture.point_B[3] - posture.point_B[4];
  const double c = a4.dot(a5), sine_squared = 1 - c * c;
  const double along =
      sine_squared < 1e-9 ? 0 : (between.dot(a5) - c * between.dot(a4)) / sine_squared;
  const Vec3 wrist = posture.point_B[4] + along * a5;
  const Vec3 shoulder = posture.point_B[1], elbow = posture.point_B[2];
  const double reach = chain.Reach();
  const double bend = posture.axis_B[1].dot((elbow - shoulder).cross(wrist - shoulder));
  const double front = posture.axis_B[1].cross(posture.axis_B[0]).dot(wrist - posture.point_B[0]);
  return {bend / (reach * reach), front / reach};
}

}  // namespace

std::optional<ArmSides> ArmSidesOf(const kinematics::Chain& chain, const model::JointVector& q) {
  if (chain.size() != 6 || q.size() != 6) return std::nullopt;
  const ArmSides sides = Measures(chain, q),
                 at_zero = Measures(chain, model::JointVector::Zero(chain.size()));
  return ArmSides{sides.elbow_up * std::copysign(1.0, at_zero.elbow_up),
                  sides.front * std::copysign(1.0, at_zero.front)};
}

}  // namespace plumbline::programs
