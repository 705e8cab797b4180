#include "firmware-like/point_corrections.h"

#include <algorithm>
#include <cmath>

namespace plumbline {
namespace {

// A failed branch search costs about as much as 80 corrections (17 starts of 40 iterations each).
constexpr int kSearchesPerCycle = 2;
constexpr double kShortestPause_s = 0.02;  // between two searches for a point without a branch
constexpr double kLongestPause_s = 1.0;
constexpr int kRadiiPerCycle = 16;
// Input changes up to these limits change a radius little, so a point with a slowly changing
// temperature keeps its radius until the next one is computed.
constexpr double kSameTemperature_K = 0.5, kSameTime_s = 60;
constexpr double kSameLoad_kg = 0.01, kSameLoadShare = 0.005, kSameCentre_m = 1e-3;
constexpr double kSamePosture = 0.02;  // [rad] or [m]

}  // namespace

void PointCorrections::SetTaughtBranch(std::size_t index,
                                       const std::optional<model::JointVector>& found) {
  branches_[index].search_pending = false;
  if (found && !branches_[index].solution) branches_[index].solution = found;
}

void PointCorrections::Adopt(std::size_t index, const correction::CellCorrector& corrector,
                             const loads::Payload& payload, const effects::Conditions& conditions,
                             const correction::Correction& solution) {
  branches_[index].solution = solution.q;
  branches_[index].search_pending = false;
  radii_[index] = {{solution.uncertainty_m, solution.basis},
                   InputsOf(corrector, payload, conditions),
                   solution.extrapolated,
                   solution.q};
}

loads::Payload PointCorrections::SolvedPayload(std::size_t index) const {
  const CorrectionInputs& inputs = *branches_[index].inputs;
  return {inputs.mass_kg, inputs.cog_F, inputs.tool};
}

PointCorrections::CorrectionInputs PointCorrections::InputsOf(
    const correction::CellCorrector& corrector, const loads::Payload& payload,
    const effects::Conditions& conditions) {
  return {.mass_kg = payload.mass_kg,
          .cog_F = payload.cog_F,
          .tool = payload.tool,
          .temp_C = conditions.temp_C,
          .t_s = corrector.reads_time() ? conditions.t_s : std::nullopt};
}

bool PointCorrections::SameForRadius(const CorrectionInputs& a, const CorrectionInputs& b) {
  const auto near = [](const std::optional<double>& x, const std::optional<double>& y,
                       double within) {
    return x.has_value() == y.has_value() && (!x || std::abs(*x - *y) <= within);
  };
  const double load_kg = kSameLoad_kg + kSameLoadShare * std::max(a.mass_kg, b.mass_kg);
  return a.tool == b.tool && std::abs(a.mass_kg - b.mass_kg) <= load_kg &&
         (a.cog_F - b.cog_F).norm() <= kSameCentre_m &&
         near(a.temp_C, b.temp_C, kSameTemperature_K) && near(a.t_s, b.t_s, kSameTime_s);
}

bool PointCorrections::Holds(const Radius& radius, const CorrectionInputs& now,
                             const correction::Correction& correction) {
  return radius.inputs && SameForRadius(*radius.inputs, now) &&
         radius.extrapolated == correction.extrapolated &&
         (radius.q - correction.q).cwiseAbs().maxCoeff() <= kSamePosture;
}

PointCorrections::Shown PointCorrections::ShownOf(const PointResult& result) {
  const correction::Correction& correction = result.correction;
  return {result.valid,     result.ever_valid,        correction.extrapolated, result.code,
          result.solutions, correction.uncertainty_m, correction.basis};
}

std::size_t PointCorrections::Refresh(const PointInputs& inputs,
                                      correction::CellCorrector& corrector,
                                      std::vector<PointResult>& results) {
  searches_left_ = kSearchesPerCycle;
  const std::size_t count = results.size(), first = next_search_;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t index = (first + k) % count;
    RefreshPoint(index, inputs, corrector, results[index]);
  }
  RefreshRadii(inputs, corrector, results);
  std::size_t changed = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const Shown shown = ShownOf(results[k]);
    if (shown == shown_[k]) continue;
    shown_[k] = shown;
    ++changed;
  }
  return changed;
}

