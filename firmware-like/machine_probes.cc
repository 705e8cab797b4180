// Probes: the measured tip beside the predicted one, from the PLC, a camera, an artefact or a
// gauge.
#include <algorithm>
#include <cmath>
#include <span>

#include "firmware-like/deflection/uncertainty.h"
#include "firmware-like/loads/numbered_load.h"
#include "firmware-like/machine.h"

namespace plumbline {
namespace {

constexpr double kTipStale_s = 0.5;                     // largest age of a camera tip: a few frames
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

}  // namespace

correction::CorrectionCode Machine::ExecuteProbe(const MachineInput& input) {
  const model::PlcCommand& command = input.command;
  switch (command.code) {
    case model::PlcCommandCode::kProbeByCamera:
      return RecordProbeByCamera(input);
    case model::PlcCommandCode::kProbeTouch:
    case model::PlcCommandCode::kProbeReading:
      snapshot_.result.point_id = command.point_id;
      return RecordProbeOnArtefact(input);
    default:
      return RecordProbe(input, command.probe_W);
  }
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
  const std::optional<loads::Payload> payload = payload_.WithMass(own_mass_kg, config_.cell);
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
  if (cell.tools() > 1 || cell.tool.number) probe.tool_number = snapshot_.robot.tool_number;
  if (!cell.payload_items.empty()) probe.payload_item = snapshot_.robot.payload_item;
  probe.payload_kg = at.payload.mass_kg - loads::ItemMass_kg(cell, probe.payload_item);
  probe.temp_C = snapshot_.robot.temp_C;
  probe.predicted_W = at.state.p_read_W;
  probe.radius_m = 0;
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
  effects::Conditions moment = ConditionsOf(at.payload);
  moment.temp_C = probe.temp_C;
  const deflection::LoadedArm& arm = corrector_.arm();
  prediction.extrapolated = arm.growth().Outside(arm.PointAt(probe.q, at.payload, moment));
  corrector_.StateRadius(at.payload, ConditionsOf(at.payload), Vec3::Zero(), prediction);
  const bool stated = prediction.basis != model::RadiusBasis::kUnknown;
  snapshot_.probe.radius_m = stated ? prediction.uncertainty_m : 0;
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
