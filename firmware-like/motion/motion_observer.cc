#include "firmware-like/motion/motion_observer.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "firmware-like/beam/beam.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::motion {
namespace {

constexpr double kRefreshesAtRest = 3;
constexpr int kParameters = 3;

/// Row of the design matrix at x.
Vec3 RowAt(double x) {
  return {1, x, 0.5 * x * x};
}

}  // namespace

void JointMotionEstimator::ObserveStandstill(const model::RobotState& reading) {
  count_ = 0;
  full_ = false;
  refresh_s_ = 0;
  sequence_ = reading.sequence;
  Append(reading);
  changed_s_ = reading.timestamp_s;
}

void JointMotionEstimator::ObserveMoving(const model::RobotState& reading) {
  if (count_ > 0 && reading.sequence == sequence_) return;
  if (count_ > 0 && At(count_ - 1).q.size() != reading.q.size()) Forget();
  sequence_ = reading.sequence;
  if (count_ == 0) {
    full_ = false;
    refresh_s_ = 0;
    changed_s_ = reading.timestamp_s;
    Append(reading);
    return;
  }
  if (At(count_ - 1).q != reading.q) {
    refresh_s_ = std::max(refresh_s_, reading.timestamp_s - changed_s_);
    changed_s_ = reading.timestamp_s;
    Append(reading);
  } else if (reading.timestamp_s - changed_s_ > kRefreshesAtRest * refresh_s_ && refresh_s_ > 0) {
    Append(reading);
  }
  while (count_ > 1 && At(0).time_s < reading.timestamp_s - kWindow_s) {
    first_ = (first_ + 1) % kCapacity;
    --count_;
    full_ = true;
  }
}

void JointMotionEstimator::Append(const model::RobotState& reading) {
  if (count_ == kCapacity) {
    first_ = (first_ + 1) % kCapacity;
    --count_;
  }
  samples_[(first_ + count_) % kCapacity] = {reading.timestamp_s, reading.q};
  ++count_;
  q_resolution_ = reading.q_resolution;
}

std::optional<JointMotion> JointMotionEstimator::Estimate() const {
  if (count_ < kLeastReadings) return std::nullopt;
  const double start_s = At(0).time_s, end_s = At(count_ - 1).time_s;
  const double half_s = 0.5 * (end_s - start_s);
  if (!(half_s > 0)) return std::nullopt;
  JointMotion motion;
  motion.time_s = 0.5 * (start_s + end_s);
  const auto x_of = [&](int k) { return (At(k).time_s - motion.time_s) / half_s; };
  // Positions relative to one of the readings, so that rounding does not matter.
  const model::JointVector origin = At(count_ / 2).q;
  const Eigen::Index joints = origin.size();
  using Coefficients =
      Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, model::kMaxJoints>;
  Mat3 normal = Mat3::Zero();
  Coefficients right = Coefficients::Zero(3, joints);
  for (int k = 0; k < count_; ++k) {
    const Vec3 row = RowAt(x_of(k));
    normal += row * row.transpose();
    right += row * (At(k).q - origin).transpose();
  }
  const Mat3 inverse = normal.inverse();
  const Coefficients c = inverse * right;
  JointMatrix scatter = JointMatrix::Zero(joints, joints);
  for (int k = 0; k < count_; ++k) {
    const model::JointVector residual = At(k).q - origin - c.transpose() * RowAt(x_of(k));
    scatter += residual * residual.transpose();
  }
  motion.freedom = count_ - kParameters;
  scatter /= motion.freedom;
  const double least_variance = q_resolution_ * q_resolution_ / 12;
  for (int i = 0; i < joints; ++i) scatter(i, i) = std::max(scatter(i, i), least_variance);
  motion.q = origin + c.row(0).transpose();
  motion.qd = c.row(1).transpose() / half_s;
  motion.qdd = c.row(2).transpose() / (half_s * half_s);
  motion.qdd_covariance = scatter * (inverse(2, 2) / (half_s * half_s * half_s * half_s));
  return motion;
}

