#include "firmware-like/machine.h"

#include <algorithm>
#include <cmath>

#include "firmware-like/cycle_status.h"
#include "firmware-like/deflection/uncertainty.h"
#include "firmware-like/loads/numbered_load.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline {
namespace {

constexpr double kCoarseReading_m = 1e-4;

}  // namespace

Machine::Machine(const MachineConfig& config)
    : config_(config),
      corrector_(config.cell, config.limits),
      payload_(config.payload, config.cell.payload_cog_F),
      points_(config.points.size()),
      filter_(config.plausibility),
      motion_(config.cell),
      probe_bounds_(ProbeBoundsOf(corrector_.arm(), config.limits)) {
  snapshot_.points.resize(config_.points.size());
  for (int i = 0; i < config_.cell.robot.size(); ++i) {
    if (config_.cell.robot.joints[static_cast<std::size_t>(i)].type ==
        model::JointType::kPrismatic) {
      snapshot_.prismatic_joints = static_cast<std::uint16_t>(snapshot_.prismatic_joints | 1 << i);
    }
  }
  const model::JointVector zero = model::JointVector::Zero(config_.cell.robot.size());
  snapshot_.robot.q = zero;
  snapshot_.reading.q = zero;
  snapshot_.result.correction.q = zero;
  snapshot_.probes.reach_m = probe_bounds_.reach_m;
  snapshot_.probes.contradiction_m = probe_bounds_.contradiction_m;
  for (std::size_t k = 0; k < config_.points.size(); ++k) {
    snapshot_.points[k].correction.q = zero;
    snapshot_.points[k].posture.taught = config_.points[k].near_q.has_value();
  }
}

const Snapshot& Machine::Cycle(const MachineInput& input) {
  ++snapshot_.cycle;
  snapshot_.now_s = input.now_s;
  utc_s_ = input.utc_s;
  snapshot_.alarms = 0;
  snapshot_.warnings = input.background_warnings;
  snapshot_.command_executed = false;
  snapshot_.probe_taken = false;
  snapshot_.gauge_code.reset();
  snapshot_.monitor_restart = false;
  snapshot_.calibration_requests.fill(CalibrationRequest::kNone);
  snapshot_.first_error = correction::CorrectionCode::kOk;

  CheckInput(input);
  ChoosePayload();
  ReportMotion();
  CheckRequiredLenses(input);
  RefreshPoints();
  StatePresentRadius();
  Execute(input);
  // A restart of the monitoring takes the journal's place in this cycle.
  if (input.gauge && !snapshot_.probe_taken && !snapshot_.monitor_restart)
    snapshot_.gauge_code = RecordGaugePress(input);
  // Refresh() has stated the bases again, and counted only its own changes.
  if (basis_withdrawn_ != input.radius_contradicted) ++snapshot_.point_changes;
  basis_withdrawn_ = input.radius_contradicted;
  if (basis_withdrawn_) WithdrawBasis();
  ReportStatus(input);
  return snapshot_;
}

void Machine::CheckInput(const MachineInput& input) {
  const deflection::LoadedArm& arm = corrector_.arm();
  // The only tool is mounted whatever its number.
  const std::optional<int> mounted =
      arm.tools() == 1 ? 0 : loads::ToolIndexOf(config_.cell, input.robot.tool_number);
  snapshot_.input_fault = filter_.Check(arm, input.robot, input.now_s, mounted);
  snapshot_.tip_of_tool.reset();
  if (const std::optional<int> other = filter_.tip_of_other_tool())
    snapshot_.tip_of_tool = config_.cell.ToolAt(*other).number;
  if (input.robot.sequence != 0) snapshot_.reading = input.robot;
  snapshot_.data_age_s = input.now_s - input.robot.timestamp_s;
  snapshot_.alarms |= AlarmOf(snapshot_.input_fault);
  snapshot_.probes.standstill = false;
  if (snapshot_.input_fault != InputFault::kOk) {
    motion_.Forget();
    return;
  }
  standstill_.Observe(input.robot);
  snapshot_.probes.standstill = !standstill_.Moving(input.now_s);
  motion_.Observe(input.robot, snapshot_.probes.standstill);
  const bool moved = reading_radius_due_ || snapshot_.robot.q != input.robot.q ||
                     snapshot_.robot.q_resolution != input.robot.q_resolution ||
                     snapshot_.robot.tool_number != input.robot.tool_number;
  reading_radius_due_ = false;
  snapshot_.robot = input.robot;
  if (!std::isfinite(snapshot_.robot.temp_C.value_or(0))) snapshot_.robot.temp_C.reset();
  if (!filter_.decoding_checked()) snapshot_.warnings |= warning::kDecodingUnchecked;
  if (arm.centres_guessed()) snapshot_.warnings |= warning::kMassCentresGuessed;
  if (input.robot.mode == model::RobotMode::kEmergencyStop)
    snapshot_.alarms |= alarm::kEmergencyStop;
  CheckResolution(moved);
}

