// Motion status of the arm: acceleration from the joint readings, and the displacement of the tip
// that it causes.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/model/robot_state.h"

namespace plumbline::motion {

// Joint speeds and accelerations estimated from polled joint positions.

using JointMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor,
                                  model::kMaxJoints, model::kMaxJoints>;

/// Speeds and accelerations at one instant.
struct JointMotion {
  double time_s = 0;           ///< the instant: the middle of the readings used, monotonic
  model::JointVector q;        ///< [rad] or [m]
  model::JointVector qd;       ///< [rad/s] or [m/s]
  model::JointVector qdd;      ///< [rad/s^2] or [m/s^2]
  JointMatrix qdd_covariance;  ///< of qdd, from the scatter of the readings
  int freedom = 0;             ///< degrees of freedom of that covariance
};

/// Fits a parabola to the readings of the last kWindow_s of each joint:
///   q(t) = c0 + c1 x + c2 x^2 / 2,  x = (t - t_middle) / h,  h = half the time span
///   qd = c1 / h,  qdd = c2 / h^2    [second-order Savitzky-Golay filter for uneven sampling]
/// and takes the covariance of qdd from the residuals r of all joints together,
///   Cov(qdd) = R^T R / (N - 3) * [(A^T A)^-1]_22 / h^4,
/// so that an error in the time of a reading, which acts on all joints at once, counts as such. The
/// variance of a joint is at least that of the steps of its register. N readings of sd s spread
/// evenly over the window give an sd of about 27 s / (sqrt(N) kWindow_s^2).
///
/// Repeated positions are not readings: a controller may refresh its registers more slowly than
/// they are polled. After a stop they count again once they have lasted for three refresh periods.
/// A reading may be one refresh period older than its arrival, so the instant is known to that.
/// Valid for motion whose acceleration changes little within the window: the bias is
/// h^2/14 d4q/dt4. Vibrations above about 1 / kWindow_s are not resolved. Does not allocate.
class JointMotionEstimator {
 public:
  static constexpr double kWindow_s = 0.12;
  /// Fewer readings in a full window do not determine the acceleration. Corresponds to a refresh
  /// period of 20 ms.
  static constexpr int kLeastReadings = 7;

  /// @param reading  trusted; may be the same as in the previous call
  void ObserveMoving(const model::RobotState& reading);
  /// The robot is at standstill: the motion that follows starts from this reading.
  void ObserveStandstill(const model::RobotState& reading);
  void Forget() { count_ = 0; }

  /// True if the readings span the whole window.
  bool full() const { return full_; }
  /// @return  nullopt if there are too few readings in the window
  std::optional<JointMotion> Estimate() const;

 private:
  struct Sample {
    double time_s = 0;
    model::JointVector q;
  };
  static constexpr int kCapacity = 128;  ///< the window at a cycle of 1 ms

  const Sample& At(int k) const { return samples_[(first_ + k) % kCapacity]; }
  void Append(const model::RobotState& reading);

  std::array<Sample, kCapacity> samples_;
  int first_ = 0, count_ = 0;
  bool full_ = false;
  double changed_s_ = 0;     ///< time of the latest reading that differed from its predecessor
  double refresh_s_ = 0;     ///< longest time between two changes since the motion started
  double q_resolution_ = 0;  ///< [rad]
  std::uint64_t sequence_ = 0;
};

// Dynamic deflection: displacement of the tip caused by the acceleration of the arm.

/// Displacement caused by the motion, in addition to that caused by weight.
struct DynamicDeflection {
  model::JointVector sag;  ///< joint deflections, as changes of the joint values [rad] or [m]
  Vec3 acceleration_F = Vec3::Zero();          ///< of the flange [m/s^2]
  Vec3 angular_acceleration_F = Vec3::Zero();  ///< of the flange [rad/s^2]
  Vec3 tip_acceleration_W = Vec3::Zero();      ///< of the tip of the rigid arm [m/s^2]
  Vec3 tip_W = Vec3::Zero();                   ///< displacement of the tip [m]
};

/// Quasi-static deflection under the inertial forces of links, tool and payload (d'Alembert):
///   f_k = -m_k a_k                                       inertial force of mass k
///   tau_i = axis_i . sum_k (p_k - o_i) x f_k             [Craig, ch. 6, outward and inward passes]
///   s_i = (c_i + compliance from effects) tau_i          or, if an effect of the cell states how
///                                                        the joint deflects under acceleration,
///                                                        s_i of that effect instead
///   d_F = bending of the tool under f_payload, its moment, and its own inertia (beam/beam.h)
///   tip_W = R_WB (J s + R_BF d_F)
/// Links are point masses at their centres of mass, because a cell states no rotary inertias. The
/// tool's own mass is distributed. Structural compliance of links and pedestal is not included.
/// Valid well below the first natural frequency of arm and tool: an oscillation after a stop does
/// not show in the joint positions and is not computed.
class DynamicModel {
 public:
  /// @param cell  the cell that the arms passed later are built from
  explicit DynamicModel(const model::CellModel& cell);