namespace {

using I = effects::Influence<double>;

/// Motion of a rigid body at one instant, in B.
struct BodyMotion {
  Vec3 at_B = Vec3::Zero();  ///< a point of the body [m]
  Vec3 acceleration_B = Vec3::Zero();
  Vec3 omega_B = Vec3::Zero();
  Vec3 alpha_B = Vec3::Zero();

  Vec3 AccelerationOf(const Vec3& p_B) const {
    const Vec3 r = p_B - at_B;
    return acceleration_B + alpha_B.cross(r) + omega_B.cross(omega_B.cross(r));
  }

  /// The motion of the next link outwards.
  BodyMotion Next(model::JointType type, const Vec3& axis_B, const Vec3& point_B, double qd,
                  double qdd) const {
    BodyMotion next{point_B, AccelerationOf(point_B), omega_B, alpha_B};
    if (type == model::JointType::kRevolute) {
      next.alpha_B += omega_B.cross(axis_B) * qd + axis_B * qdd;
      next.omega_B += axis_B * qd;
    } else {
      next.acceleration_B += axis_B * qdd + 2 * qd * omega_B.cross(axis_B);
    }
    return next;
  }
};

}  // namespace

DynamicModel::DynamicModel(const model::CellModel& cell) {
  for (int k = 0; k < cell.tools(); ++k) tools_.push_back(ModelOf(cell.ToolAt(k)));
}

DynamicModel::ToolModel DynamicModel::ModelOf(const model::Tool& tool) {
  ToolModel of_tool;
  of_tool.bends = !tool.rigid;
  if (tool.mount_mass_kg > 0) {
    of_tool.masses.push_back({tool.mount_mass_kg, Vec3(0, 0, tool.Length() / 2)});
  }
  double z_m = 0;
  for (const model::ToolSegment& segment : tool.segments) {
    // Two half masses with the same first and second moment along the axis.
    const double apart_m = segment.length_m / (2 * std::sqrt(3.0));
    const double half_kg =
        segment.material.density_kg_m3 * segment.section.area_m2 * segment.length_m / 2;
    const double middle_m = z_m + segment.length_m / 2;
    of_tool.masses.push_back({half_kg, Vec3(0, 0, middle_m - apart_m)});
    of_tool.masses.push_back({half_kg, Vec3(0, 0, middle_m + apart_m)});
    z_m += segment.length_m;
    of_tool.shear_m_per_N +=
        segment.length_m / (segment.material.ShearModulus() * segment.section.area_m2);
  }
  if (!of_tool.bends) return of_tool;
  const beam::Beam beam(tool, 1);
  for (int axis = 0; axis < 3; ++axis) {
    of_tool.turned_bend.col(axis) =
        beam.Solve({.angular_acceleration_F = Vec3::Unit(axis)}).Tip().d_F;
  }
  return of_tool;
}

Vec3 DynamicModel::Bend(const Setting& setting, const DynamicDeflection& flange,
                        const Vec3& omega_F) const {
  const loads::Payload& payload = setting.payload;
  const ToolModel& tool = Tool(payload);
  const Vec3& alpha_F = flange.angular_acceleration_F;
  const Vec3 force_F = -payload.mass_kg * (flange.acceleration_F + alpha_F.cross(payload.cog_F) +
                                           omega_F.cross(omega_F.cross(payload.cog_F)));
  Vec3 bend = Vec3::Zero();
  if (tool.bends) {
    const deflection::LoadedArm& arm = setting.arm;
    const Vec3 moment_F = (payload.cog_F - arm.beam_tip_F(payload.tool)).cross(force_F);
    const beam::TipCompliance& tip = arm.tip_compliance(payload.tool);
    bend =
        tip.Bend(force_F, moment_F, -flange.acceleration_F).head<3>() + tool.turned_bend * alpha_F;
    bend *= 1 + setting.influence[I::kBendRatio];
    const double shear = setting.influence[I::kShear] * tool.shear_m_per_N;
    bend.head<2>() += shear * force_F.head<2>();
  }
  Vec3 root = payload.cog_F.cross(force_F);
  for (const Mass& mass : tool.masses) {
    root -= mass.kg * mass.at_F.cross(flange.acceleration_F + alpha_F.cross(mass.at_F));
  }
  root.z() = 0;
  return bend +
         setting.influence[I::kRootCompliance] * root.cross(setting.arm.X_FT(payload.tool).p);
}

