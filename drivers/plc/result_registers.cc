// Registers 100-143: result of the last command; 200-219: the same as integers.
#include <array>
#include <cmath>

#include "drivers/plc/register_values.h"

namespace plumbline::plc {
namespace {

using enum FieldType;

const correction::Correction& ResultCorrection(Source s) {
  return s.snapshot.result.correction;
}

bool FitsInt16(const Pose& X) {
  return (X.p.array().abs() * 1e4 < 32767.5).all();
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
const std::array kResultFields = {
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
        130, kU16, "result_point", "",
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
    MapField{140, kFloat, "result_qw", "",
             "w of the command orientation as a quaternion, in every convention: sqrt(1 - x^2 - "
             "y^2 - z^2)",
             [](Source s) { return QuaternionScalar(ResultCorrection(s).X_BP_command.R); }},
    MapField{142, kFloat, "result_orientation_left", "deg",
             "angle to the demanded orientation that an arm of fewer than six axes leaves; else 0. "
             "Read 100-143 in one request: 140-143 lie behind result_end and outside the CRC",
             [](Source s) { return kDegPerRad * ResultCorrection(s).residual_rad; }},
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
};

}  // namespace

std::span<const MapField> registers::ResultFields() {
  return kResultFields;
}

}  // namespace plumbline::plc
