#include "firmware-like/machine.h"

#include <algorithm>
#include <cmath>

#include "firmware-like/deflection/uncertainty.h"
#include "firmware-like/effects/written.h"
#include "firmware-like/loads/numbered_load.h"
#include "firmware-like/statistics/containment_radius.h"

namespace plumbline {
namespace {

constexpr double kHeartbeatTimeout_s = 2.0;
// A failed branch search costs about as much as 80 corrections (17 starts of 40 iterations each).
constexpr int kSearchesPerCycle = 2;
constexpr double kShortestPause_s = 0.02;  // between two searches for a point without a branch
constexpr double kLongestPause_s = 1.0;
constexpr double kCoarseReading_m = 1e-4;
constexpr int kRadiiPerCycle = 16;
// Input changes up to these limits change a radius little, so a point with a slowly changing
// temperature keeps its radius until the next one is computed.
constexpr double kSameTemperature_K = 0.5, kSameTime_s = 60;
constexpr double kSameLoad_kg = 0.01, kSameLoadShare = 0.005, kSameCentre_m = 1e-3;
constexpr double kSamePosture = 0.02;  // [rad] or [m]

std::uint16_t AlarmOf(InputFault fault) {
  switch (fault) {
    case InputFault::kOk:
      return 0;
    case InputFault::kMissing:
      return alarm::kRobotMissing;
    case InputFault::kStale:
      return alarm::kRobotStale;
    case InputFault::kTcpMismatch:
      return alarm::kDecodingWrong;
    default:
      return alarm::kRobotImplausible;
  }
}

/// Payload of that mass and centre of gravity; nullopt if either is unknown or implausible.
std::optional<loads::Payload> KnownPayload(std::optional<double> mass_kg,
                                           const std::optional<Vec3>& cog_F) {
  const bool plausible = mass_kg && *mass_kg >= 0 && *mass_kg <= loads::kMaxPayload_kg;
  if (!plausible || (*mass_kg > 0 && !cog_F)) return std::nullopt;
  return loads::Payload{*mass_kg, cog_F.value_or(Vec3::Zero())};
}

bool ReadsTime(const model::CellModel& cell) {
  const std::vector<effects::ActiveEffect> effects = effects::ActiveEffectsOf(cell);
  return std::any_of(effects.begin(), effects.end(), [](const effects::ActiveEffect& effect) {
    return effect.seen_t_s || ReadsTime(effect.term);
  });
}

}  // namespace

Machine::Machine(const MachineConfig& config)
    : config_(config),
      corrector_(config.cell, config.limits),
      uncertainty_(config.cell, corrector_.arm(), config.limits.deviation),
      reads_time_(ReadsTime(config.cell)),
      filter_(config.plausibility),
      motion_(config.cell),
      probe_bounds_(ProbeBoundsOf(corrector_.arm(), config.limits)),
      branches_(config.points.size()),
      radii_(config.points.size()) {
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

std::optional<model::JointVector> Machine::FindTaughtBranch(std::size_t index) {
  const correction::AssemblyPoint& point = config_.points[index];
  if (!point.near_q) return std::nullopt;
  const loads::Payload payload{point.payload_kg.value_or(0.0),
                               config_.cell.payload_cog_F.value_or(Vec3::Zero())};
  correction::Correction correction;
  corrector_.Correct(point, payload, ConditionsOf(payload), *point.near_q,
                     correction::BranchSearch::kThorough, correction);
  if (correction.code != correction::CorrectionCode::kOk) return std::nullopt;
  return correction.q;
}

void Machine::MarkTaughtBranchesPending() {
  for (std::size_t k = 0; k < config_.points.size(); ++k) {
    branches_[k].search_pending = config_.points[k].near_q.has_value();
  }
}

void Machine::SetTaughtBranch(std::size_t index, const std::optional<model::JointVector>& found) {
  branches_[index].search_pending = false;
  if (found && !branches_[index].solution) branches_[index].solution = found;
}

void Machine::Prepare() {
  for (std::size_t k = 0; k < config_.points.size(); ++k) SetTaughtBranch(k, FindTaughtBranch(k));
}

correction::Correction Machine::Preview(const correction::AssemblyPoint& point,
                                        const loads::Payload& payload,
                                        const model::JointVector& seed,
                                        correction::BranchSearch search) {
  correction::Correction correction;
  corrector_.Correct(point, payload, ConditionsOf(payload), seed, search, correction);
  if (correction.code == correction::CorrectionCode::kOk)
    StateUncertainty(payload, point.p_TP, correction);
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
    const std::optional<loads::Payload> payload = PayloadAt(point.payload_kg);
    if (!payload) continue;
    for (std::size_t other = 0; other < previous.points.size(); ++other) {
      const correction::AssemblyPoint& same = previous.points[other];
      if (same.id != point.id || same.near_q != point.near_q || !last.points[other].valid) continue;
      const correction::Correction correction = Preview(
          point, *payload, last.points[other].correction.q, correction::BranchSearch::kNone);
      if (correction.code != correction::CorrectionCode::kOk) continue;
      branches_[k].solution = correction.q;
      radii_[k] = {{correction.uncertainty_m, correction.basis},
                   CorrectionInputsFor(*payload),
                   correction.extrapolated,
                   correction.q};
      branches_[k].search_pending = false;
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
  snapshot_.reading = previous.snapshot_.reading;
  snapshot_.result = previous.snapshot_.result;
  snapshot_.probe = previous.snapshot_.probe;
  snapshot_.probes.refused = previous.snapshot_.probes.refused;
  snapshot_.probes.fault = previous.snapshot_.probes.fault;
  snapshot_.probes.measured_W = previous.snapshot_.probes.measured_W;
  last_heartbeat_ = previous.last_heartbeat_;
  heartbeat_seen_s_ = previous.heartbeat_seen_s_;
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

const Snapshot& Machine::Cycle(const MachineInput& input) {
  ++snapshot_.cycle;
  snapshot_.now_s = input.now_s;
  utc_s_ = input.utc_s;
  snapshot_.alarms = 0;
  snapshot_.warnings = input.background_warnings;
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
  Execute(input);
  if (input.gauge && !snapshot_.probe_taken) snapshot_.gauge_code = RecordGaugePress(input);
  ReportStatus(input);
  return snapshot_;
}

void Machine::CheckInput(const MachineInput& input) {
  const deflection::LoadedArm& arm = corrector_.arm();
  snapshot_.input_fault = filter_.Check(arm, input.robot, input.now_s);
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
                     snapshot_.robot.q_resolution != input.robot.q_resolution;
  reading_radius_due_ = false;
  snapshot_.robot = input.robot;
  if (!std::isfinite(snapshot_.robot.temp_C.value_or(0))) snapshot_.robot.temp_C.reset();
  if (!filter_.decoding_checked()) snapshot_.warnings |= warning::kDecodingUnchecked;
  if (arm.centres_guessed()) snapshot_.warnings |= warning::kMassCentresGuessed;
  if (input.robot.mode == model::RobotMode::kEmergencyStop)
    snapshot_.alarms |= alarm::kEmergencyStop;
  if (input.robot.q_resolution > 0) {
    if (moved) {
      deflection::LoadedState state;
      arm.AtActual(input.robot.q, {}, {}, state);
      snapshot_.reading_radius_m = statistics::RadiusHolding95Percent(
          deflection::ReadingCovariance(arm, state, input.robot.q_resolution));
    }
    if (snapshot_.reading_radius_m > kCoarseReading_m) {
      snapshot_.warnings |= warning::kCoarseJoints;
    }
  }
}

void Machine::ChoosePayload() {
  const PayloadPolicy& policy = config_.payload;
  const model::RobotState& robot = snapshot_.robot;
  const bool robot_trusted = snapshot_.input_fault == InputFault::kOk;
  std::optional<double> mass_kg;
  std::optional<Vec3> cog_F = config_.cell.payload_cog_F;
  const auto take = [&](const PayloadPolicy::ToolLoad& load) {
    mass_kg = load.mass_kg;
    if (load.cog_F) cog_F = load.cog_F;
  };
  switch (policy.source) {
    case PayloadPolicy::Source::kFixed:
      take(policy.fixed);
      break;
    case PayloadPolicy::Source::kTable:
      for (const PayloadPolicy::ToolLoad& load : policy.table) {
        if (robot_trusted && robot.tool_number == load.number) take(load);
      }
      break;
    case PayloadPolicy::Source::kRobot:
      if (robot_trusted) mass_kg = robot.payload_kg;
      if (robot_trusted && robot.payload_cog_F) cog_F = robot.payload_cog_F;
      break;
  }
  cog_F_ = cog_F && cog_F->allFinite() ? cog_F : std::nullopt;
  const std::optional<loads::Payload> payload = WithToolAndItem(KnownPayload(mass_kg, cog_F_));
  snapshot_.payload_valid = payload.has_value();
  if (payload) snapshot_.payload = *payload;
}

void Machine::ReportMotion() {
  const std::optional<loads::Payload> payload = PayloadAt(std::nullopt);
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

std::optional<loads::Payload> Machine::PayloadAt(const std::optional<double>& own_mass_kg) const {
  if (own_mass_kg) {
    return WithToolAndItem(KnownPayload(
        own_mass_kg, config_.cell.payload_cog_F ? config_.cell.payload_cog_F : cog_F_));
  }
  return snapshot_.payload_valid ? std::optional(snapshot_.payload) : std::nullopt;
}

std::optional<loads::Payload> Machine::WithToolAndItem(
    std::optional<loads::Payload> payload) const {
  const model::CellModel& cell = config_.cell;
  const model::RobotState& robot = snapshot_.robot;
  const bool robot_trusted = snapshot_.input_fault == InputFault::kOk;
  if (!payload) return payload;
  if (cell.tools() > 1) {
    const std::optional<int> tool =
        robot_trusted ? loads::ToolIndexOf(cell, robot.tool_number) : std::nullopt;
    if (!tool) return std::nullopt;
    payload->tool = *tool;
  }
  if (cell.payload_items.empty()) return payload;
  if (!robot_trusted || !robot.payload_item) return std::nullopt;
  const model::PayloadItem* item = loads::ItemOf(cell, robot.payload_item);
  if (item == nullptr && *robot.payload_item != 0) return std::nullopt;
  return loads::WithItem(*payload, item);
}

effects::Conditions Machine::ConditionsOf(const loads::Payload& payload) const {
  effects::Conditions conditions;
  conditions.payload_kg = payload.mass_kg;
  if (const auto& domain = config_.cell.domain; domain && domain->time_zero_s) {
    conditions.t_s = utc_s_ - *domain->time_zero_s;
  }
  conditions.temp_C = snapshot_.robot.temp_C;
  return conditions;
}

Machine::CorrectionInputs Machine::CorrectionInputsFor(const loads::Payload& payload) const {
  const effects::Conditions conditions = ConditionsOf(payload);
  return {.mass_kg = payload.mass_kg,
          .cog_F = payload.cog_F,
          .tool = payload.tool,
          .temp_C = conditions.temp_C,
          .t_s = reads_time_ ? conditions.t_s : std::nullopt};
}

bool Machine::SameForRadius(const CorrectionInputs& a, const CorrectionInputs& b) {
  const auto near = [](const std::optional<double>& x, const std::optional<double>& y,
                       double within) {
    return x.has_value() == y.has_value() && (!x || std::abs(*x - *y) <= within);
  };
  const double load_kg = kSameLoad_kg + kSameLoadShare * std::max(a.mass_kg, b.mass_kg);
  return a.tool == b.tool && std::abs(a.mass_kg - b.mass_kg) <= load_kg &&
         (a.cog_F - b.cog_F).norm() <= kSameCentre_m &&
         near(a.temp_C, b.temp_C, kSameTemperature_K) && near(a.t_s, b.t_s, kSameTime_s);
}

void Machine::StateUncertainty(const loads::Payload& payload, const Vec3& p_TP,
                               correction::Correction& correction) {
  const model::StatedRadius stated =
      uncertainty_.At(corrector_.arm(), correction.q, deflection::LoadStatement::Stated(payload),
                      ConditionsOf(payload), correction.extrapolated, p_TP);
  if (!stated.known()) correction.code = correction::CorrectionCode::kNotConverged;
  correction.uncertainty_m = stated.radius_m;
  correction.basis = stated.basis;
}

void Machine::RefreshPoints() {
  int searches_left = kSearchesPerCycle;
  const std::size_t count = config_.points.size(), first = next_search_;
  for (std::size_t k = 0; k < count; ++k) RefreshPoint((first + k) % count, searches_left);
  RefreshRadii();
  for (const PointResult& result : snapshot_.points) {
    if (result.valid) continue;
    snapshot_.first_error = result.code;
    break;
  }
}

void Machine::RefreshPoint(std::size_t index, int& searches_left) {
  const correction::AssemblyPoint& point = config_.points[index];
  PointResult& result = snapshot_.points[index];
  Branch& branch = branches_[index];
  result.valid = false;
  if (snapshot_.input_fault != InputFault::kOk) {
    result.code = correction::CorrectionCode::kNoRobot;
    return;
  }
  const std::optional<loads::Payload> payload = PayloadAt(point.payload_kg);
  if (!payload) {
    result.code = correction::CorrectionCode::kPayloadUnknown;
    return;
  }
  if (snapshot_.lenses_missing != 0) {
    result.code = correction::CorrectionCode::kLensStale;
    return;
  }
  if (branch.search_pending) {
    result.code = correction::CorrectionCode::kPending;
    return;
  }
  const CorrectionInputs inputs = CorrectionInputsFor(*payload);
  const bool solved = branch.inputs == inputs;
  correction::Correction correction;
  if (solved) {
    correction = branch.correction;
  } else if (branch.solution) {
    corrector_.Correct(point, *payload, ConditionsOf(*payload), *branch.solution,
                       correction::BranchSearch::kNone, correction);
  }
  // No branch yet, or the present one is lost: search the nearest one, for a few points per cycle.
  const bool lost = !branch.solution ||
                    correction.code == correction::CorrectionCode::kUnreachable ||
                    correction.code == correction::CorrectionCode::kJointLimit;
  if (lost && searches_left > 0 && snapshot_.now_s >= branch.search.next_s) {
    --searches_left;
    next_search_ = index + 1;
    const model::JointVector& seed = point.near_q ? *point.near_q : snapshot_.robot.q;
    corrector_.Correct(point, *payload, ConditionsOf(*payload), seed,
                       correction::BranchSearch::kBrief, correction);
    Branch::Search& search = branch.search;
    search.result = correction.code;
    search.pause_s = std::clamp(2 * search.pause_s, kShortestPause_s, kLongestPause_s);
    search.next_s = snapshot_.now_s + search.pause_s;
  } else if (lost) {
    correction.code = branch.search.result;
  }
  result.code = correction.code;
  if (correction.code != correction::CorrectionCode::kOk) return;
  branch.search = {};
  if (!solved) {
    branch.solution = correction.q;
    branch.inputs = inputs;
    branch.correction = correction;
    result.posture = correction::PointPostureAt(chain(), point, correction.q);
    ++result.solutions;
  }
  result.correction = correction;
  result.valid = true;  // RefreshRadii() clears it if the radius is unknown
}

void Machine::RefreshRadii() {
  const std::size_t count = config_.points.size(), first = next_radius_;
  int left = kRadiiPerCycle;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t index = (first + k) % count;
    PointResult& point = snapshot_.points[index];
    if (!point.valid) continue;
    correction::Correction& correction = point.correction;
    Radius& radius = radii_[index];
    const CorrectionInputs& now = *branches_[index].inputs;
    bool holds = radius.inputs && SameForRadius(*radius.inputs, now) &&
                 radius.extrapolated == correction.extrapolated &&
                 (radius.q - correction.q).cwiseAbs().maxCoeff() <= kSamePosture;
    if (!holds && left > 0) {
      --left;
      next_radius_ = (index + 1) % count;
      StateUncertainty({now.mass_kg, now.cog_F}, config_.points[index].p_TP, correction);
      radius = {
          {correction.uncertainty_m, correction.basis}, now, correction.extrapolated, correction.q};
      holds = true;
    }
    correction.uncertainty_m = radius.stated.radius_m;
    correction.basis = holds ? radius.stated.basis : model::RadiusBasis::kUnknown;
    if (radius.inputs && radius.stated.known()) {
      point.ever_valid = true;
      ++point.sequence;
    } else {  // a point is valid only with a known radius
      point.valid = false;
      point.code = radius.inputs ? correction::CorrectionCode::kNotConverged
                                 : correction::CorrectionCode::kPending;
    }
  }
}

HealthInputs Machine::HealthInputsFrom(const MachineInput& input) const {
  HealthInputs facts{.alarms = snapshot_.alarms, .warnings = snapshot_.warnings};
  for (const PointResult& point : snapshot_.points) {
    facts.pending =
        facts.pending || (!point.valid && point.code == correction::CorrectionCode::kPending);
    if (!point.valid) continue;
    facts.extrapolating = facts.extrapolating || point.correction.extrapolated;
    facts.weakest_basis = model::Weakest(facts.weakest_basis.value_or(point.correction.basis),
                                         point.correction.basis);
    facts.radius_too_large =
        facts.radius_too_large || point.correction.uncertainty_m > config_.limits.max_translation_m;
  }
  for (const CameraInput& camera : input.cameras) {
    facts.fiducial_moved = facts.fiducial_moved || (camera.configured && camera.fiducial_moved);
  }
  facts.required_lens_missing = snapshot_.lenses_missing != 0;
  facts.scene_lost = input.scene_lost;
  facts.scene_incomplete = input.scene_incomplete;
  facts.no_points = config_.points.empty();
  facts.reference_refused = input.reference_refused;
  facts.quarantined = input.quarantined;
  return facts;
}

void Machine::ReportStatus(const MachineInput& input) {
  std::uint16_t& word = snapshot_.status;
  word = 0;
  const auto set = [&word](std::uint16_t bit, bool on) {
    if (on) word = static_cast<std::uint16_t>(word | bit);
  };
  if (input.command.heartbeat != last_heartbeat_) {
    last_heartbeat_ = input.command.heartbeat;
    heartbeat_seen_s_ = input.now_s;
  }
  const bool heartbeat =
      heartbeat_seen_s_ && input.now_s - *heartbeat_seen_s_ < kHeartbeatTimeout_s;
  if (heartbeat_seen_s_ && !heartbeat) snapshot_.warnings |= warning::kPlcHeartbeatLost;
  if (input.cycle_overrun) snapshot_.warnings |= warning::kCycleOverrun;
  if (corrector_.arm().torques_missing()) snapshot_.alarms |= alarm::kTorquesUnknown;

  bool all_valid = true;
  bool extrapolating = false;
  for (const PointResult& point : snapshot_.points) {
    all_valid = all_valid && point.valid;
    extrapolating = extrapolating || (point.valid && point.correction.extrapolated);
    const bool refused = !point.valid && point.code != correction::CorrectionCode::kNoRobot &&
                         point.code != correction::CorrectionCode::kPending;
    if (refused) {
      snapshot_.alarms |= point.code == correction::CorrectionCode::kPayloadUnknown
                              ? alarm::kPayloadUnknown
                              : alarm::kPointRefused;
    }
  }
  const bool robot_trusted = snapshot_.input_fault == InputFault::kOk;
  snapshot_.health = HealthOf(HealthInputsFrom(input));
  set(status::kReady, robot_trusted && all_valid);
  set(status::kResultValid, snapshot_.result.valid);
  set(status::kRobotLink, robot_trusted);
  set(status::kWarning, snapshot_.warnings != 0);
  set(status::kError, snapshot_.alarms != 0);
  const auto stale = [](const CameraInput& one) { return one.configured && !one.lens_valid; };
  set(status::kLensCalibrated, input.cameras.front().configured &&
                                   std::none_of(input.cameras.begin(), input.cameras.end(), stale));
  set(status::kExtrapolating, extrapolating);
  set(status::kTemperatureValid, robot_trusted && snapshot_.robot.temp_C.has_value());
  set(status::kPayloadValid, snapshot_.payload_valid);
  set(status::kPlcHeartbeatSeen, heartbeat);
  set(status::kManual, input.command.manual || snapshot_.robot.mode == model::RobotMode::kManual);
  set(status::kToggle, std::fmod(input.now_s, 2.0) >= 1.0);
}

}  // namespace plumbline
