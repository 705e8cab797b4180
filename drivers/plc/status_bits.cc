// Bit tables of the status, alarm and warning words and of the monitoring state (register 400).
#include <array>

#include "drivers/plc/register_map.h"

namespace plumbline::plc {
namespace {

constexpr std::array kStatusBits = {
    BitMeaning{status::kReady, "ready"},
    BitMeaning{
        status::kBusy,
        "busy (reserved, always 0: a command is answered within one cycle, see result_echo)"},
    BitMeaning{status::kResultValid, "result valid"},
    BitMeaning{status::kRobotLink, "robot link"},
    BitMeaning{status::kWarning, "warning"},
    BitMeaning{status::kError, "error"},
    BitMeaning{status::kLensCalibrated, "lens calibrated"},
    BitMeaning{status::kExtrapolating, "extrapolating"},
    BitMeaning{status::kTemperatureValid, "temperature valid"},
    BitMeaning{status::kPayloadValid, "payload valid"},
    BitMeaning{status::kPlcHeartbeatSeen, "PLC heartbeat seen"},
    BitMeaning{status::kManual, "manual"},
    BitMeaning{status::kToggle, "toggle (changes every second)"},
    BitMeaning{status::kCompensatedTwice,
               "the controller compensates what this cell corrects as well"},
};

constexpr std::array kAlarmBits = {
    BitMeaning{alarm::kRobotMissing, "nothing read from the robot"},
    BitMeaning{alarm::kRobotStale, "robot input stale"},
    BitMeaning{alarm::kRobotImplausible, "robot input implausible"},
    BitMeaning{alarm::kDecodingWrong, "reported tool pose contradicts the joints"},
    BitMeaning{alarm::kPayloadUnknown, "payload unknown"},
    BitMeaning{alarm::kTorquesUnknown, "link masses not declared"},
    BitMeaning{alarm::kPointRefused, "a point has no correction"},
    BitMeaning{alarm::kEmergencyStop, "emergency stop reported"},
};

constexpr std::array kWarningBits = {
    BitMeaning{warning::kDecodingUnchecked, "decoding not checked against a tool pose"},
    BitMeaning{warning::kPlcHeartbeatLost, "PLC heartbeat lost"},
    BitMeaning{warning::kCycleOverrun, "cycle overrun"},
    BitMeaning{warning::kCoarseJoints, "joint registers too coarse: over 0.1 mm at the tip"},
    BitMeaning{warning::kMassCentresGuessed, "a link's centre of mass is assumed"},
    BitMeaning{warning::kDrift,
               "probes contradict the model: drift alarm, or the stated radius is contradicted"},
    BitMeaning{warning::kProposalWaiting, "a corrected model awaits approval"},
    BitMeaning{warning::kMonitoringFault, "journal or diagnosis failed"},
    BitMeaning{warning::kLensStale, "the camera's lens is not valid"},
    BitMeaning{warning::kCameraLost, "camera or zoom sensor lost"},
    BitMeaning{warning::kBoardWanted, "calibration board required"},
    BitMeaning{warning::kInterference, "interference: monitored objects in contact"},
    BitMeaning{warning::kApproachBlocked, "an approach path is blocked"},
    BitMeaning{warning::kModelSetAside, "an applied model is not in force (plumbline model list)"},
    BitMeaning{warning::kStorage, "the state directory cannot be written: disk full or read-only"},
    BitMeaning{warning::kTwoMasters, "two clients write the command window"},
};

struct MonitoringBit {
  std::uint16_t mask;
  bool status::MonitoringStatus::*flag;
};
constexpr std::array kMonitoringFlags = {
    MonitoringBit{1 << 0, &status::MonitoringStatus::recording},
    MonitoringBit{1 << 1, &status::MonitoringStatus::drift_alarm},
    MonitoringBit{1 << 3, &status::MonitoringStatus::learning},
    MonitoringBit{1 << 4, &status::MonitoringStatus::diagnosing},
    MonitoringBit{1 << 5, &status::MonitoringStatus::fault},
    MonitoringBit{1 << 7, &status::MonitoringStatus::reference_refused},
    MonitoringBit{1 << 8, &status::MonitoringStatus::storage_unavailable},
    MonitoringBit{1 << 9, &status::MonitoringStatus::radius_contradicted},
};
// These two repeat the counters in registers 402 and 422 as bits.
constexpr int kProposalWaiting = 1 << 2, kQuarantined = 1 << 6;

}  // namespace

std::uint16_t registers::MonitoringWord(const status::MonitoringStatus& monitoring) {
  int word = 0;
  for (const MonitoringBit& bit : kMonitoringFlags) word |= monitoring.*bit.flag ? bit.mask : 0;
  if (monitoring.proposal_waiting()) word |= kProposalWaiting;
  if (monitoring.quarantined > 0) word |= kQuarantined;
  return static_cast<std::uint16_t>(word);
}

status::MonitoringStatus registers::MonitoringFlagsFromWord(std::uint16_t word) {
  status::MonitoringStatus monitoring;
  for (const MonitoringBit& bit : kMonitoringFlags) monitoring.*bit.flag = (word & bit.mask) != 0;
  return monitoring;
}

std::span<const BitMeaning> registers::StatusBits() {
  return kStatusBits;
}
std::span<const BitMeaning> registers::AlarmBits() {
  return kAlarmBits;
}
std::span<const BitMeaning> registers::WarningBits() {
  return kWarningBits;
}

}  // namespace plumbline::plc
