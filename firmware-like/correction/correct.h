// Solver for the command pose that makes the loaded tool point reach its target pose.
#pragma once

#include <cstdint>

#include "firmware-like/correction/assembly_point.h"
#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/kinematics/inverse.h"
#include "firmware-like/model/radius_basis.h"

namespace plumbline::correction {

/// Result code of a correction or a command. The numbers are those of the register map.
enum class CorrectionCode : std::uint8_t {
  kOk = 0,
  kUnreachable = 1,          ///< no posture of the arm reaches the target
  kJointLimit = 2,           ///< every posture that reaches the target violates a joint limit
  kSingular = 3,             ///< the posture is too close to a singularity
  kTooLarge = 4,             ///< the correction exceeds the largest allowed one
  kNotConverged = 5,         ///< the iteration did not converge; please report it as a defect
  kTorquesUnknown = 6,       ///< joints are compliant, but a link mass is not declared
  kPayloadUnknown = 7,       ///< the payload's mass or centre of gravity is unknown
  kNoRobot = 8,              ///< robot input is missing, stale or not trusted
  kUnknownPoint = 9,         ///< no assembly point has this id
  kBadCommand = 10,          ///< invalid command code or values
  kPending = 11,             ///< not computed yet
  kNotRecorded = 12,         ///< probes are not recorded: monitoring is off or cannot keep up
  kNoCamera = 13,            ///< no camera is configured
  kLensStale = 14,           ///< the lens is not valid at the present zoom
  kTipNotSeen = 15,          ///< the camera does not see the tool, or the tool is moving
  kCamerasDisagree = 16,     ///< the tip positions of two cameras contradict each other
  kProbeImplausible = 17,    ///< zero, in another unit, or beyond the arm's reach
  kRobotMoving = 18,         ///< a probe requires the robot at standstill
  kStorageUnavailable = 19,  ///< the journal is not writable: disk full or read-only
  kProbeQuarantined = 20,    ///< recorded, but contradicts the model more than any plausible effect
};

inline constexpr CorrectionCode kLastCorrectionCode = CorrectionCode::kProbeQuarantined;

/// Short description for the log and the register map.
const char* Describe(CorrectionCode code);

struct CorrectionLimits {
  double max_translation_m = 0.05;
  double max_rotation_rad = 0.05;
  double min_singular_value = 0.02;    ///< of the tip Jacobian, metres and radians mixed
  model::DeclaredDeviation deviation;  ///< uncertainty of the declared deflections
};

/// A corrected point, or the code that explains why there is none.
struct Correction {
  CorrectionCode code = CorrectionCode::kPending;
  bool extrapolated = false;  ///< outside the domain of the model's fit
  int iterations = 0;
  model::JointVector q;               ///< commanded joints [rad] or [m]
  Pose X_BP_command;                  ///< command pose of the unloaded tool point, in B
  Vec3 translation_B = Vec3::Zero();  ///< command minus target position [m]
  Vec3 rotation_B = Vec3::Zero();     ///< rotation vector from target to command [rad]
  double uncertainty_m = 0;  ///< 95 % radius of the loaded tool point; set by CellCorrector
  model::RadiusBasis basis = model::RadiusBasis::kUnknown;  ///< basis of that radius
  double residual_m = 0;                                    ///< of the solver at the solution
  double residual_rad = 0;    ///< what remains of the target's orientation; see Corrector
  double singular_value = 0;  ///< of the tip Jacobian at q, see SmallestSingularValue()
};

/// Effort spent on finding the branch: none (solve locally from the seed), 16 or 128 restarts.
enum class BranchSearch { kNone, kBrief, kThorough };

/// Solves tip(theta) * p_TP = target for the actual joint positions theta of the loaded arm, by
/// Newton's method with the rigid Jacobian (the deflection changes little with theta). The command
/// is then q = theta - s(theta). Converges to kInverseTolerance [m] and [rad]. Does not allocate;
/// the work is bounded.
/// An arm that cannot take every orientation (kinematics::ReachableOrientation) is brought to the
/// position with the tool's axis as demanded, if it can tilt the tool, else with the nearest
/// orientation. `residual_rad` is the angle to the demanded orientation that remains; the rotation
/// of the correction does not contain it. A nearest orientation that differs by more than the
/// largest allowed rotation is kUnreachable. The same holds for the pose of a predicted landing,
/// there without load.
class Corrector {
 public:
  Corrector(const model::CellModel& cell, const CorrectionLimits& limits);

  const deflection::LoadedArm& arm() const { return arm_; }
  /// The orientation that this arm can take at a position.
  kinematics::Orientation orientation() const { return orientation_; }

  /// Computes the correction of a point.
  /// @param conditions  inputs of the cell's effects: temperature, time, approach
  /// @param seed        joint positions near the desired solution [rad] or [m], shape (n)
  /// @param search      effort for finding the branch nearest to the seed
  /// @param correction  out; if `code` is not kOk, other members may be unset
  void Correct(const AssemblyPoint& point, const loads::Payload& payload,
               const effects::Conditions& conditions, const model::JointVector& seed,
               BranchSearch search, Correction& correction) const;

  /// Forward prediction: the attained pose of the loaded tool point when the pose X_BP is
  /// commanded. `landing.X_BP_command` is that attained pose, and translation and rotation are
  /// attained minus command.
  void PredictLanding(const Pose& X_BP, const Vec3& p_TP, const loads::Payload& payload,
                      const effects::Conditions& conditions, const model::JointVector& seed,
                      BranchSearch search, Correction& landing) const;

 private:
  bool LeavesTooMuch(kinematics::Orientation orientation, double residual_rad) const;
  bool Extrapolates(const model::JointVector& q, const loads::Payload& payload,
                    const effects::Conditions& conditions) const;
  void CheckSolution(const kinematics::PoseTarget& target, const Vec3& p_TP,
                     const loads::Payload& payload, const effects::Conditions& conditions,
                     const model::JointVector& theta, Correction& correction) const;

  model::CellModel cell_;
  deflection::LoadedArm arm_;
  CorrectionLimits limits_;
  kinematics::Orientation orientation_;
};

}  // namespace plumbline::correction
