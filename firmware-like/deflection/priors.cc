#include "firmware-like/deflection/priors.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "firmware-like/model/link_twist.h"
#include "firmware-like/statistics/random_sequence.h"

namespace plumbline::deflection {
namespace {

constexpr int kPostures = 400;
constexpr double kParallel = 0.7;  // cosine above which two axes count as parallel

struct ClassFigures {
  LogNormal shoulder_rad, elbow_rad;
  LogNormal first_axis, wrist;  // stiffness relative to the shoulder's
  LogNormal base_stiffness_Nm;
};

ClassFigures FiguresOf(ArmClass arm_class) {
  switch (arm_class) {
    case ArmClass::kSmall:
      return {{3.0e-3, 0.46}, {3.0e-3, 0.46}, {1.0, 0.42}, {0.45, 0.7}, {3e6, 1.2}};
    case ArmClass::kTorqueSensing:
      return {{7.0e-3, 0.50}, {7.0e-3, 0.50}, {1.0, 0.3}, {0.7, 0.35}, {3e6, 1.2}};
    case ArmClass::kMedium:
      return {{2.2e-3, 0.45}, {2.2e-3, 0.45}, {0.6, 0.5}, {0.25, 0.8}, {3e7, 1.2}};
    case ArmClass::kHeavy:
      return {{2.8e-3, 0.40}, {2.2e-3, 0.40}, {0.4, 0.35}, {0.1, 0.87}, {1e8, 0.8}};
  }
  return {};
}

/// Vector from the joint's axis to the end of its link, in the link's DH frame.
Vec3 LinkVector(const model::Robot& robot, int joint) {
  const auto k = static_cast<std::size_t>(joint);
  if (robot.convention == model::DhConvention::kDistal) {
    const model::Joint& own = robot.joints[k];
    return model::LinkTwist(own).transpose() * Vec3(own.a_m, 0, own.d_m);
  }
  if (k + 1 == robot.joints.size()) return Vec3::Zero();
  const model::Joint& next = robot.joints[k + 1];
  return Vec3(next.a_m, 0, 0) + model::LinkTwist(next) * Vec3(0, 0, next.d_m);
}

/// Midpoint of the link, in the link's DH frame.
Vec3 MiddleOfLink(const model::Robot& robot, int joint) {
  const double half = robot.convention == model::DhConvention::kDistal ? -0.5 : 0.5;
  return half * LinkVector(robot, joint);
}

/// The shoulder lifts the arm, the elbow lifts the forearm; other joints turn the arm or carry the
/// wrist.
struct Roles {
  int shoulder = 0;
  int elbow = -1;  // none
};

Roles RolesOf(const kinematics::Chain& chain) {
  kinematics::Posture zero;
  chain.Evaluate(model::JointVector::Zero(chain.size()), zero);
  const auto parallel = [&](int a, int b) {
    return std::abs(zero.axis_B[a].dot(zero.axis_B[b])) > kParallel;
  };
  const auto turns = [&](int i) { return chain.type(i) == model::JointType::kRevolute; };
  Roles roles;
  int first = 0;
  while (first < chain.size() && !turns(first)) ++first;
  roles.shoulder = std::min(first, chain.size() - 1);
  for (int i = first + 1; i < chain.size(); ++i) {
    if (!turns(i) || parallel(i, first)) continue;
    roles.shoulder = i;
    break;
  }
  for (int i = roles.shoulder + 1; i < chain.size() && roles.elbow < 0; ++i) {
    if (turns(i) && parallel(i, roles.shoulder)) roles.elbow = i;
  }
  return roles;
}

/// Fills in the link masses; undeclared ones in proportion to the declared ones. If no mass is
/// declared, only the proportions are meaningful.
/// @return  true if at least half of the mass lifted by the shoulder is declared
bool FillLinks(const model::Robot& robot, const Roles& roles, DeflectionPriors& priors) {
  constexpr double kBase = 0.30, kUpperArm = 0.35, kForearm = 0.20, kWrist = 0.15;
  const int n = robot.size();
  const int elbow = roles.elbow >= 0 ? roles.elbow : n;
  const auto share = [&](int i) {
    if (i < roles.shoulder) return kBase / roles.shoulder;
    if (i < elbow) return kUpperArm / (elbow - roles.shoulder);
    if (i == elbow) return kForearm;
    return kWrist / (n - elbow - 1);
  };
  double known_kg = 0, known_share = 0, lifted_share = 0, all_lifted_share = 0;
  for (int i = 0; i < n; ++i) {
    const model::Joint& joint = robot.joints[i];
    if (i >= roles.shoulder) all_lifted_share += share(i);
    if (joint.link_mass_kg.value_or(0) <= 0) continue;
    known_kg += *joint.link_mass_kg;
    known_share += share(i);
    if (i >= roles.shoulder) lifted_share += share(i);
  }
  const double arm_kg = known_kg > 0 ? known_kg / known_share : 1.0;
  for (int i = 0; i < n; ++i) {
    const model::Joint& joint = robot.joints[i];
    DeflectionPriors::Link& link = priors.links[i];
    link.com_L = joint.link_com_m.value_or(MiddleOfLink(robot, i));
    if (!joint.link_com_m) link.com_sd_L = 0.2 * LinkVector(robot, i);
    // The model puts an undeclared centre at the frame of a proximal (mdh) joint; see
    // loads/gravity.
    if (joint.link_mass_kg && !joint.link_com_m &&
        robot.convention == model::DhConvention::kProximal) {
      link.com_shift_L = link.com_L;
    }
    link.mass_kg = joint.link_mass_kg.value_or(share(i) * arm_kg);
    link.mass_sigma_ln = joint.link_mass_kg ? 0.0 : 0.35;
  }
  return lifted_share >= 0.5 * all_lifted_share;
}

/// Gravity torques in a sample of postures, due to the links and due to one kilogram at the flange.
struct TorqueSample {
  Eigen::MatrixXd links, unit;  // rows: postures, columns: joints