DynamicDeflection DynamicModel::Respond(const Setting& setting, const model::JointVector& qd,
                                        const model::JointVector& qdd) const {
  const deflection::LoadedArm& arm = setting.arm;
  const kinematics::Posture& posture = setting.posture;
  std::array<Vec3, model::kMaxJoints> force_B, moment_B;  // of each link, about the origin of B
  BodyMotion body;
  const auto add = [&](int i, double kg, const Vec3& p_B) {
    const Vec3 inertial_N = -kg * body.AccelerationOf(p_B);
    force_B[i] += inertial_N;
    moment_B[i] += p_B.cross(inertial_N);
  };
  force_B.fill(Vec3::Zero());
  moment_B.fill(Vec3::Zero());
  const model::JointVector rates = arm.chain().AxisPositions<double>(qd);
  const model::JointVector accelerations = arm.chain().AxisPositions<double>(qdd);
  for (int i = 0; i < arm.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    body = body.Next(arm.chain().type(i), posture.axis_B[k], posture.point_B[k], rates[i],
                     accelerations[i]);
    const loads::GravityLoads::LinkMass& link = arm.loads().links()[k];
    add(i, link.mass_kg, posture.X_BL[k] * link.com_L);
  }
  const Pose& X_BF = posture.X_BF();
  for (const Mass& mass : Tool(setting.payload).masses) {
    add(arm.size() - 1, mass.kg, X_BF * mass.at_F);
  }
  add(arm.size() - 1, setting.payload.mass_kg, X_BF * setting.payload.cog_F);

  DynamicDeflection result;
  const model::JointVector drives = model::DrivePositions(arm.chain().couplings(), qdd);
  model::JointVector tau(arm.size());
  Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
  for (int i = arm.size() - 1; i >= 0; --i) {
    const auto k = static_cast<std::size_t>(i);
    force += force_B[k];
    moment += moment_B[k];
    const bool turns = arm.chain().type(i) == model::JointType::kRevolute;
    tau[i] = posture.axis_B[k].dot(turns ? Vec3(moment - posture.point_B[k].cross(force)) : force);
  }
  tau = model::DriveTorques<double>(arm.chain().couplings(), tau);
  result.sag.resize(arm.size());
  for (int i = 0; i < arm.size(); ++i) {
    const double compliance = arm.compliance(i) + setting.influence.Joint(I::kCompliance, i);
    result.sag[i] = setting.turn_s2[i] != 0 ? setting.turn_s2[i] * drives[i] : compliance * tau[i];
  }
  result.sag = arm.chain().ReportedFromDrives<double>(result.sag);
  const Mat3 R_FB = X_BF.R.transpose();
  result.acceleration_F = R_FB * body.AccelerationOf(X_BF.p);
  result.angular_acceleration_F = R_FB * body.alpha_B;
  const Mat3& R_WB = arm.X_WB().R;
  result.tip_acceleration_W = R_WB * body.AccelerationOf(X_BF * arm.X_FT(setting.payload.tool).p);
  const Vec3 bend_F = Bend(setting, result, R_FB * body.omega_B);
  result.tip_W = R_WB * (setting.tip_jacobian.topRows<3>() * result.sag + X_BF.R * bend_F);
  return result;
}