void Machine::CheckResolution(bool moved) {
  const model::RobotState& robot = snapshot_.robot;
  if (!(robot.q_resolution > 0)) return;
  if (moved) {
    const deflection::LoadedArm& arm = corrector_.arm();
    deflection::LoadedState state;
    loads::Payload empty_tool;
    empty_tool.tool = loads::ToolIndexOf(config_.cell, robot.tool_number).value_or(0);
    arm.AtActual(robot.q, empty_tool, {}, state);
    snapshot_.reading_radius_m = statistics::RadiusHolding95Percent(
        deflection::ReadingCovariance(arm, state, robot.q_resolution));
  }
  if (snapshot_.reading_radius_m > kCoarseReading_m) {
    snapshot_.warnings |= warning::kCoarseJoints;
  }
}

void Machine::ChoosePayload() {
  payload_.Select(snapshot_.input_fault == InputFault::kOk ? &snapshot_.robot : nullptr,
                  config_.cell);
  snapshot_.payload_valid = payload_.present().has_value();
  snapshot_.undeclared = payload_.undeclared();
  if (payload_.present()) snapshot_.payload = *payload_.present();
}

void Machine::ReportMotion() {
  const std::optional<loads::Payload>& payload = payload_.present();
  snapshot_.motion = motion_.Status(corrector_.arm(), snapshot_.now_s, payload,
                                    payload ? ConditionsOf(*payload) : effects::Conditions{});
}

void Machine::CheckRequiredLenses(const MachineInput& input) {
  int missing = 0;
  for (std::size_t k = 0; k < model::kMaxCameras; ++k) {
    const CameraInput& camera = input.cameras[k];
    const bool valid = camera.configured && camera.lens_valid;
    if (config_.required_lenses[k] && !valid) missing |= 1 << k;
  }
  snapshot_.lenses_missing = static_cast<std::uint16_t>(missing);
}

effects::Conditions Machine::ConditionsOf(const loads::Payload& payload) const {
  return corrector_.ConditionsOf(payload, utc_s_, snapshot_.robot.temp_C);
}

void Machine::RefreshPoints() {
  snapshot_.point_changes +=
      points_.Refresh({.points = config_.points,
                       .cell = config_.cell,
                       .payload = payload_,
                       .q = snapshot_.robot.q,
                       .temp_C = snapshot_.robot.temp_C,
                       .utc_s = utc_s_,
                       .now_s = snapshot_.now_s,
                       .robot_trusted = snapshot_.input_fault == InputFault::kOk,
                       .lens_missing = snapshot_.lenses_missing != 0},
                      corrector_, snapshot_.points);
  const auto failed = std::find_if(snapshot_.points.begin(), snapshot_.points.end(),
                                   [](const PointResult& point) { return !point.valid; });
  if (failed != snapshot_.points.end()) snapshot_.first_error = failed->code;
}

void Machine::StatePresentRadius() {
  snapshot_.present_radius = {};
  const std::optional<loads::Payload>& payload = payload_.present();
  if (!config_.states_present_radius || snapshot_.input_fault != InputFault::kOk || !payload)
    return;
  const model::JointVector& q = snapshot_.robot.q;
  const effects::Conditions conditions = ConditionsOf(*payload);
  correction::Correction landing;
  corrector_.solver().PredictLanding(corrector_.arm().UnloadedTip(q, payload->tool), Vec3::Zero(),
                                     *payload, conditions, q, correction::BranchSearch::kNone,
                                     landing);
  if (landing.code != correction::CorrectionCode::kOk) return;
  corrector_.StateRadius(*payload, conditions, Vec3::Zero(), landing);
  snapshot_.present_radius = {landing.uncertainty_m, landing.basis};
}

void Machine::WithdrawBasis() {
  snapshot_.present_radius.basis = model::RadiusBasis::kUnknown;
  for (PointResult& point : snapshot_.points) {
    point.correction.basis = model::RadiusBasis::kUnknown;
  }
  snapshot_.result.correction.basis = model::RadiusBasis::kUnknown;
}

void Machine::ReportStatus(const MachineInput& input) {
  plc_heartbeat_.Observe(input.command.heartbeat, input.now_s);
  if (plc_heartbeat_.lost()) snapshot_.warnings |= warning::kPlcHeartbeatLost;
  if (input.cycle_overrun) snapshot_.warnings |= warning::kCycleOverrun;
  if (corrector_.arm().torques_missing()) snapshot_.alarms |= alarm::kTorquesUnknown;
  snapshot_.alarms |= AlarmsOf(snapshot_.points);
  snapshot_.health = HealthOf(HealthInputsFrom(snapshot_, input, config_.limits.max_translation_m));
  snapshot_.status = StatusWordOf(snapshot_, input, plc_heartbeat_.alive());
}

}  // namespace plumbline
