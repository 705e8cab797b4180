// Execution of PLC commands: corrected points and poses, probes, lens calibration.
#include <algorithm>
#include <cmath>
#include <span>

#include "firmware-like/deflection/uncertainty.h"
#include "firmware-like/loads/numbered_load.h"
#include "firmware-like/machine.h"

namespace plumbline {
namespace {

constexpr double kTipStale_s = 0.5;  // largest age of a camera tip: a few frames

bool IsPlausible(const std::optional<double>& payload_kg) {
  return !payload_kg || (*payload_kg >= 0 && *payload_kg <= loads::kMaxPayload_kg);
}

/// True if the command's result is a corrected point or pose.
bool IsCorrection(model::PlcCommandCode code) {
  return code == model::PlcCommandCode::kCorrectPoint ||
         code == model::PlcCommandCode::kCorrectPose ||
         code == model::PlcCommandCode::kCorrectPoseScaled;
}

constexpr double kMaxGauge_m = 0.5, kMaxRange_m = 100;  // judgements, beyond any such instrument

/// True if a probe of this code, with its reading, is possible on an artefact of this kind.
bool Fits(const model::PlcCommand& command, model::ArtefactKind kind) {
  const bool gauge = kind == model::ArtefactKind::kGauge;
  if (command.code == model::PlcCommandCode::kProbeTouch) return !gauge;
  if (!command.reading_m) return false;
  if (gauge) return std::abs(*command.reading_m) <= kMaxGauge_m;
  return kind == model::ArtefactKind::kPoint && *command.reading_m > 0 &&
         *command.reading_m <= kMaxRange_m;
}

/// True if the command refers to camera k.
bool IsAddressed(const MachineInput& input, std::size_t k) {
  const std::uint16_t named = input.command.camera;
  return input.cameras[k].configured && (named == 0 || named == k + 1);
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
  const auto refuse = [&](correction::CorrectionCode code) { result.code = code; };
  if (!IsPlausible(command.payload_kg)) return refuse(correction::CorrectionCode::kBadCommand);
  if (command.code == model::PlcCommandCode::kProbe ||
      command.code == model::PlcCommandCode::kProbeFine) {
    result.code = RecordProbe(input, command.probe_W);
    result.valid = result.code == correction::CorrectionCode::kOk;
    return;
  }
  if (command.code == model::PlcCommandCode::kProbeByCamera) {
    result.code = RecordProbeByCamera(input);
    result.valid = result.code == correction::CorrectionCode::kOk;
    return;
  }

  if (command.code == model::PlcCommandCode::kProbeTouch ||
      command.code == model::PlcCommandCode::kProbeReading) {
    result.point_id = command.point_id;
    result.code = RecordProbeOnArtefact(input);
    result.valid = result.code == correction::CorrectionCode::kOk;
    return;
  }

  correction::AssemblyPoint point;
  model::JointVector seed = snapshot_.robot.q;
  switch (command.code) {
    case model::PlcCommandCode::kCorrectPoint: {
      const auto known = std::find_if(
          config_.points.begin(), config_.points.end(),
          [&](const correction::AssemblyPoint& p) { return p.id == command.point_id; });
      if (known == config_.points.end()) return refuse(correction::CorrectionCode::kUnknownPoint);
      const auto index = static_cast<std::size_t>(known - config_.points.begin());
      if (!command.payload_kg) {  // this cycle's correction of the point applies
        const PointResult& block = snapshot_.points[index];
        result.code = block.code;
        result.valid = block.valid;
        if (block.valid) result.correction = block.correction;
        // RefreshRadii() may not have reached this point yet.
        if (block.valid && block.correction.basis == model::RadiusBasis::kUnknown) {
          const CorrectionInputs& inputs = *branches_[index].inputs;
          StateUncertainty({inputs.mass_kg, inputs.cog_F, inputs.tool}, known->p_TP,
                           result.correction);
        }
        return;
      }
      point.X_WP = known->X_WP;
      point.p_TP = known->p_TP;
      point.orientation_free = known->orientation_free;
      if (known->near_q) seed = *known->near_q;
      if (branches_[index].solution) seed = *branches_[index].solution;
      break;
    }
    case model::PlcCommandCode::kCorrectPose:
    case model::PlcCommandCode::kCorrectPoseScaled:
    case model::PlcCommandCode::kPredictLanding:
      if (!command.pose_valid ||
          IsZeroOrInMetres(config_.cell.robot, probe_bounds_, command.X_BP.p)) {
        return refuse(correction::CorrectionCode::kBadCommand);
      }
      point.X_WP = corrector_.arm().X_WB() * command.X_BP;
      break;
    default:
      return refuse(correction::CorrectionCode::kBadCommand);
  }
  if (!robot_trusted) return refuse(correction::CorrectionCode::kNoRobot);
  if (command.payload_kg) point.payload_kg = command.payload_kg;
  const std::optional<loads::Payload> payload = PayloadAt(point.payload_kg);
  if (!payload) return refuse(correction::CorrectionCode::kPayloadUnknown);
  if (lens_missing && IsCorrection(command.code)) {
    return refuse(correction::CorrectionCode::kLensStale);
  }
  correction::Correction correction;
  if (command.code == model::PlcCommandCode::kPredictLanding) {
    corrector_.PredictLanding(command.X_BP, Vec3::Zero(), *payload, ConditionsOf(*payload), seed,
                              correction::BranchSearch::kBrief, correction);
  } else {
    corrector_.Correct(point, *payload, ConditionsOf(*payload), seed,
                       correction::BranchSearch::kBrief, correction);
  }
  result.code = correction.code;
  if (correction.code != correction::CorrectionCode::kOk) return;
  StateUncertainty(*payload, point.p_TP, correction);
  result.code = correction.code;
  if (correction.code != correction::CorrectionCode::kOk) return;
  result.correction = correction;
  result.valid = true;
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

correction::CorrectionCode Machine::RecordProbeByCamera(const MachineInput& input) {
  std::array<MeasuredTip, model::kMaxCameras> tips;
  std::size_t seen = 0;
  std::uint16_t cameras = 0;
  bool any_addressed = false, any_valid = false;
  for (std::size_t k = 0; k < model::kMaxCameras; ++k) {
    if (!IsAddressed(input, k)) continue;
    const CameraInput& camera = input.cameras[k];
    any_addressed = true;
    any_valid = any_valid || camera.lens_valid;
    const bool fresh = input.now_s - camera.tip_time_s <= kTipStale_s;
    if (!camera.lens_valid || !camera.tip_valid || !fresh || !camera.tip.p_W.allFinite()) continue;
    tips[seen++] = camera.tip;
    cameras = static_cast<std::uint16_t>(cameras | 1U << k);
  }
  if (!any_addressed) return correction::CorrectionCode::kNoCamera;
  if (seen == 0)
    return any_valid ? correction::CorrectionCode::kTipNotSeen
                     : correction::CorrectionCode::kLensStale;
  const TipFusion fused = FuseTips(std::span(tips).first(seen));
  if (!fused.agree) return correction::CorrectionCode::kCamerasDisagree;
  const correction::CorrectionCode code = RecordProbe(input, fused.tip.p_W);
  if (!snapshot_.probe_taken) return code;
  snapshot_.probe.covariance_W = fused.tip.covariance_W;
  snapshot_.probe.cameras = cameras;
  return code;
}

correction::CorrectionCode Machine::ProbeRecordingCode(const MachineInput& input) const {
  if (input.probes_recorded) return correction::CorrectionCode::kOk;
  if (input.storage_unavailable) return correction::CorrectionCode::kStorageUnavailable;
  return input.probes_pending ? correction::CorrectionCode::kPending
                              : correction::CorrectionCode::kNotRecorded;
}

correction::CorrectionCode Machine::RefuseProbe(ProbeFault fault, const Vec3& measured_W) {
  ++snapshot_.probes.refused;
  snapshot_.probes.fault = fault;
  snapshot_.probes.measured_W = measured_W;
  return fault == ProbeFault::kRobotMoving ? correction::CorrectionCode::kRobotMoving
                                           : correction::CorrectionCode::kProbeImplausible;
}

correction::CorrectionCode Machine::PredictProbe(const std::optional<double>& own_mass_kg,
                                                 Prediction& at) {
  const deflection::LoadedArm& arm = corrector_.arm();
  if (snapshot_.input_fault != InputFault::kOk) return correction::CorrectionCode::kNoRobot;
  if (!snapshot_.probes.standstill) return correction::CorrectionCode::kRobotMoving;
  const std::optional<loads::Payload> payload = PayloadAt(own_mass_kg);
  if (!payload) return correction::CorrectionCode::kPayloadUnknown;
  if (arm.torques_missing()) return correction::CorrectionCode::kTorquesUnknown;
  at.payload = *payload;
  return arm.AtCommanded(snapshot_.robot.q, *payload, ConditionsOf(*payload), at.state)
             ? correction::CorrectionCode::kOk
             : correction::CorrectionCode::kNotConverged;
}

void Machine::TakeProbe(const MachineInput& input, const Prediction& at) {
  Probe& probe = snapshot_.probe;
  probe.sequence = input.command.sequence;
  probe.by_gauge = false;
  probe.unix_ms = input.unix_ms;
  probe.utc_s = input.utc_s;
  probe.q = snapshot_.robot.q;
  probe.q_step_rad = snapshot_.robot.q_resolution;
  const model::CellModel& cell = config_.cell;
  probe.tool_number.reset();
  probe.payload_item.reset();
  if (cell.tools() > 1) probe.tool_number = snapshot_.robot.tool_number;
  if (!cell.payload_items.empty()) probe.payload_item = snapshot_.robot.payload_item;
  probe.payload_kg = at.payload.mass_kg - loads::ItemMass_kg(cell, probe.payload_item);
  probe.temp_C = snapshot_.robot.temp_C;
  probe.predicted_W = at.state.p_read_W;
  probe.measured_W.reset();
  probe.covariance_W.reset();
  probe.range_m.reset();
  probe.gauge_m.reset();
  probe.sigma_m.reset();
  probe.artefact_number = 0;
  probe.cameras = 0;
  probe.quarantined = false;
  snapshot_.probe_taken = true;
}

void Machine::ReportPrediction(const Prediction& at) {
  snapshot_.probes.fault = ProbeFault::kNone;
  const Probe& probe = snapshot_.probe;
  correction::Correction& prediction = snapshot_.result.correction;
  prediction.code = correction::CorrectionCode::kOk;
  prediction.q = probe.q;
  prediction.X_BP_command = at.state.X_BT;
  prediction.translation_B.setZero();
  prediction.rotation_B.setZero();
  prediction.extrapolated =
      deflection::OutsideDomain(config_.cell, probe.q, at.payload.mass_kg, probe.temp_C,
                                ConditionsOf(at.payload).t_s, at.payload.tool);
  StateUncertainty(at.payload, Vec3::Zero(), prediction);
}

correction::CorrectionCode Machine::RecordProbe(const MachineInput& input,
                                                const std::optional<Vec3>& measured_W) {
  const deflection::LoadedArm& arm = corrector_.arm();
  if (const correction::CorrectionCode code = ProbeRecordingCode(input);
      code != correction::CorrectionCode::kOk)
    return code;
  if (!measured_W) return correction::CorrectionCode::kBadCommand;
  Prediction at;
  const correction::CorrectionCode code = PredictProbe(input.command.payload_kg, at);
  if (code == correction::CorrectionCode::kRobotMoving) {
    return RefuseProbe(ProbeFault::kRobotMoving, *measured_W);
  }
  if (code != correction::CorrectionCode::kOk) return code;
  const ProbeFault fault = CheckProbe(arm, probe_bounds_, *measured_W, at.state.p_read_W);
  if (fault != ProbeFault::kNone) return RefuseProbe(fault, *measured_W);
  TakeProbe(input, at);
  ReportPrediction(at);
  Probe& probe = snapshot_.probe;
  probe.measured_W = *measured_W;
  probe.quarantined = Contradicts(probe_bounds_, *measured_W, probe.predicted_W);
  snapshot_.result.correction.translation_B =
      arm.X_WB().R.transpose() * (*measured_W - probe.predicted_W);
  return probe.quarantined ? correction::CorrectionCode::kProbeQuarantined
                           : correction::CorrectionCode::kOk;
}

correction::CorrectionCode Machine::RecordProbeOnArtefact(const MachineInput& input) {
  const model::PlcCommand& command = input.command;
  const std::vector<model::Artefact>& artefacts = config_.cell.artefacts;
  if (const correction::CorrectionCode code = ProbeRecordingCode(input);
      code != correction::CorrectionCode::kOk)
    return code;
  if (command.point_id == 0 || command.point_id > artefacts.size() ||
      !Fits(command, artefacts[command.point_id - 1U].kind)) {
    return correction::CorrectionCode::kBadCommand;
  }
  Prediction at;
  const correction::CorrectionCode code = PredictProbe(command.payload_kg, at);
  if (code == correction::CorrectionCode::kRobotMoving) {
    return RefuseProbe(ProbeFault::kRobotMoving, Vec3::Zero());
  }
  if (code != correction::CorrectionCode::kOk) return code;
  TakeProbe(input, at);
  ReportPrediction(at);
  Probe& probe = snapshot_.probe;
  probe.artefact_number = command.point_id;
  if (command.code == model::PlcCommandCode::kProbeReading) {
    const bool gauge = artefacts[command.point_id - 1U].kind == model::ArtefactKind::kGauge;
    (gauge ? probe.gauge_m : probe.range_m) = command.reading_m;
  }
  return correction::CorrectionCode::kOk;
}

correction::CorrectionCode Machine::RecordGaugePress(const MachineInput& input) {
  const GaugePress& press = *input.gauge;
  const std::vector<model::Artefact>& artefacts = config_.cell.artefacts;
  const correction::CorrectionCode recording = ProbeRecordingCode(input);
  if (recording != correction::CorrectionCode::kOk) return recording;
  if (press.artefact == 0 || press.artefact > artefacts.size() ||
      artefacts[press.artefact - 1U].kind != model::ArtefactKind::kGauge ||
      !(std::abs(press.reading_m) <= kMaxGauge_m)) {
    return correction::CorrectionCode::kBadCommand;
  }
  Prediction at;
  const correction::CorrectionCode code = PredictProbe(std::nullopt, at);
  if (code != correction::CorrectionCode::kOk) return code;
  TakeProbe(input, at);
  Probe& probe = snapshot_.probe;
  probe.sequence = 0;
  probe.by_gauge = true;
  probe.artefact_number = press.artefact;
  probe.gauge_m = press.reading_m;
  probe.sigma_m = press.sigma_m;
  return correction::CorrectionCode::kOk;
}

}  // namespace plumbline