DynamicDeflection DynamicModel::At(const deflection::LoadedArm& arm, const JointMotion& motion,
                                   const loads::Payload& payload,
                                   const effects::Conditions& conditions, Mat3& covariance) const {
  Setting setting{.arm = arm, .payload = payload};
  arm.chain().Evaluate(motion.q, setting.posture);
  arm.chain().JacobianAt(setting.posture, setting.posture.X_BF() * arm.X_FT(payload.tool).p,
                         setting.tip_jacobian);
  effects::Conditions moment = arm.ConditionsAt(motion.q, conditions);
  setting.influence = arm.EffectsAt(moment, payload);
  setting.payload.mass_kg += setting.influence[I::kPayloadMass];
  setting.payload.cog_F += setting.influence.Vector(I::kPayloadCog);
  moment.qdd = model::DrivePositions(arm.chain().couplings(), motion.qdd);
  const effects::Influence<double> moving = arm.EffectsAt(moment, payload);
  const int joints = arm.size();
  setting.turn_s2.setZero(joints);
  for (int i = 0; i < joints; ++i) {
    const double turn = moving.Joint(I::kTurn, i) - setting.influence.Joint(I::kTurn, i);
    if (turn != 0 && moment.qdd[i] != 0) setting.turn_s2[i] = turn / moment.qdd[i];
  }
  Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, model::kMaxJoints> gain(3, joints);
  const model::JointVector still = model::JointVector::Zero(joints);
  model::JointVector unit = still;
  for (int i = 0; i < joints; ++i) {
    unit[i] = 1;
    gain.col(i) = Respond(setting, still, unit).tip_W;
    unit[i] = 0;
  }
  covariance = gain * motion.qdd_covariance * gain.transpose();
  return Respond(setting, motion.qd, motion.qdd);
}

namespace {

constexpr int kMostFreedom = 30;  // beyond that, Student's factor is within 4 % of the normal one

}  // namespace

const char* Describe(MotionState state) {
  switch (state) {
    case MotionState::kUnknown:
      return "unknown";
    case MotionState::kStandstill:
      return "at standstill";
    case MotionState::kMoving:
      return "moving";
    case MotionState::kReadingsTooSlow:
      return "moving; the readings change too rarely for an acceleration";
    case MotionState::kLoadUnknown:
      return "moving; payload or link masses are unknown";
  }
  return "?";
}

MotionObserver::MotionObserver(const model::CellModel& cell) : model_(cell) {
  const double normal = statistics::StudentCoverageFactor(statistics::kTwoSigmaCoverage, 1e9);
  coverage_.push_back(1);
  for (int freedom = 1; freedom <= kMostFreedom; ++freedom) {
    coverage_.push_back(statistics::StudentCoverageFactor(statistics::kTwoSigmaCoverage, freedom) /
                        normal);
  }
}

void MotionObserver::Observe(const model::RobotState& reading, bool standstill) {
  trusted_ = true;
  standstill_ = standstill;
  if (standstill) {
    estimator_.ObserveStandstill(reading);
  } else {
    estimator_.ObserveMoving(reading);
  }
}

void MotionObserver::Forget() {
  trusted_ = false;
  estimator_.Forget();
}

MotionStatus MotionObserver::Status(const deflection::LoadedArm& arm, double now_s,
                                    const std::optional<loads::Payload>& payload,
                                    const effects::Conditions& conditions) const {
  MotionStatus status;
  status.deflection.sag = model::JointVector::Zero(arm.size());
  if (!trusted_) return status;
  if (standstill_) {
    status.state = MotionState::kStandstill;
    return status;
  }
  const std::optional<JointMotion> motion = estimator_.Estimate();
  if (!motion) {
    status.state = estimator_.full() ? MotionState::kReadingsTooSlow : MotionState::kUnknown;
    return status;
  }
  if (!payload || arm.torques_missing()) {
    status.state = MotionState::kLoadUnknown;
    return status;
  }
  status.state = MotionState::kMoving;
  status.age_s = std::max(0.0, now_s - motion->time_s);
  Mat3 covariance;
  status.deflection = model_.At(arm, *motion, *payload, conditions, covariance);
  const auto freedom = static_cast<std::size_t>(std::min(motion->freedom, kMostFreedom));
  status.radius_m = coverage_[freedom] * statistics::RadiusHolding95Percent(covariance);
  return status;
}

void MotionObserver::ResumeFrom(const MotionObserver& previous) {
  estimator_ = previous.estimator_;
  trusted_ = previous.trusted_;
  standstill_ = previous.standstill_;
}

}  // namespace plumbline::motion
