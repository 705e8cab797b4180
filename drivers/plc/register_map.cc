#include "drivers/plc/register_map.h"

#include <array>
#include <cmath>

#include "firmware-like/geometry/angle.h"
#include "firmware-like/geometry/length.h"

namespace plumbline::plc {
namespace {

using enum FieldType;

using Source = const MapSource&;

const correction::Correction& ResultCorrection(Source s) {
  return s.snapshot.result.correction;
}

double Angle_deg(const Pose& X, Source s, int k) {
  return kDegPerRad * AnglesFromRotation(X.R, s.convention.orientation)[k];
}

bool FitsInt16(const Pose& X) {
  return (X.p.array().abs() * 1e4 < 32767.5).all();
}

int BasisBits(const correction::Correction& correction) {
  return static_cast<int>(correction.basis) << registers::kBasisShift;
}

double ResultBits(Source s) {
  const CommandResult& result = s.snapshot.result;
  int bits = result.valid ? registers::kValid : 0;
  if (result.correction.extrapolated) bits |= registers::kExtrapolated;
  const bool holds_pose = result.valid || result.code == correction::CorrectionCode::kOk ||
                          result.code == correction::CorrectionCode::kProbeQuarantined;
  if (holds_pose && FitsInt16(result.correction.X_BP_command)) bits |= registers::kFitsInt16;
  return bits | BasisBits(result.correction);
}

double PointBits(Source s) {
  int bits = s.point->valid ? registers::kValid : 0;
  if (s.point->correction.extrapolated) bits |= registers::kExtrapolated;
  if (s.point->ever_valid) bits |= registers::kEverValid;
  if (s.point->posture.differs) bits |= registers::kPointPostureDiffers;
  return bits | BasisBits(s.point->correction);
}

template <int K>
double ResultPosition_mm(Source s) {
  return kMmPerMetre * ResultCorrection(s).X_BP_command.p[K];
}
template <int K>
double ResultAngle_deg(Source s) {
  return Angle_deg(ResultCorrection(s).X_BP_command, s, K);
}
template <int K>
double ResultShift_mm(Source s) {
  return kMmPerMetre * ResultCorrection(s).translation_B[K];
}
template <int K>
double ResultTurn_deg(Source s) {
  return kDegPerRad * ResultCorrection(s).rotation_B[K];
}
template <int K>
double ScaledPosition(Source s) {
  return 1e4 * ResultCorrection(s).X_BP_command.p[K];
}
template <int K>
double ScaledAngle(Source s) {
  return 1e3 * VectorFromRotation(ResultCorrection(s).X_BP_command.R)[K];
}
template <int K>
double FinePosition(Source s) {
  return 1e6 * ResultCorrection(s).X_BP_command.p[K];
}
template <int K>
double Joint(Source s) {
  if (K >= s.snapshot.reading.q.size()) return 0;
  const bool prismatic = (s.snapshot.prismatic_joints >> K) & 1;
  return (prismatic ? kMmPerMetre : kDegPerRad) * s.snapshot.reading.q[K];
}
template <int K>
double Tcp(Source s) {
  if (!s.snapshot.reading.X_BT) return 0;
  const Pose& X_BT = *s.snapshot.reading.X_BT;
  return K < 3 ? kMmPerMetre * X_BT.p[K % 3] : Angle_deg(X_BT, s, K % 3);
}
template <int K>
double Cog_mm(Source s) {
  return kMmPerMetre * s.snapshot.payload.cog_F[K];
}
template <int K>
double DynamicTip_mm(Source s) {
  return kMmPerMetre * s.snapshot.motion.deflection.tip_W[K];
}
template <int K>
double PointPosition_mm(Source s) {
  return kMmPerMetre * s.point->correction.X_BP_command.p[K];
}
template <int K>
double PointAngle_deg(Source s) {
  return Angle_deg(s.point->correction.X_BP_command, s, K);
}

template <int K>
double ProbeResidual(Source s) {
  return kMmPerMetre * s.environment.monitoring.residual_m[K];
}
template <int K>
double ProbeResidualScaled(Source s) {
  return 1e5 * s.environment.monitoring.residual_m[K];
}

double InputBits(Source s) {
  const Snapshot& snapshot = s.snapshot;
  const model::RobotState& reading = snapshot.reading;
  int bits = snapshot.input_fault == InputFault::kOk ? 1 : 0;
  if (reading.X_BT && reading.X_BT->p.allFinite() && reading.X_BT->R.allFinite()) bits |= 2;
  if (snapshot.payload_valid) bits |= 4;
  if (reading.temp_C && std::isfinite(*reading.temp_C)) bits |= 8;
  return bits;
}

double Number(correction::CorrectionCode code) {
  return static_cast<double>(code);
}

const std::array kMapFields = {
    // 0-9 identity
    MapField{0, kU16, "magic", "", "always 0x504C (\"PL\"): identifies Plumbline",
             [](Source) -> double { return registers::kMagic; }},
    MapField{1, kU16, "map_version", "", "version of this register map",
             [](Source) -> double { return registers::kVersion; }},
    MapField{2, kU16, "word_order", "",
             "order of the two words of a 32-bit value: 0 ABCD (high word first), 1 CDAB (low word "
             "first)",
             [](Source s) -> double { return s.convention.little_word_first ? 1 : 0; }},
    MapField{3, kU16, "orientation", "",
             "meaning of rx, ry, rz: 0 rotation vector, 1 roll-pitch-yaw (R = Rz(rz) Ry(ry) "
             "Rx(rx)), 2 A-B-C (R = Rz(rx) Ry(ry) Rx(rz))",
             [](Source s) { return static_cast<double>(s.convention.orientation); }},
    MapField{4, kFloat, "test_float", "", "always 1.0: use it to check your word order",
             [](Source) { return 1.0; }},
    MapField{6, kU32, "test_u32", "", "always 0x01020304: use it to check your word order",
             [](Source) -> double { return 0x01020304; }},
    MapField{8, kU32, "firmware", "", "version of the daemon: 10000 major + 100 minor + patch",
             [](Source s) -> double { return s.environment.firmware; }},
    // 10-23 state
    MapField{10, kU16, "heartbeat", "", "increments 10 times a second, wraps after 65535",
             [](Source s) -> double { return s.environment.heartbeat; }},
    MapField{11, kU16, "status", "bits", "status word, see below",
             [](Source s) -> double { return s.snapshot.status; }},
    MapField{12, kU16, "alarms", "bits", "alarm word, see below",
             [](Source s) -> double { return s.snapshot.alarms; }},
    MapField{
        13, kU16, "first_error", "code",
        "result code of the first configured point without a correction; 0: every point has one",
        [](Source s) { return Number(s.snapshot.first_error); }},
    MapField{14, kU16, "warnings", "bits", "warning word, see below",
             [](Source s) -> double { return s.snapshot.warnings; }},
    MapField{15, kU16, "data_age", "ms",
             "age of the robot reading; 65535: older than that, or no reading yet",
             [](Source s) {
               const bool any = s.snapshot.input_fault != InputFault::kMissing;
               return any ? std::floor(1e3 * s.snapshot.data_age_s) : 65535;
             }},
    MapField{16, kU32, "uptime", "s", "time since the daemon started",
             [](Source s) { return std::floor(s.environment.uptime_s); }},
    MapField{18, kU16, "clients", "", "connected Modbus TCP clients",
             [](Source s) -> double { return s.environment.clients; }},
    MapField{19, kU16, "boot_counter", "", "number of daemon starts",
             [](Source s) -> double { return s.environment.boot_count; }},
    MapField{20, kU16, "points", "", "number of configured points, 0 to 1000",
             [](Source s) { return static_cast<double>(s.snapshot.points.size()); }},
    MapField{21, kU16, "cycle_period", "0.1 ms", "configured period of the control cycle",
             [](Source s) { return 1e4 * s.environment.cycle_period_s; }},
    MapField{22, kU16, "longest_cycle", "us",
             "longest execution time of a control cycle since the daemon started",
             [](Source s) { return 1e6 * s.environment.longest_cycle_s; }},
    MapField{23, kU16, "overruns", "",
             "control cycles that started late since the daemon started, modulo 65536",
             [](Source s) -> double { return s.environment.overruns & 0xFFFFU; }},
    MapField{24, kU16, "health", "code", "0 good, 1 notice, 2 attention, 3 alarm: do not assemble",
             [](Source s) { return static_cast<double>(s.snapshot.health.severity); }},
    MapField{25, kU16, "health_reason", "code", "the most severe reason, see below; 0: none",
             [](Source s) { return static_cast<double>(s.snapshot.health.reason); }},
    // 100-139 result
    MapField{100, kU16, "result_begin", "",
             "command sequence; the block is consistent if it equals result_end",
             [](Source s) -> double { return s.snapshot.result.sequence; }},
    MapField{101, kU16, "result_echo", "", "sequence of the command that this block answers",
             [](Source s) -> double { return s.snapshot.result.sequence; }},
    MapField{102, kU16, "result_code", "code",
             "0 ok, otherwise why there is no correction, see below",
             [](Source s) { return Number(s.snapshot.result.code); }},
    MapField{103, kU16, "result_validity", "bits",
             "bit 0 valid, 1 extrapolated (outside the calibrated range), 3 registers 204-206 hold "
             "the position without saturating, 4-5 basis of the 95 % radius: 0 unknown, 1 assumed, "
             "2 propagated, 3 measured",
             ResultBits},
    MapField{104, kFloat, "result_x", "mm",
             "command pose of the TCP, robot base frame; use it only if bit 0 of 103 is set",
             ResultPosition_mm<0>},
    MapField{106, kFloat, "result_y", "mm", "", ResultPosition_mm<1>},
    MapField{108, kFloat, "result_z", "mm", "", ResultPosition_mm<2>},
    MapField{110, kFloat, "result_rx", "deg", "orientation, convention of register 3",
             ResultAngle_deg<0>},
    MapField{112, kFloat, "result_ry", "deg", "", ResultAngle_deg<1>},
    MapField{114, kFloat, "result_rz", "deg", "", ResultAngle_deg<2>},
    MapField{116, kFloat, "result_dx", "mm",
             "correction: command position minus target position, robot base frame",
             ResultShift_mm<0>},
    MapField{118, kFloat, "result_dy", "mm", "", ResultShift_mm<1>},
    MapField{120, kFloat, "result_dz", "mm", "", ResultShift_mm<2>},
    MapField{122, kFloat, "result_drx", "deg",
             "correction: rotation vector from target to command orientation", ResultTurn_deg<0>},
    MapField{124, kFloat, "result_dry", "deg", "", ResultTurn_deg<1>},
    MapField{126, kFloat, "result_drz", "deg", "", ResultTurn_deg<2>},
    MapField{128, kFloat, "result_uncertainty", "mm",
             "95 % radius of the landing position; basis in bits 4-5 of 103",
             [](Source s) { return kMmPerMetre * ResultCorrection(s).uncertainty_m; }},
    MapField{
        130,
        kU16, "result_point", "",
        "id of the corrected point, or number of the artefact; 0: the pose came with the command",
        [](Source s) -> double { return s.snapshot.result.point_id; }},
    MapField{131, kU16, "result_command", "", "code of the command that this block answers",
             [](Source s) { return static_cast<double>(s.snapshot.result.command); }},
    MapField{132, kU64, "result_time", "ms",
             "time of the result: milliseconds since 1970-01-01 UTC",
             [](Source s) { return static_cast<double>(s.snapshot.result.unix_ms); }},
    MapField{136, kU16, "result_model", "", "version of the cell model that was used",
             [](Source s) -> double { return s.environment.monitoring.model.applied; }},
    MapField{137, kU16, "result_orientation", "", "as register 3",
             [](Source s) { return static_cast<double>(s.convention.orientation); }},
    MapField{138, kU16, "result_crc", "",
             "Modbus CRC-16 of registers 100-137, high byte of each register first",
             [](Source) { return std::nan(""); }},  // filled in after the block is complete
    MapField{139, kU16, "result_end", "", "command sequence again, see 100",
             [](Source s) -> double { return s.snapshot.result.sequence; }},
    // 200-219 the same result as integers, for small PLCs and controllers that read single
    // registers
    MapField{200, kU16, "scaled_first", "", "sequence of the command that this block answers",
             [](Source s) -> double { return s.snapshot.result.sequence; }},
    MapField{201, kU16, "scaled_code", "code", "as register 102",
             [](Source s) { return Number(s.snapshot.result.code); }},
    MapField{202, kU16, "scaled_validity", "bits", "as register 103", ResultBits},
    MapField{203, kU16, "scaled_point", "", "as register 130",
             [](Source s) -> double { return s.snapshot.result.point_id; }},
    MapField{204, kI16, "scaled_x", "0.1 mm",
             "command position, robot base frame; saturates at -32768 and 32767, bit 3 of 202 is "
             "then clear",
             ScaledPosition<0>},
    MapField{205, kI16, "scaled_y", "0.1 mm", "", ScaledPosition<1>},
    MapField{206, kI16, "scaled_z", "0.1 mm", "", ScaledPosition<2>},
    MapField{207, kI16, "scaled_rx", "mrad",
             "command orientation as a rotation vector, independent of register 3", ScaledAngle<0>},
    MapField{208, kI16, "scaled_ry", "mrad", "", ScaledAngle<1>},
    MapField{209, kI16, "scaled_rz", "mrad", "", ScaledAngle<2>},
    MapField{210, kI32, "scaled_x_fine", "0.001 mm", "command position at 1 um resolution",
             FinePosition<0>},
    MapField{212, kI32, "scaled_y_fine", "0.001 mm", "", FinePosition<1>},
    MapField{214, kI32, "scaled_z_fine", "0.001 mm", "", FinePosition<2>},
    MapField{216, kU16, "scaled_correction", "0.01 mm",
             "magnitude of the translational correction; saturates at 655.35 mm",
             [](Source s) { return 1e5 * ResultCorrection(s).translation_B.norm(); }},
    MapField{217, kU16, "scaled_uncertainty", "0.01 mm",
             "95 % radius as in 128; saturates at 655.35 mm",
             [](Source s) { return 1e5 * ResultCorrection(s).uncertainty_m; }},
    MapField{218, kU16, "scaled_command", "", "as register 131",
             [](Source s) { return static_cast<double>(s.snapshot.result.command); }},
    MapField{219, kU16, "scaled_last", "",
             "command sequence again: the block is consistent if it equals 200",
             [](Source s) -> double { return s.snapshot.result.sequence; }},
    // 300-365 robot state as decoded, and its motion
    MapField{300, kU16, "input_validity", "bits",
             "bit 0 passed the plausibility checks, 1 the controller reports a TCP pose, 2 payload "
             "known, 3 the controller reports a temperature",
             InputBits},
    MapField{301, kU16, "input_fault", "code",
             "why the robot state is not trusted, see below; 0: it is",
             [](Source s) { return static_cast<double>(s.snapshot.input_fault); }},
    MapField{302, kU16, "robot_mode", "code",
             "0 unknown, 1 not ready, 2 running, 3 manual, 4 stopped, 5 emergency stop",
             [](Source s) { return static_cast<double>(s.snapshot.reading.mode); }},
    MapField{303, kU16, "joints", "", "number of joints, 1 to 12; 0: no reading yet",
             [](Source s) { return static_cast<double>(s.snapshot.reading.q.size()); }},
    MapField{304, kFloat, "q1", "deg",
             "joint 1 as decoded (mm if prismatic); 0 for joints that the robot does not have",
             Joint<0>},
    MapField{306, kFloat, "q2", "deg", "", Joint<1>},
    MapField{308, kFloat, "q3", "deg", "", Joint<2>},
    MapField{310, kFloat, "q4", "deg", "", Joint<3>},
    MapField{312, kFloat, "q5", "deg", "", Joint<4>},
    MapField{314, kFloat, "q6", "deg", "", Joint<5>},
    MapField{316, kFloat, "q7", "deg", "", Joint<6>},
    MapField{318, kFloat, "tcp_x", "mm",
             "TCP pose reported by the controller, robot base frame; 0 if it reports none (bit 1 "
             "of 300)",
             Tcp<0>},
    MapField{320, kFloat, "tcp_y", "mm", "", Tcp<1>},
    MapField{322, kFloat, "tcp_z", "mm", "", Tcp<2>},
    MapField{324, kFloat, "tcp_rx", "deg", "", Tcp<3>},
    MapField{326, kFloat, "tcp_ry", "deg", "", Tcp<4>},
    MapField{328, kFloat, "tcp_rz", "deg", "", Tcp<5>},
    MapField{330, kFloat, "payload", "kg", "payload mass used for the correction",
             [](Source s) { return s.snapshot.payload.mass_kg; }},
    MapField{332, kFloat, "cog_x", "mm", "centre of gravity of the payload in the flange frame",
             Cog_mm<0>},
    MapField{334, kFloat, "cog_y", "mm", "", Cog_mm<1>},
    MapField{336, kFloat, "cog_z", "mm", "", Cog_mm<2>},
    MapField{338, kFloat, "temperature", "degC",
             "temperature reported by the controller; 0 if it reports none (bit 3 of 300)",
             [](Source s) { return s.snapshot.reading.temp_C.value_or(0.0); }},
    MapField{340, kFloat, "reading_radius", "mm",
             "95 % radius at the tip due to the resolution of the joint registers",
             [](Source s) { return kMmPerMetre * s.snapshot.reading_radius_m; }},
    MapField{342, kFloat, "q8", "deg", "joints 8 to 12, as 304", Joint<7>},
    MapField{344, kFloat, "q9", "deg", "", Joint<8>},
    MapField{346, kFloat, "q10", "deg", "", Joint<9>},
    MapField{348, kFloat, "q11", "deg", "", Joint<10>},
    MapField{350, kFloat, "q12", "deg", "", Joint<11>},
    MapField{352, kU16, "motion_state", "code",
             "0 unknown, 1 at standstill, 2 moving: use 353-363, 3 moving but the readings change "
             "too rarely for an acceleration, 4 moving but payload or link masses are unknown",
             [](Source s) { return static_cast<double>(s.snapshot.motion.state); }},
    MapField{353, kU16, "motion_age", "ms",
             "age of the instant that 354-363 describe; 0 unless motion_state is 2",
             [](Source s) { return std::floor(1e3 * s.snapshot.motion.age_s); }},
    MapField{354, kFloat, "tip_acceleration", "m/s2",
             "acceleration of the tip, from the joint readings; 0 unless motion_state is 2",
             [](Source s) { return s.snapshot.motion.deflection.tip_acceleration_W.norm(); }},
    MapField{356, kFloat, "dynamic_x", "mm",
             "displacement of the tip by the motion, measurement frame; no correction contains it",
             DynamicTip_mm<0>},
    MapField{358, kFloat, "dynamic_y", "mm", "", DynamicTip_mm<1>},
    MapField{360, kFloat, "dynamic_z", "mm", "", DynamicTip_mm<2>},
    MapField{362, kFloat, "dynamic_radius", "mm",
             "95 % radius of that displacement due to the scatter of the readings alone",
             [](Source s) { return kMmPerMetre * s.snapshot.motion.radius_m; }},
    MapField{364, kU16, "undeclared", "code",
             "why the payload is unknown: 1 the controller's tool number is not declared, 2 its "
             "payload item is not; 0: neither",
             [](Source s) { return static_cast<double>(s.snapshot.undeclared.kind); }},
    MapField{365, kU16, "undeclared_number", "",
             "that number; 65535: the controller reports none; 0 unless 364 is set",
             [](Source s) -> double {
               const UndeclaredNumber& undeclared = s.snapshot.undeclared;
               if (undeclared.kind == UndeclaredNumber::Kind::kNone) return 0;
               return undeclared.number.value_or(65535);
             }},
    // 400-427 probes, drift monitor, model, masters
    MapField{400, kU16, "loop_state", "bits",
             "state of the monitoring: bit 0 probes are recorded, 1 drift alarm, 2 a proposed "
             "model awaits approval, 3 the drift reference is being collected, 4 diagnosis "
             "running, 5 journal or diagnosis failed, 6 probes in quarantine, 7 drift reference "
             "rejected: its probes disagree, 8 state directory cannot be written",
             [](Source s) -> double {
               return registers::MonitoringWord(s.environment.monitoring);
             }},
    MapField{401, kU16, "model_applied", "", "version of the cell model in force",
             [](Source s) -> double { return s.environment.monitoring.model.applied; }},
    MapField{402, kU16, "model_proposed", "", "version of the model that awaits approval; 0: none",
             [](Source s) -> double { return s.environment.monitoring.model.proposed; }},
    MapField{403, kU16, "model_declared", "", "version of the model declared in the cell file",
             [](Source s) -> double { return s.environment.monitoring.model.declared; }},
    MapField{404, kU32, "probes", "", "probes written to the journal since the daemon started",
             [](Source s) -> double { return s.environment.monitoring.probes; }},
    MapField{406, kFloat, "drift_statistic", "",
             "statistic of the drift monitor; it alarms above 1",
             [](Source s) { return s.environment.monitoring.drift_statistic; }},
    MapField{408, kFloat, "residual_x", "mm",
             "residual of the last probe: measured minus predicted tip, measurement frame",
             ProbeResidual<0>},
    MapField{410, kFloat, "residual_y", "mm", "", ProbeResidual<1>},
    MapField{412, kFloat, "residual_z", "mm", "", ProbeResidual<2>},
    MapField{414, kU16, "drift_statistic_scaled", "0.01", "as register 406; saturates at 655.35",
             [](Source s) { return 100 * s.environment.monitoring.drift_statistic; }},
    MapField{415, kI16, "residual_x_scaled", "0.01 mm",
             "as registers 408-413; saturates at -327.68 and 327.67 mm", ProbeResidualScaled<0>},
    MapField{416, kI16, "residual_y_scaled", "0.01 mm", "", ProbeResidualScaled<1>},
    MapField{417, kI16, "residual_z_scaled", "0.01 mm", "", ProbeResidualScaled<2>},
    MapField{418, kU16, "model_fitted", "",
             "1: the model in force was fitted to measured points; 0: it is the declared model and "
             "its uncertainty is assumed",
             [](Source s) -> double { return s.environment.monitoring.model.fitted ? 1 : 0; }},
    MapField{419, kU16, "model_effects", "", "number of effects in the model in force",
             [](Source s) -> double { return s.environment.monitoring.model.effects; }},
    MapField{
        420,
        kU32, "probes_refused", "",
        "probes rejected since the daemon started: implausible, or taken while the robot moved",
        [](Source s) -> double { return s.snapshot.probes.refused; }},
    MapField{422, kU16, "probes_quarantined", "",
             "probes in quarantine: in the journal, but not used until a person accepts them",
             [](Source s) -> double { return s.environment.monitoring.quarantined; }},
    MapField{423, kU16, "probe_fault", "",
             "fault of the newest probe: 0 none, 1 all zero, 2 given in metres, 3 beyond the arm's "
             "reach, 4 the robot moved",
             [](Source s) { return static_cast<double>(s.snapshot.probes.fault); }},
    MapField{424, kU16, "robot_standstill", "",
             "1: the robot state is trusted and the robot is at standstill; required for a probe",
             [](Source s) -> double { return s.snapshot.probes.standstill ? 1 : 0; }},
    MapField{425, kU16, "master_address", "",
             "last two bytes of the IPv4 address of the client whose command was executed last "
             "(third byte high, fourth byte low); 0: none, or the serial line",
             [](Source s) -> double { return s.environment.masters.executed; }},
    MapField{426, kU16, "master_port", "", "TCP port of that client; 0: none, or the serial line",
             [](Source s) -> double { return s.environment.masters.executed_port; }},
    MapField{427, kU16, "other_master", "",
             "as 425, for the other client that writes commands, while warning bit 15 is set; "
             "otherwise 0",
             [](Source s) -> double { return s.environment.masters.other; }},
};

const std::array kPointFields = {
    MapField{0, kU16, "point_id", "", "id of the point",
             [](Source s) -> double { return s.point_id; }},
    MapField{1, kU16, "point_validity", "bits",
             "bit 0 valid, 1 extrapolated, 2 has been valid since the daemon started (the pose is "
             "the last valid one), 4-5 basis of the 95 % radius as in 103, 6 the posture differs "
             "from the taught one",
             PointBits},
    MapField{2, kU16, "point_code", "code", "0 ok, otherwise why there is no correction",
             [](Source s) { return Number(s.point->code); }},
    MapField{
        3, kFloat, "point_x", "mm",
        "command pose of the TCP, robot base frame; use it only if bit 0 of point_validity is set",
        PointPosition_mm<0>},
    MapField{5, kFloat, "point_y", "mm", "", PointPosition_mm<1>},
    MapField{7, kFloat, "point_z", "mm", "", PointPosition_mm<2>},
    MapField{9, kFloat, "point_rx", "deg", "orientation, convention of register 3",
             PointAngle_deg<0>},
    MapField{11, kFloat, "point_ry", "deg", "", PointAngle_deg<1>},
    MapField{13, kFloat, "point_rz", "deg", "", PointAngle_deg<2>},
    MapField{15, kFloat, "point_correction", "mm", "magnitude of the translational correction",
             [](Source s) { return kMmPerMetre * s.point->correction.translation_B.norm(); }},
    MapField{17, kFloat, "point_uncertainty", "mm",
             "95 % radius of the landing position; basis in bits 4-5 of point_validity",
             [](Source s) { return kMmPerMetre * s.point->correction.uncertainty_m; }},
    MapField{19, kU16, "point_sequence", "",
             "increments with every refresh, wraps after 65535; constant while not valid",
             [](Source s) -> double { return s.point->sequence; }},
};

}  // namespace

int RegisterCount(FieldType type) {
  switch (type) {
    case FieldType::kU16:
    case FieldType::kI16:
      return 1;
    case FieldType::kU32:
    case FieldType::kI32:
    case FieldType::kFloat:
      return 2;
    case FieldType::kU64:
      return 4;
  }
  return 0;
}

const char* NameOf(FieldType type) {
  switch (type) {
    case FieldType::kU16:
      return "u16";
    case FieldType::kI16:
      return "i16";
    case FieldType::kU32:
      return "u32";
    case FieldType::kI32:
      return "i32";
    case FieldType::kFloat:
      return "float32";
    case FieldType::kU64:
      return "u64";
  }
  return "?";
}

std::span<const MapField> registers::Fields() {
  return kMapFields;
}
std::span<const MapField> registers::PointFields() {
  return kPointFields;
}

}  // namespace plumbline::plc
