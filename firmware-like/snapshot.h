// Output of one control cycle: the immutable value that the PLC codec encodes into registers.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "firmware-like/cell_health.h"
#include "firmware-like/correction/correct.h"
#include "firmware-like/correction/point_posture.h"
#include "firmware-like/model/measured_point.h"
#include "firmware-like/model/plc_command.h"
#include "firmware-like/motion/motion_observer.h"
#include "firmware-like/payload_selection.h"
#include "firmware-like/plausibility_filter.h"
#include "firmware-like/probe_check.h"

namespace plumbline {

/// Bits of the status word.
namespace status {
inline constexpr std::uint16_t kReady = 1 << 0;        ///< every configured point is valid
inline constexpr std::uint16_t kBusy = 1 << 1;         ///< a command is in progress
inline constexpr std::uint16_t kResultValid = 1 << 2;  ///< the result block may be used
inline constexpr std::uint16_t kRobotLink = 1 << 3;    ///< robot input is fresh and trusted
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
/// The controller's tool pose contains what the cell corrects as well.
inline constexpr std::uint16_t kCompensatedTwice = 1 << 13;
}  // namespace status

/// Bits of the alarm word. All but the emergency stop withdraw corrected points. During an
/// emergency stop the arm does not move and its points remain correct.
namespace alarm {
inline constexpr std::uint16_t kRobotMissing = 1 << 0;      ///< no reading since start-up
inline constexpr std::uint16_t kRobotStale = 1 << 1;        ///< the last reading is too old
inline constexpr std::uint16_t kRobotImplausible = 1 << 2;  ///< NaN, out of limits, or a jump
inline constexpr std::uint16_t kDecodingWrong = 1 << 3;     ///< tool pose contradicts the joints
inline constexpr std::uint16_t kPayloadUnknown = 1 << 4;
inline constexpr std::uint16_t kTorquesUnknown = 1 << 5;  ///< link masses not declared
inline constexpr std::uint16_t kPointRefused = 1 << 6;    ///< a configured point has no correction
inline constexpr std::uint16_t kEmergencyStop = 1 << 7;   ///< reported by the controller
}  // namespace alarm

/// Bits of the warning word. Warnings need attention but withdraw nothing.
namespace warning {
inline constexpr std::uint16_t kDecodingUnchecked = 1 << 0;   ///< the profile has no tool pose
inline constexpr std::uint16_t kPlcHeartbeatLost = 1 << 1;    ///< it was present but has stopped
inline constexpr std::uint16_t kCycleOverrun = 1 << 2;        ///< cycles missed in the last second
inline constexpr std::uint16_t kCoarseJoints = 1 << 3;        ///< joint resolution adds > 0.1 mm
inline constexpr std::uint16_t kMassCentresGuessed = 1 << 4;  ///< a link's centre is not declared
inline constexpr std::uint16_t kDrift = 1 << 5;  ///< probes contradict the model or its radius
inline constexpr std::uint16_t kProposalWaiting = 1 << 6;  ///< a corrected model awaits approval
inline constexpr std::uint16_t kMonitoringFault =
    1 << 7;                                           ///< journal or diagnosis failed; see the log
inline constexpr std::uint16_t kLensStale = 1 << 8;   ///< do not use measurements of the camera
inline constexpr std::uint16_t kCameraLost = 1 << 9;  ///< no frames, or no zoom reading
inline constexpr std::uint16_t kBoardWanted = 1 << 10;      ///< the calibration board is requested
inline constexpr std::uint16_t kInterference = 1 << 11;     ///< monitored objects touch
inline constexpr std::uint16_t kApproachBlocked = 1 << 12;  ///< an object blocks an approach path
inline constexpr std::uint16_t kModelSetAside = 1 << 13;    ///< an applied model is not in force
inline constexpr std::uint16_t kStorage = 1 << 14;          ///< the state directory is not writable
inline constexpr std::uint16_t kTwoMasters = 1 << 15;  ///< two clients write the command window
}  // namespace warning

/// A configured point in one cycle. While `valid` is false, the values are the last valid ones.
struct PointResult {
  bool valid = false;
  bool ever_valid = false;
  correction::CorrectionCode code = correction::CorrectionCode::kPending;
  std::uint16_t sequence = 0;  ///< counts refreshes; does not change while the point is not valid
  correction::Correction correction;
  correction::PointPosture posture;  ///< of correction.q
  std::uint32_t solutions = 0;  ///< counts solutions; correction.q changes only together with it
};

/// The result of a command; frozen until it is acknowledged or the next command arrives.
struct CommandResult {
  std::uint16_t sequence = 0;  ///< of the command
  bool valid = false;
  correction::CorrectionCode code = correction::CorrectionCode::kPending;
  model::PlcCommandCode command = model::PlcCommandCode::kNone;
  std::uint16_t point_id = 0;
  std::int64_t unix_ms = 0;  ///< wall-clock time of the cycle that computed it
  correction::Correction correction;
};

/// One probe: the tip as measured by the PLC or by cameras, and as predicted by the model in force.
struct Probe : model::MeasuredPoint {
  std::uint16_t sequence = 0;  ///< of the command
  std::int64_t unix_ms = 0;
  double utc_s = 0;                   ///< since 1970; never stepped within one run of the daemon
  Vec3 predicted_W = Vec3::Zero();    ///< loaded tip predicted by the model in force [m]
  double radius_m = 0;                ///< 95 % radius stated for it; 0: without a basis
  std::uint16_t cameras = 0;          ///< bit k: camera k contributed
  std::uint16_t artefact_number = 0;  ///< in the cell's list from 1; 0 for a measured tip
  bool by_gauge = false;              ///< sent by the button of a gauge, not by a command
  bool quarantined = false;           ///< contradicts the model: stored, but used only if accepted
};

/// Acceptance of probes since start-up.
struct ProbeIntake {
  std::uint32_t refused = 0;             ///< implausible, or taken while the robot moved
  ProbeFault fault = ProbeFault::kNone;  ///< of the latest probe that was checked
  Vec3 measured_W = Vec3::Zero();        ///< the latest refused probe [m]
  double reach_m = 0;                    ///< largest accepted distance from the base origin
  double contradiction_m = 0;            ///< largest distance from the prediction before quarantine
  bool standstill = false;               ///< the robot is trusted and at standstill
};

/// A PLC's request concerning lens calibration.
enum class CalibrationRequest : std::uint8_t { kNone, kStart, kCancel };

struct Snapshot {
  double now_s = 0;  ///< monotonic
  std::uint64_t cycle = 0;
  std::uint16_t status = 0, alarms = 0, warnings = 0;
  CellHealth health;  ///< derived from the fields below and from the background status
  InputFault input_fault = InputFault::kMissing;
  correction::CorrectionCode first_error =
      correction::CorrectionCode::kOk;  ///< of the first point that is not valid
  double data_age_s = 0;                ///< of the robot reading
  model::RobotState robot;              ///< the last trusted state; used for all computations
  model::RobotState reading;            ///< the latest decoded state, trusted or not; display only
  std::uint16_t prismatic_joints = 0;   ///< bit i: joint i is prismatic, its position is in metres
  bool payload_valid = false;
  loads::Payload payload;  ///< in force for points without their own payload
  /// Number of the tool whose tip the controller reports although it reports another number.
  std::optional<int> tip_of_tool{};
  UndeclaredNumber undeclared;  ///< why `payload_valid` is false, if a number is the reason
  double reading_radius_m = 0;  ///< 95 % radius at the tip caused by the joint register resolution
  motion::MotionStatus motion;  ///< for display only: no correction depends on it
  /// Of the loaded tip at `robot.q`, if MachineConfig::states_present_radius.
  model::StatedRadius present_radius;
  std::uint16_t lenses_missing = 0;  ///< bit k: points require camera k, whose lens is not valid
  std::vector<PointResult> points;   ///< in configured order
  std::uint64_t point_changes = 0;   ///< counts changes of `points`, apart from `sequence`
  CommandResult result;
  bool command_executed = false;  ///< `result` is of a command that was executed in this cycle
  bool monitor_restart = false;   ///< requested in this cycle
  std::array<CalibrationRequest, model::kMaxCameras>
      calibration_requests{};  ///< requested in this cycle
  bool probe_taken = false;    ///< `probe` was recorded in this cycle
  /// Outcome of MachineInput::gauge; nullopt if there was none, or it waits for the next cycle.
  std::optional<correction::CorrectionCode> gauge_code;
  Probe probe;
  ProbeIntake probes;
};

}  // namespace plumbline
