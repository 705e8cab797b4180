// Start of a machine: branches of taught points, and what it takes over from its predecessor.
#include "firmware-like/correction/taught_tool.h"
#include "firmware-like/machine.h"

namespace plumbline {

std::optional<model::JointVector> Machine::FindTaughtBranch(std::size_t index) {
  const correction::AssemblyPoint& point = config_.points[index];
  if (!point.near_q) return std::nullopt;
  loads::Payload payload{point.payload_kg.value_or(0.0),
                         config_.cell.payload_cog_F.value_or(Vec3::Zero())};
  payload.tool = correction::TaughtTool(corrector_.arm(), point).value_or(0);
  correction::Correction correction;
  corrector_.solver().Correct(point, payload, ConditionsOf(payload), *point.near_q,
                              correction::BranchSearch::kThorough, correction);
  if (correction.code != correction::CorrectionCode::kOk) return std::nullopt;
  return correction.q;
}

void Machine::MarkTaughtBranchesPending() {
  for (std::size_t k = 0; k < config_.points.size(); ++k) {
    if (config_.points[k].near_q) points_.MarkPending(k);
  }
}

void Machine::SetTaughtBranch(std::size_t index, const std::optional<model::JointVector>& found) {
  points_.SetTaughtBranch(index, found);
}

void Machine::Prepare() {
  for (std::size_t k = 0; k < config_.points.size(); ++k) SetTaughtBranch(k, FindTaughtBranch(k));
}

correction::Correction Machine::Preview(const correction::AssemblyPoint& point,
                                        const loads::Payload& payload,
                                        const model::JointVector& seed,
                                        correction::BranchSearch search) {
  correction::Correction correction;
  corrector_.solver().Correct(point, payload, ConditionsOf(payload), seed, search, correction);
  if (correction.code == correction::CorrectionCode::kOk)
    corrector_.StateRadius(payload, ConditionsOf(payload), point.p_TP, correction);
  return correction;
}

void Machine::Prepare(const MachineConfig& previous, const Snapshot& last, double utc_s) {
  if (previous.cell.robot.size() != config_.cell.robot.size()) return;
  snapshot_.robot = last.robot;
  snapshot_.input_fault = last.input_fault;
  utc_s_ = utc_s;
  ChoosePayload();
  for (std::size_t k = 0; k < config_.points.size(); ++k) {
    const correction::AssemblyPoint& point = config_.points[k];
    const std::optional<loads::Payload> payload = payload_.WithMass(point.payload_kg, config_.cell);
    if (!payload) continue;
    for (std::size_t other = 0; other < previous.points.size(); ++other) {
      const correction::AssemblyPoint& same = previous.points[other];
      if (same.id != point.id || same.near_q != point.near_q || !last.points[other].valid) continue;
      const correction::Correction correction = Preview(
          point, *payload, last.points[other].correction.q, correction::BranchSearch::kNone);
      if (correction.code != correction::CorrectionCode::kOk) continue;
      points_.Adopt(k, corrector_, *payload, ConditionsOf(*payload), correction);
    }
  }
}

void Machine::ResumeFrom(const Machine& previous, RobotLinkContinuity link) {
  for (std::size_t k = 0; k < config_.points.size(); ++k) {
    for (std::size_t other = 0; other < previous.config_.points.size(); ++other) {
      if (config_.points[k].id != previous.config_.points[other].id) continue;
      snapshot_.points[k] = previous.snapshot_.points[other];
      snapshot_.points[k].valid = false;
      snapshot_.points[k].posture.taught = config_.points[k].near_q.has_value();
    }
  }
  snapshot_.cycle = previous.snapshot_.cycle;
  snapshot_.point_changes = previous.snapshot_.point_changes + 1;
  snapshot_.reading = previous.snapshot_.reading;
  snapshot_.result = previous.snapshot_.result;
  snapshot_.probe = previous.snapshot_.probe;
  snapshot_.probes.refused = previous.snapshot_.probes.refused;
  snapshot_.probes.fault = previous.snapshot_.probes.fault;
  snapshot_.probes.measured_W = previous.snapshot_.probes.measured_W;
  plc_heartbeat_ = previous.plc_heartbeat_;
  acknowledged_ = previous.acknowledged_;
  if (link == RobotLinkContinuity::kNew ||
      previous.config_.cell.robot.size() != config_.cell.robot.size()) {
    return;
  }
  filter_.ResumeFrom(previous.filter_);
  standstill_ = previous.standstill_;
  motion_.ResumeFrom(previous.motion_);
  snapshot_.probes.standstill = previous.snapshot_.probes.standstill;
  snapshot_.robot = previous.snapshot_.robot;
  snapshot_.payload = previous.snapshot_.payload;
  snapshot_.payload_valid = previous.snapshot_.payload_valid;
  snapshot_.reading_radius_m = previous.snapshot_.reading_radius_m;
  reading_radius_due_ = true;
}

}  // namespace plumbline