correction::CorrectionCode PointCorrections::Obstacle(
    const PointInputs& inputs, std::size_t index,
    const std::optional<loads::Payload>& payload) const {
  if (!inputs.robot_trusted) return correction::CorrectionCode::kNoRobot;
  if (!payload) return correction::CorrectionCode::kPayloadUnknown;
  if (inputs.lens_missing) return correction::CorrectionCode::kLensStale;
  if (branches_[index].search_pending) return correction::CorrectionCode::kPending;
  return correction::CorrectionCode::kOk;
}

void PointCorrections::RefreshPoint(std::size_t index, const PointInputs& inputs,
                                    const correction::CellCorrector& corrector,
                                    PointResult& result) {
  const correction::AssemblyPoint& point = inputs.points[index];
  Branch& branch = branches_[index];
  const std::optional<loads::Payload> payload =
      inputs.payload.WithMass(point.payload_kg, inputs.cell);
  result.valid = false;
  result.code = Obstacle(inputs, index, payload);
  if (result.code != correction::CorrectionCode::kOk) return;
  const effects::Conditions conditions =
      corrector.ConditionsOf(*payload, inputs.utc_s, inputs.temp_C);
  const CorrectionInputs now = InputsOf(corrector, *payload, conditions);
  const bool solved = branch.inputs == now;
  correction::Correction correction;
  if (solved) {
    correction = branch.correction;
  } else if (branch.solution) {
    corrector.solver().Correct(point, *payload, conditions, *branch.solution,
                               correction::BranchSearch::kNone, correction);
  }
  // No branch yet, or the present one is lost.
  if (!branch.solution || correction.code == correction::CorrectionCode::kUnreachable ||
      correction.code == correction::CorrectionCode::kJointLimit) {
    SearchBranch(index, inputs, *payload, conditions, corrector, correction);
  }
  result.code = correction.code;
  if (correction.code != correction::CorrectionCode::kOk) return;
  branch.search = {};
  if (!solved) {
    branch.solution = correction.q;
    branch.inputs = now;
    branch.correction = correction;
    result.posture = correction::PointPostureAt(corrector.arm().chain(), point, correction.q);
    ++result.solutions;
  }
  result.correction = correction;
  result.valid = true;  // RefreshRadii() clears it if the radius is unknown
}

void PointCorrections::SearchBranch(std::size_t index, const PointInputs& inputs,
                                    const loads::Payload& payload,
                                    const effects::Conditions& conditions,
                                    const correction::CellCorrector& corrector,
                                    correction::Correction& correction) {
  Branch::Search& search = branches_[index].search;
  if (searches_left_ == 0 || inputs.now_s < search.next_s) {
    correction.code = search.result;
    return;
  }
  --searches_left_;
  next_search_ = index + 1;
  const correction::AssemblyPoint& point = inputs.points[index];
  corrector.solver().Correct(point, payload, conditions, point.near_q ? *point.near_q : inputs.q,
                             correction::BranchSearch::kBrief, correction);
  search.result = correction.code;
  search.pause_s = std::clamp(2 * search.pause_s, kShortestPause_s, kLongestPause_s);
  search.next_s = inputs.now_s + search.pause_s;
}

void PointCorrections::RefreshRadii(const PointInputs& inputs, correction::CellCorrector& corrector,
                                    std::vector<PointResult>& results) {
  const std::size_t count = results.size(), first = next_radius_;
  int left = kRadiiPerCycle;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t index = (first + k) % count;
    PointResult& point = results[index];
    if (!point.valid) continue;
    correction::Correction& correction = point.correction;
    Radius& radius = radii_[index];
    const CorrectionInputs& now = *branches_[index].inputs;
    bool holds = Holds(radius, now, correction);
    if (!holds && left > 0) {
      --left;
      next_radius_ = (index + 1) % count;
      const loads::Payload payload = SolvedPayload(index);
      corrector.StateRadius(payload, corrector.ConditionsOf(payload, inputs.utc_s, inputs.temp_C),
                            inputs.points[index].p_TP, correction);
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

}  // namespace plumbline
