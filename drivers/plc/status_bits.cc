// What the bits of the status, alarm and warning words mean.
#include <array>

#include "drivers/plc/register_map.h"

namespace plumbline {
namespace {

constexpr std::array kStatusBits = {
    BitMeaning{status::kReady, "ready"},
    BitMeaning{status::kBusy,
               "busy (kept free: a command is answered within one cycle, the echo tells when)"},
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
    BitMeaning{warning::kCoarseJoints, "joint registers cost over 0.1 mm"},
    BitMeaning{warning::kMassCentresGuessed, "a link's centre of mass is guessed"},
    BitMeaning{warning::kDrift, "the residuals of probes changed (drift alarm)"},
    BitMeaning{warning::kProposalWaiting, "a corrected model waits for approval"},
    BitMeaning{warning::kLoopFault, "journal or diagnosis failed"},
    BitMeaning{warning::kLensStale, "the camera's lens is not to be trusted"},
    BitMeaning{warning::kCameraLost, "camera or zoom sensor lost"},
    BitMeaning{warning::kBoardWanted, "the calibration board is asked for"},
    BitMeaning{warning::kInterference, "interference: watched objects touch"},
    BitMeaning{warning::kApproachBlocked, "an approach path is blocked"},
    BitMeaning{warning::kModelSetAside, "an applied model is not in force (plumbline model list)"},
    BitMeaning{warning::kStorage, "the state directory cannot be written: disk full or read-only"},
    BitMeaning{warning::kTwoMasters, "two clients write the command window"},
};

}  // namespace

std::span<const BitMeaning> plc_map::StatusBits() {
  return kStatusBits;
}
std::span<const BitMeaning> plc_map::AlarmBits() {
  return kAlarmBits;
}
std::span<const BitMeaning> plc_map::WarningBits() {
  return kWarningBits;
}

}  // namespace plumbline
