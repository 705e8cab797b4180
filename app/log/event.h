// What can happen, for the log: each event with its name, its level, and what to do about it.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace plumbline {

/// Priorities of syslog(3), as journald counts them.
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
  kStorageBack,
  kStandsStill,
  kCycleLate,
  kCycleOnTime,
  kClockSet,
  kRepeated,
  kLogHeldUp,
  // robot
  kRobotSetUp,
  kRobotLinkUp,
  kRobotLinkAbsent,
  kRobotLinkLost,
  kRobotLinkBlip,
  kRobotTrusted,
  kRobotNotTrusted,
  kRobotDoubted,
  kJointsUnchecked,
  kJointsCoarse,
  kMassGuessed,
  kEmergencyStop,
  kEmergencyStopReleased,
  kPushFailed,
  kPushWorks,
  kPushLeft,
  // points
  kPointCorrected,
  kPointRefused,
  // plc
  kPlcSide,
  kPlcPortDiffers,
  kHeartbeatLost,
  kHeartbeatBack,
  kSerialLost,
  kSerialOpen,
  kClientRefused,
  kClientClosed,
  kTwoMasters,
  kOneMaster,
  // loop
  kModelInForce,
  kModelSetAside,
  kMonitorLearnt,
  kDriftAlarm,
  kDriftStands,
  kMonitorRestarted,
  kDiagnosisStarted,
  kDiagnosisNote,
  kDiagnosisCoarse,
  kDiagnosisEnded,
  kDiagnosisOutOfDate,
  kDiagnosisFailed,
  kJournalFault,
  kJournalWorks,
  kProbesUnwatched,
  kProbeRefused,
  kProbesTaken,
  kProbeQuarantined,
  kQuarantineDecided,
  kReferenceRefused,
  kClockBehind,
  // camera
  kLensValid,
  kLensStale,
  kLensRefused,
  kLensUnknown,
  kLensLeft,
  kLensState,
  kLensFound,
  kCameraLost,
  kCameraEnded,
  kCameraBack,
  kCameraRemark,
  kCameraSize,
  kSensorFault,
  kSensorBack,
  kMarksExplained,
  kMarksDoubted,
  kMarksFile,
  kBoardSeen,
  kBoardProgress,
  kBoardRefusedNow,
  kBoardRefused,
  kBoardWorker,
  kCalibrated,
  kLensStoreFault,
  kLensStoreMended,
  kLensStoreWorks,
  // monitor
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
  kFleetForwarded,
  kFleetDropping,
  kFleetDropped,
  kFleetQueueFault,
  kFleetQueueWorks,
  kFleetJournal,
  kFleetFeedLost,
  kFleetFeedBack,
  kCount
};

/// An entry of the catalogue. Name and id are an interface: others filter and alarm by them, so
/// that they stay as they are, also where the words change.
struct EventEntry {
  Event event;
  const char* name;       ///< as in PLUMBLINE_EVENT of the journal
  LogLevel level;         ///< of every line of it
  const char* id;         ///< MESSAGE_ID: 32 hexadecimal digits, from systemd-id128(1)
  const char* component;  ///< service, robot, points, plc, loop, camera, monitor, fleet
  const char* line;       ///< how the line begins; "..." stands for what differs
  const char* means;      ///< empty where the line says it all
  const char* remedy;     ///< what to do; empty: nothing
};

const EventEntry& EntryOf(Event event);
/// nullptr: no event has that name.
const EventEntry* FindEvent(std::string_view name);
/// In the order of `Event`.
std::span<const EventEntry> EventCatalogue();

}  // namespace plumbline
