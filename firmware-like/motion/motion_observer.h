// Motion status of the arm: acceleration from the joint readings, and the displacement of the tip
// that it causes.
#pragma once

#include <array>
#include <vector>

#include "firmware-like/motion/dynamic_deflection.h"
#include "firmware-like/motion/joint_motion.h"

namespace plumbline::motion {

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
