// The command that makes the loaded tip land where it is wanted.
#pragma once

#include <cstdint>

#include "firmware-like/correction/assembly_point.h"
#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/model/radius_basis.h"

namespace plumbline {

/// Why there is, or is not, a corrected point. The numbers are those of the register map.
enum class CorrectionCode : std::uint8_t {
  kOk = 0,
  kUnreachable = 1,          ///< no posture of the arm brings the tip there
  kJointLimit = 2,           ///< every posture that does breaks a joint limit
  kSingular = 3,             ///< reached only beside a singular posture
  kTooLarge = 4,             ///< the correction exceeds the largest that is allowed
  kNotConverged = 5,         ///< the iteration did not settle; a defect worth reporting
  kTorquesUnknown = 6,       ///< joints yield, but a link's mass is not declared
  kPayloadUnknown = 7,       ///< the mass carried, or its centre of gravity, is not known
  kNoRobot = 8,              ///< robot input is missing, stale or not trusted
  kUnknownPoint = 9,         ///< no assembly point of that number
  kBadCommand = 10,          ///< the command's code or values make no sense
  kPending = 11,             ///< not computed yet
  kNotRecorded = 12,         ///< probes are not recorded: no [loop], or its journal is behind
  kNoCamera = 13,            ///< no camera is configured
  kLensStale = 14,           ///< the camera's lens is not to be trusted now
  kTipNotSeen = 15,          ///< the camera does not see the tool, or the tool moves
  kCamerasDisagree = 16,     ///< two cameras see the tip at two places
  kProbeImplausible = 17,    ///< zero, in another unit, or beyond the arm's reach
  kRobotMoving = 18,         ///< a probe needs the robot at standstill
  kStorageUnavailable = 19,  ///< the journal cannot be written: disk full or read-only
  kProbeQuarantined = 20,    ///< kept, but contradicts the model by more than any plausible effect
};

inline constexpr CorrectionCode kLastCorrectionCode = CorrectionCode::kProbeQuarantined;

/// Short words for a code, for the log and the register map.
const char* Describe(CorrectionCode code);

struct CorrectionLimits {
  double max_translation_m = 0.05;
  double max_rotation_rad = 0.05;
  double min_singular_value = 0.02;  ///< of the tip's Jacobian, metres and radians alike
  DeclaredDeviation deviation;       ///< of what the cell declares
};

/// A corrected point, or the code that says why there is none.
struct Correction {
  CorrectionCode code = CorrectionCode::kPending;
  bool extrapolated = false;  ///< outside the calibrated range
  int iterations = 0;
  JointVector q;                      ///< joints that the command leads to [rad]
  Pose X_BP_command;                  ///< pose to command for the unloaded tool point, in B
  Vec3 translation_B = Vec3::Zero();  ///< command minus wanted position [m]
  Vec3 rotation_B = Vec3::Zero();     ///< rotation vector from wanted to command [rad]
  double uncertainty_m = 0;  ///< radius that holds 95 % of where the loaded tip lands; see Machine
  RadiusBasis basis = RadiusBasis::kUnknown;  ///< what that radius rests on
  double residual_m = 0;                      ///< of the model at the solution
  double residual_rad = 0;
  double singular_value = 0;  ///< smallest of the tip's Jacobian at q, see SmallestSingularValue()
};

/// What may be spent on a correction: the local solution only, or a search for other branches.
enum class BranchSearch { kNone, kBrief, kThorough };

/// Solves tip(theta) * p_TP = wanted for the joint positions theta that the loaded arm really
/// takes, by Newton's method with the rigid Jacobian (the deflection changes little with theta),
/// then commands q = theta - s(theta). Converged to kInverseTolerance [m] and [rad] of the model.
/// Allocates nothing; bounded work.
class Corrector {
 public:
  Corrector(const CellModel& cell, const CorrectionLimits& limits);

  const LoadedArm& arm() const { return arm_; }

  /// @param conditions  what the cell's effects read: temperature, time, the way there
  /// @param seed    joint positions near which the solution is wanted, shape (n)
  /// @param search  how hard to look for the branch nearest to the seed
  void Correct(const AssemblyPoint& point, const Payload& payload, const Conditions& conditions,
               const JointVector& seed, BranchSearch search, Correction& correction) const;

  /// The reverse: where the loaded tool point lands that is commanded to X_BP (unloaded).
  /// `landing.X_BP_command` then is the pose reached.
  void PredictLanding(const Pose& X_BP, const Vec3& p_TP, const Payload& payload,
               const Conditions& conditions, const JointVector& seed, BranchSearch search,
               Correction& landing) const;

 private:
  void CheckSolution(const Pose& X_BP_wanted, const Vec3& p_TP, bool orientation_free,
             const Payload& payload, const Conditions& conditions, const JointVector& theta,
             Correction& correction) const;

  CellModel cell_;
  LoadedArm arm_;
  CorrectionLimits limits_;
};

}  // namespace plumbline
