#include "firmware-like/effects/gravity_sag.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "firmware-like/model/link_twist.h"

namespace plumbline::effects {
namespace {

/// For each link, the frame that rotates with its joint, with z along the joint's axis, in B.
void TurnedFrames(const model::Robot& robot, const model::JointVector& q,
                  std::array<Mat3, model::kMaxJoints>& R_BK) {
  Mat3 R = Mat3::Identity();
  for (std::size_t k = 0; k < robot.joints.size(); ++k) {
    const model::Joint& joint = robot.joints[k];
    const bool turns = joint.type == model::JointType::kRevolute;
    const double count = turns ? joint.sign * q[static_cast<Eigen::Index>(k)] : 0;
    const Mat3 turn =
        Eigen::AngleAxisd(joint.theta_offset_rad + count, Vec3::UnitZ()).toRotationMatrix();
    const Mat3 twist = model::LinkTwist(joint);
    if (robot.convention == model::DhConvention::kProximal) {
      R_BK[k] = R * twist * turn;
      R = R_BK[k];
    } else {
      R_BK[k] = R * turn;
      R = R_BK[k] * twist;
    }
  }
}

struct GravitySagFormula {
  enum Parameter { kCompliance, kAcrossX, kAcrossY };

  static EffectTraits Traits() {
    return {.id = "gravity_sag",
            .meaning = "the joint winds up under its gravity torque; the links' masses are unknown",
            .remedy =
                "a property of the gearbox: let the correction compensate for it; declare "
                "link_mass_kg and link_com_mm to separate compliance from weight",
            .parameters = {{.name = "q#",
                            .unit = "rad/(N m)",
                            .plausible = {0, 2e-4},
                            .only = model::JointType::kRevolute},
                           {.name = "q#_link#_x",
                            .unit = "rad",
                            .plausible = {-0.05, 0.05},
                            .only = model::JointType::kRevolute},
                           {.name = "q#_link#_y",
                            .unit = "rad",
                            .plausible = {-0.05, 0.05},
                            .only = model::JointType::kRevolute}},
            .needs = {Signal::kNoTorques},
            .confused_with = {"gear_periodic", "counterbalance", "joint_offset", "link_geometry",
                              "gear_ratio"},
            .per_joint = true,
            .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    if (!conditions.robot || conditions.q.size() != conditions.robot->size()) return;
    std::array<Mat3, model::kMaxJoints> R_BK;
    TurnedFrames(*conditions.robot, conditions.q, R_BK);
    const model::Robot& robot = *conditions.robot;
    const Vec3 down_B = robot.X_WB.R.transpose() * robot.g_W.normalized();
    for (std::size_t k = 0; k < values.size(); ++k) {
      const TermParameter& parameter = term.parameters[k];
      if (parameter.spec == kCompliance) {
        influence.Joint(Influence<T>::kCompliance, parameter.joint) += values[k];
        continue;
      }
      const auto joint = static_cast<std::size_t>(parameter.joint);
      const auto link = static_cast<std::size_t>(parameter.of);
      const Vec3 axis_B = robot.joints[joint].sign * R_BK[joint].col(2);
      const Vec3 across_B = R_BK[link].col(parameter.spec - kAcrossX);
      influence.Joint(Influence<T>::kTurn, parameter.joint) +=
          values[k] * axis_B.dot(across_B.cross(down_B));
    }
  }
};

}  // namespace

const Effect& GravitySag() {
  static const EffectOf<GravitySagFormula> effect;
  return effect;
}

}  // namespace plumbline::effects
