// Event catalogue: every event that is logged, with its name, level, meaning and remedy.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace plumbline::log {

/// Log levels; the values are the priorities of syslog(3) and journald.
enum class LogLevel { kError = 3, kWarning = 4, kNotice = 5, kInfo = 6 };

enum class Event : std::uint8_t {
  // service
  kStarted,
  kNotStarted,
  kEnding,
  kFileFault,
  kFileWarning,
  kReloaded,
  kNotReloaded,
  kNeedsRestart,
  kStateDirectory,
  kBootCounter,
  kStorageLost,
  kStorageRestored,
  kThreadStalled,
  kCycleLate,
  kCycleOnTime,
  kClockSet,
  kRepeated,
  kLogHeldUp,
  // robot
  kRobotSetupFailed,
  kRobotLinkUp,
  kRobotLinkAbsent,
  kRobotLinkLost,
  kRobotLinkInterrupted,
  kRobotNotice,
  kRobotTrusted,
  kRobotNotTrusted,
  kRobotBrieflyUntrusted,
  kJointsUnchecked,
  kJointsCoarse,
  kControllerPoseDiffers,
  kControllerModel,
  kCompensatedTwice,
  kControllerUnexplained,
  kControllerAgrees,
  kMassGuessed,
  kEmergencyStop,
  kEmergencyStopReleased,
  kPushFailed,
  kPushWorks,
  kPushNotWithdrawn,
  // motion
  kMotionPortFailed,
  kMotionAnswering,
  kMotionEnded,
  kMotionNotAnswered,
  kMotionCorrecting,
  kMotionNotCorrecting,
  kMotionIgnored,
  // points
  kPointCorrected,
  kPointRefused,
  kPointsWithdrawn,
  kPointsRestored,
  // plc
  kPlcServerFailed,
  kPlcPortDiffers,
  kHeartbeatLost,
  kHeartbeatBack,
  kSerialLost,
  kSerialOpen,
  kClientRefused,
  kClientClosed,
  kTwoMasters,
  kOneMaster,
  // monitoring
  kModelInForce,
  kModelSetAside,
  kModelRefused,
  kReferenceLearned,
  kDriftAlarm,
  kDriftAlarmActive,
  kMonitorRestarted,
  kDiagnosisStarted,
  kDiagnosisNote,
  kDiagnosisCoarse,
  kDiagnosisEnded,
  kDiagnosisOutOfDate,
  kDiagnosisFailed,
  kJournalFault,
  kJournalWorks,
  kProbesNotMonitored,
  kProbeRefused,
  kProbesAccepted,
  kProbeQuarantined,
  kGaugeRecorded,
  kGaugeRefused,
  kGaugeLost,
  kGaugeBack,
  kQuarantineDecided,
  kReferenceRefused,
  kRadiusContradicted,
  kClockBehind,
  // camera
  kLensValid,
  kLensStale,
  kLensRefused,
  kLensUnknown,
  kLensInvalidated,
  kLensState,
  kLensFound,
  kCameraLost,
  kCameraEnded,
  kCameraBack,
  kCameraWarning,
  kCameraSize,
  kSensorFault,
  kSensorBack,
  kZoomDriftRefined,
  kTagsContradict,
  kTagFileFault,
  kBoardSeen,
  kBoardProgress,
  kCalibrationNotPossible,
  kBoardRefused,
  kBoardWorker,
  kCalibrated,
  kLensStoreFault,
  kLensStoreRestored,
  kLensStoreWorks,
  // display
  kViewStarted,
  kViewUnavailable,
  kViewFault,
  kViewNote,
  kViewLinkLost,
  kViewLinkBack,
  kDisplayLost,
  kDisplayBack,
  kInterferenceBegins,
  kInterferenceNear,
  kInterferenceEnds,
  kAlarmPicture,
  kPageServed,
  kPageFault,
  kPageRefused,
  // fleet
  kFleetStarted,
  kFleetNotStarted,
  kBrokerUp,
  kBrokerLost,
  kBrokerIntruded,
  kFleetForwarded,
  kFleetDropping,
  kFleetDropped,
  kFleetQueueFault,
  kFleetQueueWorks,
  kFleetJournal,
  kFleetCell,
  kFleetFeedLost,
  kFleetFeedBack,
  // collect
  kCollectStarted,
  kCollectNotStarted,
  kCollectBrokerUp,
  kCollectBrokerLost,
  kCollectDatabaseUp,
  kCollectDatabaseLost,
  kCollectDeadLetters,
  kCollectRefused,
  kCollectRetention,
  // sparkplug
  kSparkplugStarted,
  kSparkplugNotStarted,
  kSparkplugCellsUp,
  kSparkplugCellsLost,
  kSparkplugHostsUp,
  kSparkplugHostsLost,
  kSparkplugUnreadable,
  kSparkplugMissed,
  kSparkplugTooMany,
  kSparkplugCommand,
  kSparkplugPoints,
  // worker
  kWorkerStarted,
  kWorkerDatabaseLost,
  kWorkerDatabaseUp,
  kWorkerJobFailed,
  kWorkerJobLost,
  kWorkerJobReturned,
  kCount
};

/// An entry of the catalogue. Name and id are an interface that users filter and raise alarms by:
/// they never change, even if the wording does.
struct EventEntry {
  Event event;
  const char* name;       ///< value of PLUMBLINE_EVENT in the journal
  LogLevel level;         ///< of every line of this event
  const char* id;         ///< MESSAGE_ID: 32 hexadecimal digits, from systemd-id128(1)
  const char* component;  ///< service, robot, points, plc, monitoring, camera, display, fleet, ...
  const char* line;       ///< how the line starts; "..." stands for the variable parts
  const char* means;      ///< empty if the line is self-explanatory
  const char* remedy;     ///< what to do; empty if nothing
};

const EventEntry& EntryOf(Event event);
/// nullptr if no event has that name.
const EventEntry* FindEvent(std::string_view name);
/// All entries, in the order of `Event`.
std::span<const EventEntry> EventCatalogue();

}  // namespace plumbline::log
