#include "firmware-like/cell_health.h"

#include <array>

#include "firmware-like/snapshot.h"

namespace plumbline {
namespace {

struct Entry {
  HealthReason reason;
  const char* text;
  const char* remedy;
  bool (*holds)(const HealthFacts& facts);
};

template <std::uint16_t Bit>
bool Alarm(const HealthFacts& facts) {
  return (facts.alarms & Bit) != 0;
}
template <std::uint16_t Bit>
bool Warning(const HealthFacts& facts) {
  return (facts.warnings & Bit) != 0;
}

/// Most severe first.
constexpr std::array kEntries = {
    Entry{HealthReason::kNoDaemon, "no daemon", "start plumblined; see its log",
          [](const HealthFacts& facts) { return facts.daemon_silent; }},
    Entry{HealthReason::kEmergencyStop, "emergency stop", "make safe, release the emergency stop",
          Alarm<alarm::kEmergencyStop>},
    Entry{HealthReason::kRobotNotRead, "no reading from the robot",
          "check the robot controller and its address", Alarm<alarm::kRobotMissing>},
    Entry{HealthReason::kRobotStale, "robot input stale", "check the cable to the robot",
          Alarm<alarm::kRobotStale>},
    Entry{HealthReason::kRobotImplausible, "robot input implausible",
          "check the robot profile: joints jump or leave their limits",
          Alarm<alarm::kRobotImplausible>},
    Entry{HealthReason::kDecodingWrong, "tool pose contradicts the joints",
          "check the robot profile and the tool", Alarm<alarm::kDecodingWrong>},
    Entry{HealthReason::kPayloadUnknown, "payload unknown", "set the payload",
          Alarm<alarm::kPayloadUnknown>},
    Entry{HealthReason::kTorquesUnknown, "link masses not declared", "declare the links' masses",
          Alarm<alarm::kTorquesUnknown>},
    Entry{HealthReason::kPointRefused, "a point has no correction",
          "do not assemble there; see the point's code", Alarm<alarm::kPointRefused>},
    Entry{HealthReason::kInterference, "interference: watched objects touch",
          "stop, and move them apart", Warning<warning::kInterference>},
    Entry{HealthReason::kApproachBlocked, "an approach path is blocked", "clear the path",
          Warning<warning::kApproachBlocked>},
    Entry{HealthReason::kDrift, "drift: probes no longer agree with the model",
          "do not rely on the radius; read the diagnosis", Warning<warning::kDrift>},
    Entry{HealthReason::kModelSetAside, "the applied model is not in force",
          "run plumbline model list", Warning<warning::kModelSetAside>},
    Entry{HealthReason::kRadiusUnknown, "a point's radius has no basis",
          "fit the model to measured points",
          [](const HealthFacts& facts) { return facts.weakest_basis == RadiusBasis::kUnknown; }},
    Entry{HealthReason::kRadiusTooLarge, "a point's radius exceeds the largest correction",
          "declare what the cell leaves open; measure probes",
          [](const HealthFacts& facts) { return facts.radius_too_large; }},
    Entry{HealthReason::kExtrapolating, "a point lies outside the calibrated range",
          "measure probes there", [](const HealthFacts& facts) { return facts.extrapolating; }},
    Entry{HealthReason::kFiducialMoved, "a reference tag has moved",
          "see the log for which; measure its place again",
          [](const HealthFacts& facts) { return facts.fiducial_moved; }},
    Entry{HealthReason::kLensStale, "the camera's lens is not verified",
          "show the fixed tags, or the calibration board", Warning<warning::kLensStale>},
    Entry{HealthReason::kCameraLost, "camera or zoom sensor lost", "check its cable",
          Warning<warning::kCameraLost>},
    Entry{HealthReason::kSceneLost, "interference is no longer supervised", "start plumbline-view",
          [](const HealthFacts& facts) { return facts.scene_lost; }},
    Entry{HealthReason::kStorage, "the state directory cannot be written",
          "free disk space, check its permissions", Warning<warning::kStorage>},
    Entry{HealthReason::kMonitoringFault, "the journal or the diagnosis has failed", "see the log",
          Warning<warning::kLoopFault>},
    Entry{HealthReason::kTwoMasters, "two clients write commands",
          "let one PLC command; set plc.allow", Warning<warning::kTwoMasters>},
    Entry{HealthReason::kCycleOverrun, "the control cycle is late",
          "stop other programs on this computer", Warning<warning::kCycleOverrun>},
    Entry{HealthReason::kPlcHeartbeatLost, "PLC heartbeat lost", "check the PLC",
          Warning<warning::kPlcHeartbeatLost>},
    Entry{HealthReason::kDecodingUnchecked, "joints not checked against a tool pose",
          "add the tool pose to the robot profile", Warning<warning::kDecodingUnchecked>},
    Entry{HealthReason::kCoarseJoints, "joint registers are coarse", "use finer registers",
          Warning<warning::kCoarseJoints>},
    Entry{HealthReason::kMassCentresGuessed, "a link's centre of mass is guessed",
          "declare link_com_mm", Warning<warning::kMassCentresGuessed>},
    Entry{HealthReason::kReferenceRefused, "drift is not watched: reference probes disagree",
          "see the log; restart the monitor by command 8",
          [](const HealthFacts& facts) { return facts.reference_refused; }},
    Entry{HealthReason::kQuarantined, "probes wait in quarantine",
          "plumbline journal quarantine list",
          [](const HealthFacts& facts) { return facts.quarantined; }},
    Entry{HealthReason::kPointsPending, "points are still being computed", "wait",
          [](const HealthFacts& facts) { return facts.pending; }},
    Entry{HealthReason::kProposalWaiting, "a corrected model waits for approval",
          "run plumbline model list", Warning<warning::kProposalWaiting>},
    Entry{HealthReason::kBoardWanted, "the calibration board is asked for", "show the board",
          Warning<warning::kBoardWanted>},
    Entry{HealthReason::kSceneIncomplete, "some objects are not measured", "see Distances",
          [](const HealthFacts& facts) { return facts.scene_incomplete; }},
    Entry{HealthReason::kRadiusAssumed, "radius assumed, not measured",
          "measure probes to validate it",
          [](const HealthFacts& facts) { return facts.weakest_basis == RadiusBasis::kAssumed; }},
    Entry{HealthReason::kNoPoints, "no point is configured", "add [[point]] tables, then reload",
          [](const HealthFacts& facts) { return facts.no_points; }},
};

const Entry* Find(HealthReason reason) {
  for (const Entry& entry : kEntries) {
    if (entry.reason == reason) return &entry;
  }
  return nullptr;
}

}  // namespace

HealthSeverity SeverityOf(HealthReason reason) {
  if (reason == HealthReason::kNone) return HealthSeverity::kGood;
  if (reason < HealthReason::kDrift) return HealthSeverity::kAlarm;
  return reason < HealthReason::kProposalWaiting ? HealthSeverity::kAttention
                                                 : HealthSeverity::kNotice;
}

CellHealth HealthOf(const HealthFacts& facts) {
  for (const Entry& entry : kEntries) {
    if (entry.holds(facts)) return {SeverityOf(entry.reason), entry.reason};
  }
  return {};
}

const char* Describe(HealthSeverity severity) {
  switch (severity) {
    case HealthSeverity::kGood:
      return "OK";
    case HealthSeverity::kNotice:
      return "NOTE";
    case HealthSeverity::kAttention:
      return "ATTENTION";
    case HealthSeverity::kAlarm:
      return "ALARM";
  }
  return "ALARM";
}

const char* Describe(HealthReason reason) {
  const Entry* const entry = Find(reason);
  return entry != nullptr ? entry->text : "";
}

const char* RemedyOf(HealthReason reason) {
  const Entry* const entry = Find(reason);
  return entry != nullptr ? entry->remedy : "";
}

}  // namespace plumbline
