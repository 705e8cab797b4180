// The cell's health in one severity and one reason: what every surface shows first.
#pragma once

#include <cstdint>
#include <optional>

#include "firmware-like/model/radius_basis.h"

namespace plumbline {

/// How bad it is. The numbers are those of the register map.
enum class HealthSeverity : std::uint8_t {
  kGood = 0,       ///< nothing is known against the corrected points
  kNotice = 1,     ///< they may be used; something about them is worth knowing
  kAttention = 2,  ///< they are served, but do not rest on what they should; a person must look
  kAlarm = 3,      ///< do not assemble
};

/// Why, most severe first; of two that hold at once the one listed first is shown. The numbers are
/// those of the register map.
enum class HealthReason : std::uint8_t {
  kNone = 0,
  // Alarms.
  kEmergencyStop = 1,
  kRobotNotRead = 2,      ///< nothing came from the controller since the start
  kRobotStale = 3,        ///< its last reading is too old
  kRobotImplausible = 4,  ///< its readings make no sense
  kDecodingWrong = 5,     ///< its tool pose contradicts its joints
  kPayloadUnknown = 6,
  kTorquesUnknown = 7,    ///< link masses are missing
  kPointRefused = 8,      ///< a configured point has no correction
  kInterference = 9,      ///< watched objects touch
  kApproachBlocked = 10,  ///< an object on an approach path
  kNoDaemon = 11,         ///< on page and display only: the daemon that reported is gone or hangs
  // Attention.
  kDrift = 20,            ///< probes no longer agree with the model
  kModelSetAside = 21,    ///< the applied model is not in force
  kRadiusUnknown = 22,    ///< a valid point's radius has no basis
  kExtrapolating = 23,    ///< a point lies outside what the model was fitted on
  kFiducialMoved = 24,    ///< a reference tag is not where it was declared
  kLensStale = 25,        ///< what the camera measures is not to be used
  kCameraLost = 26,       ///< no images, or no zoom reading
  kSceneLost = 27,        ///< interference was supervised and is no longer
  kStorage = 28,          ///< the state directory cannot be written
  kMonitoringFault = 29,  ///< journal or diagnosis fail
  kTwoMasters = 30,       ///< two clients write the command window
  kCycleOverrun = 31,
  kPlcHeartbeatLost = 32,
  kDecodingUnchecked = 33,  ///< the robot profile offers no tool pose to check the joints by
  kCoarseJoints = 34,       ///< the joint registers' steps cost more than 0.1 mm
  kMassCentresGuessed = 35,
  kReferenceRefused = 36,  ///< the drift monitor has no reference: its probes disagree
  kQuarantined = 37,       ///< probes contradict the model and wait for a person
  kPointsPending = 38,     ///< some points are still being computed
  kRadiusTooLarge = 39,    ///< a valid point's radius exceeds the largest correction allowed
  // Notices.
  kProposalWaiting = 50,  ///< a corrected model waits for approval
  kBoardWanted = 51,      ///< the calibration board is asked for
  kSceneIncomplete = 52,  ///< some watched pairs of objects are not measured
  kRadiusAssumed = 53,    ///< a valid point's radius rests on typical values
  kNoPoints = 54,         ///< no point is configured: nothing is corrected but what commands ask
};
inline constexpr HealthReason kLastHealthReason = HealthReason::kNoPoints;

struct CellHealth {
  HealthSeverity severity = HealthSeverity::kGood;
  HealthReason reason = HealthReason::kNone;
  bool operator==(const CellHealth&) const = default;
};

/// Everything that health is decided from. Words as in snapshot.h.
struct HealthFacts {
  std::uint16_t alarms = 0, warnings = 0;
  bool extrapolating = false;                  ///< of a valid point
  std::optional<RadiusBasis> weakest_basis{};  ///< of valid points; empty: there is none
  bool radius_too_large = false;  ///< of a valid point: beyond the largest correction allowed
  bool fiducial_moved = false;
  bool scene_lost = false, scene_incomplete = false;
  bool reference_refused = false, quarantined = false;
  bool pending = false;        ///< a point is still being computed
  bool no_points = false;      ///< none is configured
  bool daemon_silent = false;  ///< of page and display: the rest is not known any more
};

/// The most severe reason that holds.
CellHealth HealthOf(const HealthFacts& facts);

HealthSeverity SeverityOf(HealthReason reason);

/// One word: "OK", "NOTE", "ATTENTION", "ALARM".
const char* Describe(HealthSeverity severity);
/// What is the matter, in a few words; "" for kNone.
const char* Describe(HealthReason reason);
/// What to do about it, in a few words; "" where nothing needs to be done.
const char* RemedyOf(HealthReason reason);

}  // namespace plumbline