  /// Deflection under the accelerations, with the effects of the cell. Does not allocate.
  /// @param conditions  as for LoadedArm
  /// @param covariance  out: of tip_W [m^2], from that of the accelerations
  DynamicDeflection At(const deflection::LoadedArm& arm, const JointMotion& motion,
                       const loads::Payload& payload, const effects::Conditions& conditions,
                       Mat3& covariance) const;

 private:
  struct Mass {
    double kg = 0;
    Vec3 at_F = Vec3::Zero();
  };
  /// Everything that does not depend on speeds and accelerations.
  struct Setting {
    const deflection::LoadedArm& arm;
    loads::Payload payload;
    kinematics::Posture posture = {};
    kinematics::Jacobian tip_jacobian = {};
    effects::Influence<double> influence = {};
    model::JointVector turn_s2 = {};  ///< joint deflection per acceleration from effects; 0 if none
  };
  DynamicDeflection Respond(const Setting& setting, const model::JointVector& qd,
                            const model::JointVector& qdd) const;
  /// Bending of the tool, tip displacement in F [m].
  Vec3 Bend(const Setting& setting, const DynamicDeflection& flange, const Vec3& omega_F) const;

  struct ToolModel {
    std::vector<Mass> masses;  ///< point masses equivalent to the tool, without payload
    bool bends = false;
    double shear_m_per_N = 0;
    Mat3 turned_bend = Mat3::Zero();  ///< tip [m] per angular acceleration
  };
  static ToolModel ModelOf(const model::Tool& tool);
  const ToolModel& Tool(const loads::Payload& payload) const { return tools_[payload.tool]; }
  std::vector<ToolModel> tools_;
};

enum class MotionState : std::uint8_t {
  kUnknown,          ///< the robot is not trusted, or the motion has just started
  kStandstill,       ///< no motion, hence no dynamic deflection
  kMoving,           ///< the deflection is known
  kReadingsTooSlow,  ///< too few different readings for an acceleration
  kLoadUnknown,      ///< payload or link masses are unknown
};

/// Short description for status and display.
const char* Describe(MotionState state);

/// Motion of the arm; the values below `state` are zero unless it is kMoving.
struct MotionStatus {
  MotionState state = MotionState::kUnknown;
  double age_s = 0;  ///< age of the instant that the values describe
  DynamicDeflection deflection;
  /// 95 % radius of deflection.tip_W, from the scatter of the joint readings only; the stiffness of
  /// the model is taken as exact.
  double radius_m = 0;

  /// True if the deflection exceeds the noise of the readings.
  bool resolved() const {
    return state == MotionState::kMoving && deflection.tip_W.norm() > radius_m;
  }
};

/// Observes readings and reports the motion. Reads no clock; does not allocate after construction.
class MotionObserver {
 public:
  explicit MotionObserver(const model::CellModel& cell);

  /// @param reading  trusted
  void Observe(const model::RobotState& reading, bool standstill);
  /// The robot is not trusted.
  void Forget();

  /// @param payload  nullopt if unknown
  MotionStatus Status(const deflection::LoadedArm& arm, double now_s,
                      const std::optional<loads::Payload>& payload,
                      const effects::Conditions& conditions) const;

  /// Copies the readings of the observer that this one replaces, for the same robot.
  void ResumeFrom(const MotionObserver& previous);

 private:
  DynamicModel model_;
  JointMotionEstimator estimator_;
  std::vector<double> coverage_;  ///< by degrees of freedom: Student's factor / that of the normal
  bool trusted_ = false, standstill_ = false;
};

}  // namespace plumbline::motion
