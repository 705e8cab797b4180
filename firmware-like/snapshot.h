// Everything a cycle tells: one immutable value that the PLC's codec turns into registers.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "firmware-like/cell_health.h"
#include "firmware-like/correction/correct.h"
#include "firmware-like/correction/point_posture.h"
#include "firmware-like/model/measured_point.h"
#include "firmware-like/model/plc_command.h"
#include "firmware-like/plausibility.h"
#include "firmware-like/probe_check.h"

namespace plumbline {

/// Bits of the status word.
namespace status {
inline constexpr std::uint16_t kReady = 1 << 0;        ///< every configured point is valid
inline constexpr std::uint16_t kBusy = 1 << 1;         ///< a command is being worked on
inline constexpr std::uint16_t kResultValid = 1 << 2;  ///< the result block may be used
inline constexpr std::uint16_t kRobotLink = 1 << 3;    ///< robot input fresh and trusted
inline constexpr std::uint16_t kWarning = 1 << 4;
inline constexpr std::uint16_t kError = 1 << 5;
inline constexpr std::uint16_t kLensCalibrated = 1 << 6;
inline constexpr std::uint16_t kExtrapolating = 1
                                                << 7;  ///< a point is outside the calibrated range
inline constexpr std::uint16_t kTemperatureValid = 1 << 8;
inline constexpr std::uint16_t kPayloadValid = 1 << 9;
inline constexpr std::uint16_t kPlcHeartbeatSeen = 1 << 10;
inline constexpr std::uint16_t kManual = 1 << 11;
inline constexpr std::uint16_t kToggle = 1 << 12;  ///< changes every second
}  // namespace status

/// Bits of the alarm word: what withdraws validity, and the controller's emergency stop, which does
/// not: the arm stands, and so do its corrected points.
namespace alarm {
inline constexpr std::uint16_t kRobotMissing = 1 << 0;      ///< no reading since the start
inline constexpr std::uint16_t kRobotStale = 1 << 1;        ///< the last reading is too old
inline constexpr std::uint16_t kRobotImplausible = 1 << 2;  ///< NaN, outside limits, jump
inline constexpr std::uint16_t kDecodingWrong = 1 << 3;     ///< tool pose contradicts the joints
inline constexpr std::uint16_t kPayloadUnknown = 1 << 4;
inline constexpr std::uint16_t kTorquesUnknown = 1 << 5;  ///< link masses not declared
inline constexpr std::uint16_t kPointRefused = 1 << 6;    ///< a configured point has no correction
inline constexpr std::uint16_t kEmergencyStop = 1 << 7;   ///< as the controller reports it
}  // namespace alarm

/// Bits of the warning word: worth a look, nothing is withdrawn.
namespace warning {
inline constexpr std::uint16_t kDecodingUnchecked = 1 << 0;   ///< the profile offers no tool pose
inline constexpr std::uint16_t kPlcHeartbeatLost = 1 << 1;    ///< it was seen, and stopped
inline constexpr std::uint16_t kCycleOverrun = 1 << 2;        ///< cycles missed in the last second
inline constexpr std::uint16_t kCoarseJoints = 1 << 3;        ///< joint registers cost over 0.1 mm
inline constexpr std::uint16_t kMassCentresGuessed = 1 << 4;  ///< a link's centre is not declared
inline constexpr std::uint16_t kDrift = 1 << 5;               ///< the residuals of probes changed
inline constexpr std::uint16_t kProposalWaiting = 1 << 6;  ///< a corrected model waits for approval
inline constexpr std::uint16_t kLoopFault = 1 << 7;  ///< journal or diagnosis fail; see the log
inline constexpr std::uint16_t kLensStale = 1 << 8;  ///< what the camera measures is not to be used
inline constexpr std::uint16_t kCameraLost = 1 << 9;        ///< no frames, or no word of its zoom
inline constexpr std::uint16_t kBoardWanted = 1 << 10;      ///< the calibration board is asked for
inline constexpr std::uint16_t kInterference = 1 << 11;     ///< watched objects touch
inline constexpr std::uint16_t kApproachBlocked = 1 << 12;  ///< an object on an approach path
inline constexpr std::uint16_t kModelSetAside = 1 << 13;    ///< an applied model is not in force
inline constexpr std::uint16_t kStorage = 1 << 14;     ///< the state directory cannot be written
inline constexpr std::uint16_t kTwoMasters = 1 << 15;  ///< two clients write the command window
}  // namespace warning

/// A configured point in one cycle. While `valid` is false the values are the last good ones.
struct PointResult {
  bool valid = false;
  bool ever_valid = false;
  CorrectionCode code = CorrectionCode::kPending;
  std::uint16_t sequence = 0;  ///< counts refreshes; stands still while not valid
  Correction correction;
  PointPosture posture;         ///< of the correction's joints
  std::uint32_t solutions = 0;  ///< counts the solutions; the joints change with it only
};

/// The answer to a command; frozen until acknowledged or until the next command.
struct CommandResult {
  std::uint16_t sequence = 0;  ///< of the command it answers
  bool valid = false;
  CorrectionCode code = CorrectionCode::kPending;
  PlcCommandCode command = PlcCommandCode::kNone;
  std::uint16_t point_id = 0;
  std::int64_t unix_ms = 0;  ///< wall clock of the cycle that computed it
  Correction correction;
};

/// A measured tip that the PLC or a camera gave, and what the model in force said of it.
struct Probe : MeasuredPoint {
  std::uint16_t sequence = 0;  ///< of the command
  std::int64_t unix_ms = 0;
  double utc_s = 0;                 ///< since 1970, even within a run of the daemon
  Vec3 predicted_W = Vec3::Zero();  ///< loaded tip by the model in force [m]
  std::uint16_t cameras = 0;        ///< that saw it; bit k: the k-th
  bool quarantined = false;         ///< contradicts the model: kept, and used once accepted
};

/// What became of the probes since the start.
struct ProbeIntake {
  std::uint32_t refused = 0;             ///< implausible, or while the robot moved
  ProbeFault fault = ProbeFault::kNone;  ///< of the newest probe that was judged
  Vec3 measured_W = Vec3::Zero();        ///< the newest that was refused [m]
  double reach_m = 0;                    ///< a probe may be this far from the base
  double contradiction_m = 0;            ///< and this far from the predicted tip
  bool standstill = false;               ///< the robot is trusted and stands
};

/// What a PLC wants of the lens' calibration.
enum class CalibrationOrder : std::uint8_t { kNone, kStart, kCancel };

struct Snapshot {
  double now_s = 0;  ///< monotonic
  std::uint64_t cycle = 0;
  std::uint16_t status = 0, alarms = 0, warnings = 0;
  CellHealth health;  ///< decided from all of the below and what works beside the cycle
  InputFault input_fault = InputFault::kMissing;
  CorrectionCode first_error = CorrectionCode::kOk;  ///< of the first point that is not valid
  double data_age_s = 0;                             ///< of the robot reading
  RobotState robot;                    ///< the last that was trusted; what is computed with
  RobotState reading;                  ///< the newest as decoded, trusted or not; to look at
  std::uint16_t prismatic_joints = 0;  ///< bit i: joint i slides, its count is in metres
  bool payload_valid = false;
  Payload payload;              ///< in force for points without their own
  double reading_radius_m = 0;  ///< 95 % radius at the tip from the steps of the joint registers
  std::vector<PointResult> points;  ///< in configured order
  CommandResult result;
  bool monitor_restart = false;                                     ///< asked for in this cycle
  std::array<CalibrationOrder, kMostCameras> calibration_orders{};  ///< asked for in this cycle
  bool probe_taken = false;  ///< in this cycle; `probe` is the newest
  Probe probe;
  ProbeIntake probes;
};

}  // namespace plumbline
