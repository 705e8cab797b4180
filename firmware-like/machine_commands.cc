// Execution of PLC commands: corrected points and poses, lens calibration; probes elsewhere.
#include <algorithm>

#include "firmware-like/machine.h"

namespace plumbline {
namespace {

bool IsPlausible(const std::optional<double>& payload_kg) {
  return !payload_kg || (*payload_kg >= 0 && *payload_kg <= loads::kMaxPayload_kg);
}

/// True if the command's result is a corrected point or pose.
bool IsCorrection(model::PlcCommandCode code) {
  return code == model::PlcCommandCode::kCorrectPoint ||
         code == model::PlcCommandCode::kCorrectPose ||
         code == model::PlcCommandCode::kCorrectPoseScaled;
}

bool IsProbe(model::PlcCommandCode code) {
  return code == model::PlcCommandCode::kProbe || code == model::PlcCommandCode::kProbeFine ||
         code == model::PlcCommandCode::kProbeByCamera ||
         code == model::PlcCommandCode::kProbeTouch || code == model::PlcCommandCode::kProbeReading;
}

}  // namespace

void Machine::Execute(const MachineInput& input) {
  const model::PlcCommand& command = input.command;
  CommandResult& result = snapshot_.result;
  const bool robot_trusted = snapshot_.input_fault == InputFault::kOk;
  const bool lens_missing = snapshot_.lenses_missing != 0;
  const bool withdrawn = !robot_trusted || (lens_missing && IsCorrection(result.command));
  if (withdrawn) result.valid = false;  // the values remain
  if (command.acknowledge && !acknowledged_) result.valid = false;
  acknowledged_ = command.acknowledge;
  if (command.sequence == result.sequence) return;
  snapshot_.command_executed = true;
  result.sequence = command.sequence;
  result.command = command.code;
  result.unix_ms = input.unix_ms;
  result.valid = false;
  if (command.code == model::PlcCommandCode::kAcknowledge) {
    result.code = correction::CorrectionCode::kOk;
    return;
  }
  // A result without a pose must not show the pose of the previous command.
  result.correction = {};
  result.correction.q.setZero(config_.cell.robot.size());
  result.point_id = 0;
  if (command.code == model::PlcCommandCode::kRestartMonitor) {
    result.code = ProbeRecordingCode(input);
    snapshot_.monitor_restart = result.code == correction::CorrectionCode::kOk;
    return;
  }
  if (command.code == model::PlcCommandCode::kStartCalibration ||
      command.code == model::PlcCommandCode::kCancelCalibration) {
    result.code = RequestCalibration(input);
    return;
  }
  if (command.code == model::PlcCommandCode::kCorrectPoint) result.point_id = command.point_id;
  if (!IsPlausible(command.payload_kg)) {
    result.code = correction::CorrectionCode::kBadCommand;
    return;
  }
  result.code = IsProbe(command.code) ? ExecuteProbe(input) : ExecuteCorrection(command);
  result.valid = result.code == correction::CorrectionCode::kOk;
}

correction::CorrectionCode Machine::ExecuteCorrection(const model::PlcCommand& command) {
  correction::AssemblyPoint point;
  model::JointVector seed = snapshot_.robot.q;
  if (command.code == model::PlcCommandCode::kCorrectPoint) {
    const std::optional<std::size_t> index = IndexOfPoint(command.point_id);
    if (!index) return correction::CorrectionCode::kUnknownPoint;
    if (!command.payload_kg) return ReportPoint(*index);
    const correction::AssemblyPoint& known = config_.points[*index];
    point.X_WP = known.X_WP;
    point.p_TP = known.p_TP;
    point.orientation_free = known.orientation_free;
    if (known.near_q) seed = *known.near_q;
    if (points_.solution(*index)) seed = *points_.solution(*index);
  } else if (IsCorrection(command.code) || command.code == model::PlcCommandCode::kPredictLanding) {
    if (!command.pose_valid ||
        IsZeroOrInMetres(config_.cell.robot, probe_bounds_, command.X_BP.p)) {
      return correction::CorrectionCode::kBadCommand;
    }
    point.X_WP = corrector_.arm().X_WB() * command.X_BP;
  } else {
    return correction::CorrectionCode::kBadCommand;
  }
  if (snapshot_.input_fault != InputFault::kOk) return correction::CorrectionCode::kNoRobot;
  const std::optional<loads::Payload> payload = payload_.WithMass(command.payload_kg, config_.cell);
  if (!payload) return correction::CorrectionCode::kPayloadUnknown;
  if (snapshot_.lenses_missing != 0 && IsCorrection(command.code)) {
    return correction::CorrectionCode::kLensStale;
  }
  return Solve(command, point, *payload, seed);
}

correction::CorrectionCode Machine::Solve(const model::PlcCommand& command,
                                          const correction::AssemblyPoint& point,
                                          const loads::Payload& payload,
                                          const model::JointVector& seed) {
  const effects::Conditions conditions = ConditionsOf(payload);
  correction::Correction correction;
  if (command.code == model::PlcCommandCode::kPredictLanding) {
    corrector_.solver().PredictLanding(command.X_BP, Vec3::Zero(), payload, conditions, seed,
                                       correction::BranchSearch::kBrief, correction);
  } else {
    corrector_.solver().Correct(point, payload, conditions, seed, correction::BranchSearch::kBrief,
                                correction);
  }
  if (correction.code != correction::CorrectionCode::kOk) return correction.code;
  corrector_.StateRadius(payload, conditions, point.p_TP, correction);
  if (correction.code != correction::CorrectionCode::kOk) return correction.code;
  snapshot_.result.correction = correction;
  return correction::CorrectionCode::kOk;
}

std::optional<std::size_t> Machine::IndexOfPoint(int id) const {
  const auto known =
      std::find_if(config_.points.begin(), config_.points.end(),
                   [id](const correction::AssemblyPoint& point) { return point.id == id; });
  if (known == config_.points.end()) return std::nullopt;
  return static_cast<std::size_t>(known - config_.points.begin());
}

correction::CorrectionCode Machine::ReportPoint(std::size_t index) {
  const PointResult& point = snapshot_.points[index];
  if (!point.valid) return point.code;
  correction::Correction& reported = snapshot_.result.correction;
  reported = point.correction;
  if (reported.basis == model::RadiusBasis::kUnknown) {  // not refreshed yet in this cycle
    const loads::Payload payload = points_.SolvedPayload(index);
    corrector_.StateRadius(payload, ConditionsOf(payload), config_.points[index].p_TP, reported);
  }
  return point.code;
}

correction::CorrectionCode Machine::RequestCalibration(const MachineInput& input) {
  const bool start = input.command.code == model::PlcCommandCode::kStartCalibration;
  bool any_addressed = false, any_wants_board = false;
  for (std::size_t k = 0; k < model::kMaxCameras; ++k) {
    any_addressed = any_addressed || IsAddressed(input, k);
    any_wants_board = any_wants_board || (IsAddressed(input, k) && input.cameras[k].board_wanted);
  }
  if (!any_addressed) return correction::CorrectionCode::kNoCamera;
  for (std::size_t k = 0; k < model::kMaxCameras; ++k) {
    const bool skip = start && any_wants_board && !input.cameras[k].board_wanted;
    if (!IsAddressed(input, k) || skip) continue;
    snapshot_.calibration_requests[k] =
        start ? CalibrationRequest::kStart : CalibrationRequest::kCancel;
  }
  return correction::CorrectionCode::kOk;
}

}  // namespace plumbline
