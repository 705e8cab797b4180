#include "firmware-like/cell_health.h"

#include <array>

#include "firmware-like/snapshot.h"

namespace plumbline {
namespace {

struct Entry {
  HealthReason reason;
  const char* text;
  const char* remedy;
  bool (*holds)(const HealthInputs& facts);
};

template <std::uint16_t Bit>
bool Alarm(const HealthInputs& facts) {
  return (facts.alarms & Bit) != 0;
}
template <std::uint16_t Bit>
bool Warning(const HealthInputs& facts) {
  return (facts.warnings & Bit) != 0;
}

/// Most severe first.
constexpr std::array kEntries = {
    Entry{HealthReason::kNoDaemon, "no daemon",
          "systemctl start plumbline; journalctl -u plumbline says why it stopped",
          [](const HealthInputs& facts) { return facts.daemon_silent; }},
    Entry{HealthReason::kEmergencyStop, "emergency stop",
          "make the cell safe, then release the emergency stop", Alarm<alarm::kEmergencyStop>},
    Entry{HealthReason::kRobotNotRead, "no reading from the robot",
          "check the robot controller and its address", Alarm<alarm::kRobotMissing>},
    Entry{HealthReason::kRobotStale, "robot input stale", "check the cable to the robot",
          Alarm<alarm::kRobotStale>},
    Entry{HealthReason::kRobotImplausible, "robot input implausible",
          "check the robot profile: joints jump or exceed their limits",
          Alarm<alarm::kRobotImplausible>},
    Entry{HealthReason::kDecodingWrong, "tool pose contradicts the joints",
          "check the robot profile and the tool", Alarm<alarm::kDecodingWrong>},
    Entry{HealthReason::kPayloadUnknown, "payload unknown", "set the payload",
          Alarm<alarm::kPayloadUnknown>},
    Entry{HealthReason::kTorquesUnknown, "link masses not declared", "declare the links' masses",
          Alarm<alarm::kTorquesUnknown>},
    Entry{HealthReason::kRequiredLens, "points withdrawn: the camera's lens is not valid",
          "keep the zoom at rest and the reference tags in view, or show the calibration board",
          [](const HealthInputs& facts) { return facts.required_lens_missing; }},
    Entry{HealthReason::kPointRefused, "a point has no correction",
          "do not assemble at that point; plumbline status names it, with the cause",
          Alarm<alarm::kPointRefused>},
    Entry{HealthReason::kInterference, "interference: monitored objects in contact",
          "stop and move them apart", Warning<warning::kInterference>},
    Entry{HealthReason::kApproachBlocked, "an approach path is blocked", "clear the path",
          Warning<warning::kApproachBlocked>},
    Entry{HealthReason::kObjectsNear, "monitored objects are near each other",
          "increase the distance, or reduce near_mm of the pair",
          [](const HealthInputs& facts) { return facts.objects_near; }},
    Entry{HealthReason::kRadiusContradicted, "probes contradict the stated radius",
          "do not rely on the radius; check tool, load and measurement frame, read the diagnosis",
          [](const HealthInputs& facts) { return facts.radius_contradicted; }},
    Entry{HealthReason::kCompensatedTwice, "the controller compensates what this cell corrects",
          "do not rely on the corrections: plumbline log --event compensated-twice says what to do",
          [](const HealthInputs& facts) { return facts.compensated_twice; }},
    Entry{HealthReason::kDrift, "drift: probes no longer agree with the model",
          "do not rely on the radius; read the diagnosis", Warning<warning::kDrift>},
    Entry{HealthReason::kModelSetAside, "the applied model is not in force",
          "run plumbline model list", Warning<warning::kModelSetAside>},
    Entry{HealthReason::kRadiusUnknown, "a point's radius has no basis",
          "fit the model to measured points",
          [](const HealthInputs& facts) {
            return facts.weakest_basis == model::RadiusBasis::kUnknown;
          }},
    Entry{HealthReason::kRadiusTooLarge, "a point's radius exceeds the largest correction",
          "declare the missing cell parameters, or measure probes",
          [](const HealthInputs& facts) { return facts.radius_too_large; }},
    Entry{HealthReason::kExtrapolating, "a point lies outside the calibrated range",
          "measure probes there", [](const HealthInputs& facts) { return facts.extrapolating; }},
    Entry{HealthReason::kFiducialMoved, "a reference tag has moved",
          "measure its position again; plumbline log names the tag",
          [](const HealthInputs& facts) { return facts.fiducial_moved; }},
    Entry{HealthReason::kLensStale, "the camera's lens is not verified",
          "clear the view of the reference tags, or show the calibration board",
          Warning<warning::kLensStale>},
    Entry{HealthReason::kCameraLost, "camera or zoom sensor lost", "check its cable",
          Warning<warning::kCameraLost>},
    Entry{
        HealthReason::kSceneLost, "interference is no longer monitored",
        "plumbline log --level warning says why: correct the object table, or simplify its meshes",
        [](const HealthInputs& facts) { return facts.scene_lost; }},
    Entry{HealthReason::kStorage, "the state directory is not writable",
          "free disk space, or check its permissions", Warning<warning::kStorage>},
    Entry{HealthReason::kMonitoringFault, "the journal or the diagnosis has failed",
          "plumbline log --level warning says why", Warning<warning::kMonitoringFault>},
    Entry{HealthReason::kTwoMasters, "two clients write commands",
          "let only one PLC send commands; set plc.allow", Warning<warning::kTwoMasters>},
    Entry{HealthReason::kCycleOverrun, "the control cycle misses its deadline",
          "stop other programs on this computer", Warning<warning::kCycleOverrun>},
    Entry{HealthReason::kPlcHeartbeatLost, "PLC heartbeat lost", "check the PLC",
          Warning<warning::kPlcHeartbeatLost>},
    Entry{HealthReason::kDecodingUnchecked, "joints not checked against a tool pose",
          "read the tool pose, too: [tcp] of the robot profile; a replay has none",
          Warning<warning::kDecodingUnchecked>},
    Entry{HealthReason::kCoarseJoints, "joint registers are coarse", "use finer registers",
          Warning<warning::kCoarseJoints>},
    Entry{HealthReason::kMassCentresGuessed, "a link's centre of mass is assumed",
          "declare link_com_mm", Warning<warning::kMassCentresGuessed>},
    Entry{HealthReason::kReferenceRefused, "drift is not monitored: reference probes disagree",
          "measure a new reference after command 8; plumbline log lists the probes",
          [](const HealthInputs& facts) { return facts.reference_refused; }},
    Entry{HealthReason::kQuarantined, "quarantined probes await a decision",
          "run plumbline journal quarantine list",
          [](const HealthInputs& facts) { return facts.quarantined; }},
    Entry{HealthReason::kPointsPending, "points are still being computed", "wait",
          [](const HealthInputs& facts) { return facts.pending; }},
    Entry{HealthReason::kProposalWaiting, "a corrected model awaits approval",
          "run plumbline model list", Warning<warning::kProposalWaiting>},
    Entry{HealthReason::kBoardWanted, "a camera requests calibration", "show the calibration board",
          Warning<warning::kBoardWanted>},
    Entry{HealthReason::kSceneIncomplete, "some distances are not measured", "see Distances",
          [](const HealthInputs& facts) { return facts.scene_incomplete; }},
    Entry{HealthReason::kRadiusAssumed, "radius is assumed, not measured",
          "measure probes to validate it",
          [](const HealthInputs& facts) {
            return facts.weakest_basis == model::RadiusBasis::kAssumed;
          }},
    Entry{HealthReason::kNoPoints, "no point is configured", "add [[point]] tables and reload",
          [](const HealthInputs& facts) { return facts.no_points; }},
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

CellHealth HealthOf(const HealthInputs& facts) {
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