  /// Largest gravity component along a prismatic joint [m/s^2].
  double LargestPull(int joint) const { return unit.col(joint).cwiseAbs().maxCoeff(); }
  double Largest(int joint, double payload_kg) const {
    return (links.col(joint) + payload_kg * unit.col(joint)).cwiseAbs().maxCoeff();
  }
};

TorqueSample SampleTorques(const model::Robot& robot, const kinematics::Chain& chain,
                           const DeflectionPriors& priors) {
  const int n = chain.size();
  const Vec3 g_B = robot.X_WB.R.transpose() * robot.g_W;
  statistics::RandomSequence random(1);
  TorqueSample sample{Eigen::MatrixXd::Zero(kPostures, n), Eigen::MatrixXd::Zero(kPostures, n)};
  model::JointVector q(n);
  kinematics::Posture posture;
  for (int row = 0; row < kPostures; ++row) {
    for (int i = 0; i < n; ++i) {
      const double most = chain.type(i) == model::JointType::kRevolute ? std::numbers::pi : 1.0;
      const double low = std::max(chain.lower()[i], -most), high = std::min(chain.upper()[i], most);
      q[i] = low < high ? low + random.Uniform() * (high - low) : low;
    }
    chain.Evaluate(q, posture);
    for (int j = 0; j < n; ++j) {
      const auto k = static_cast<std::size_t>(j);
      if (chain.type(j) != model::JointType::kRevolute) {
        sample.unit(row, j) = posture.axis_B[k].dot(g_B);
        continue;
      }
      const auto torque = [&](const Vec3& p_B) {
        return posture.axis_B[k].dot((p_B - posture.point_B[k]).cross(g_B));
      };
      for (int l = j; l < n; ++l) {
        const auto& link = priors.links[l];
        sample.links(row, j) += link.mass_kg * torque(posture.X_BL[l] * link.com_L);
      }
      sample.unit(row, j) = torque(posture.X_BF().p);
    }
  }
  return sample;
}

double RatedPayloadByReach(double reach_m) {
  constexpr double kKnee_m = 1.5;
  const double short_kg = 8.0 * std::pow(std::min(reach_m, kKnee_m), 1.8);
  return short_kg * std::pow(std::max(1.0, reach_m / kKnee_m), 4.5);
}

ArmClass ClassOf(int joints, double shoulder_Nm) {
  constexpr double kSmall_Nm = 500, kSensing_Nm = 1000, kMedium_Nm = 5000;
  if (joints == 7 && shoulder_Nm < kSensing_Nm) return ArmClass::kTorqueSensing;
  if (shoulder_Nm > kMedium_Nm) return ArmClass::kHeavy;
  return shoulder_Nm > kSmall_Nm ? ArmClass::kMedium : ArmClass::kSmall;
}

/// True if the cell, or one of its effects, declares the compliance of this joint.
bool Declares(const model::Joint& joint, const effects::Influence<double>& effects, int i) {
  using I = effects::Influence<double>;
  return joint.compliance_rad_per_Nm || effects.Joint(I::kCompliance, i) != 0 ||
         effects.Joint(I::kHardening, i) != 0;
}

}  // namespace

DeflectionPriors PriorsOf(const model::CellModel& cell, const LoadedArm& arm) {
  const model::Robot& robot = cell.robot;
  const kinematics::Chain& chain = arm.chain();
  const int n = chain.size();
  const Roles roles = RolesOf(chain);
  DeflectionPriors priors;
  priors.shoulder = roles.shoulder;

  const bool weighed = FillLinks(robot, roles, priors);
  TorqueSample sample = SampleTorques(robot, chain, priors);
  const double unit_Nm = std::max(1e-9, sample.unit.col(roles.shoulder).cwiseAbs().maxCoeff());
  // Without a joint that lifts the arm, there is no typical wind-up.
  constexpr double kLifts = 0.1;
  const bool lifts = unit_Nm > kLifts * robot.g_W.norm() * chain.Reach();
  const double reach_m = lifts ? unit_Nm / std::max(1e-9, robot.g_W.norm()) : chain.Reach();
  priors.rated_payload_kg =
      weighed ? sample.Largest(roles.shoulder, 0) / unit_Nm : RatedPayloadByReach(reach_m);
  priors.rated_sigma_ln = weighed ? 0.0 : 0.4;
  if (!weighed) {
    // Scale the links to load the stretched shoulder as much as the rated payload does.
    const double wanted_Nm = priors.rated_payload_kg * unit_Nm;
    const double links_Nm = sample.Largest(roles.shoulder, 0);
    if (links_Nm > 0) {
      const double scale = std::clamp(wanted_Nm / links_Nm, 1e-3, 1e3);
      for (auto& link : priors.links) {
        if (link.mass_sigma_ln > 0) link.mass_kg *= scale;
      }
      sample = SampleTorques(robot, chain, priors);
    }
  }

  const double shoulder_Nm = sample.Largest(roles.shoulder, priors.rated_payload_kg);
  int revolute = 0;
  for (int i = 0; i < n; ++i) revolute += chain.type(i) == model::JointType::kRevolute ? 1 : 0;
  priors.arm_class = ClassOf(revolute, shoulder_Nm);
  priors.complete = lifts || robot.g_W.isZero(0);
  const ClassFigures figures = FiguresOf(priors.arm_class);
  const double torque_sigma_ln = weighed ? 0.15 : 0.25;
  const double shoulder_sigma = std::hypot(figures.shoulder_rad.sigma_ln, torque_sigma_ln);
  priors.common_sigma_ln = std::sqrt(0.5) * figures.shoulder_rad.sigma_ln;
  const double typical_Nm = priors.rated_payload_kg * robot.g_W.norm() * reach_m;
  const double shoulder_compliance =
      figures.shoulder_rad.median / std::max({1e-9, shoulder_Nm, lifts ? 0.0 : typical_Nm});

  effects::Influence<double> effects;
  effects::AddEffects(arm.effects(), arm.ConditionsAt(model::JointVector::Zero(n), {}), effects);
  const Vec3 g_B = robot.X_WB.R.transpose() * robot.g_W;
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (Declares(robot.joints[k], effects, i)) continue;
    if (chain.type(i) != model::JointType::kRevolute) {
      priors.complete = priors.complete && sample.LargestPull(i) <= 1e-3 * g_B.norm();
      continue;
    }
    if (i == roles.shoulder) {
      priors.compliance[k] = LogNormal{shoulder_compliance, shoulder_sigma};
    } else if (i == roles.elbow) {
      const double elbow_Nm = std::max(1e-9, sample.Largest(i, priors.rated_payload_kg));
      priors.compliance[k] = LogNormal{figures.elbow_rad.median / elbow_Nm,
                                       std::hypot(figures.elbow_rad.sigma_ln, torque_sigma_ln)};
    } else {
      const bool wrist = roles.elbow >= 0 ? i > roles.elbow : i > roles.shoulder;
      const LogNormal& ratio = wrist ? figures.wrist : figures.first_axis;
      priors.compliance[k] =
          LogNormal{shoulder_compliance / ratio.median, std::hypot(shoulder_sigma, ratio.sigma_ln)};
    }
  }
  using I = effects::Influence<double>;
  if (effects[I::kRootCompliance] == 0) priors.root_tilt_rad = LogNormal{0.5e-3, 0.7};
  if (effects[I::kPedestalCompliance] == 0) {
    priors.base_compliance_rad_per_Nm =
        LogNormal{1 / figures.base_stiffness_Nm.median, figures.base_stiffness_Nm.sigma_ln};
  }
  return priors;
}

}  // namespace plumbline::deflection
