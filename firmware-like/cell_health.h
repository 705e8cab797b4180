// Overall health of the cell: one severity and one reason, shown first by every display.
#pragma once

#include <cstdint>
#include <optional>

#include "firmware-like/model/radius_basis.h"

namespace plumbline {

/// Severity of the cell's health. The numbers are those of the register map.
enum class HealthSeverity : std::uint8_t {
  kGood = 0,       ///< no known problem
  kNotice = 1,     ///< informational; corrected points may be used
  kAttention = 2,  ///< points are served, but a precondition is violated; inspect the cell
  kAlarm = 3,      ///< do not assemble
};

/// Reason for the severity, most severe first; if several apply, the first one listed is shown. The
/// numbers are those of the register map.
enum class HealthReason : std::uint8_t {
  kNone = 0,
  // Alarms.
  kEmergencyStop = 1,
  kRobotNotRead = 2,      ///< no reading from the controller since start-up
  kRobotStale = 3,        ///< the last reading is too old
  kRobotImplausible = 4,  ///< the readings are implausible
  kDecodingWrong = 5,     ///< the reported tool pose contradicts the joints
  kPayloadUnknown = 6,
  kTorquesUnknown = 7,    ///< link masses are missing
  kPointRefused = 8,      ///< a configured point has no correction
  kInterference = 9,      ///< monitored objects touch
  kApproachBlocked = 10,  ///< an object blocks an approach path
  kNoDaemon = 11,         ///< page and display only: the daemon has exited or hangs
  kRequiredLens = 12,     ///< points are withdrawn: a camera that they require has no valid lens
  // Attention.
  kDrift = 20,            ///< probes no longer agree with the model
  kModelSetAside = 21,    ///< the applied model is not in force
  kRadiusUnknown = 22,    ///< a valid point's radius has no basis
  kExtrapolating = 23,    ///< a point lies outside the domain that the model was fitted on
  kFiducialMoved = 24,    ///< a reference tag is not where it was declared
  kLensStale = 25,        ///< do not use measurements of the camera
  kCameraLost = 26,       ///< no images, or no zoom reading
  kSceneLost = 27,        ///< interference was monitored and no longer is
  kStorage = 28,          ///< the state directory is not writable
  kMonitoringFault = 29,  ///< journal or diagnosis failed
  kTwoMasters = 30,       ///< two clients write the command window
  kCycleOverrun = 31,
  kPlcHeartbeatLost = 32,
  kDecodingUnchecked = 33,  ///< the robot profile has no tool pose to check the joints against
  kCoarseJoints = 34,       ///< the joint register resolution contributes more than 0.1 mm
  kMassCentresGuessed = 35,
  kReferenceRefused = 36,    ///< the drift monitor has no reference: its probes disagree
  kQuarantined = 37,         ///< probes contradict the model and await a person's decision
  kPointsPending = 38,       ///< some points are still being computed
  kRadiusTooLarge = 39,      ///< a valid point's radius exceeds the largest allowed correction
  kObjectsNear = 40,         ///< monitored objects are nearer than their declared distance
  kRadiusContradicted = 41,  ///< the drift monitor's reference contradicts the stated radius
  kCompensatedTwice = 42,    ///< the controller's tool pose contains what the cell corrects as well
  // Notices.
  kProposalWaiting = 50,  ///< a corrected model awaits approval
  kBoardWanted = 51,      ///< the calibration board is requested
  kSceneIncomplete = 52,  ///< some monitored pairs of objects are not measured
  kRadiusAssumed = 53,    ///< a valid point's radius is based on typical values
  kNoPoints = 54,         ///< no point is configured; only commands are corrected
};
inline constexpr HealthReason kLastHealthReason = HealthReason::kNoPoints;

struct CellHealth {
  HealthSeverity severity = HealthSeverity::kGood;
  HealthReason reason = HealthReason::kNone;
  bool operator==(const CellHealth&) const = default;
};

/// Inputs of the health decision; alarm and warning words as in snapshot.h.
struct HealthInputs {
  std::uint16_t alarms = 0, warnings = 0;
  bool extrapolating = false;  ///< a valid point is extrapolated
  std::optional<model::RadiusBasis>
      weakest_basis{};            ///< among valid points; nullopt if there is none
  bool radius_too_large = false;  ///< a valid point's radius exceeds the largest allowed correction
  bool fiducial_moved = false;
  bool required_lens_missing = false;  ///< points are withdrawn until a camera's lens is valid
  bool objects_near = false, scene_lost = false, scene_incomplete = false;
  bool reference_refused = false, radius_contradicted = false, quarantined = false;
  bool compensated_twice = false;  ///< the controller compensates what the cell corrects
  bool pending = false;            ///< a point is still being computed
  bool no_points = false;          ///< no point is configured
  bool daemon_silent = false;      ///< page and display only: the daemon no longer reports
};

/// The most severe reason that applies.
CellHealth HealthOf(const HealthInputs& facts);

HealthSeverity SeverityOf(HealthReason reason);

/// One word: "OK", "NOTE", "ATTENTION", "ALARM".
const char* Describe(HealthSeverity severity);
/// Short description of the problem; "" for kNone.
const char* Describe(HealthReason reason);
/// Short instruction on what to do; "" if no action is needed.
const char* RemedyOf(HealthReason reason);

}  // namespace plumbline
