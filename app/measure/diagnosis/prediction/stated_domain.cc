#include "app/measure/diagnosis/prediction/stated_domain.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "app/measure/diagnosis/critics/misfit.h"
#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/linear/fit_problem.h"
#include "app/measure/diagnosis/linear/linearisation.h"
#include "app/measure/diagnosis/prediction/covariance_share.h"
#include "app/measure/diagnosis/prediction/residual_spread.h"
#include "app/measure/diagnosis/result/diagnosis.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/diagnosis/search/explained_effects.h"
#include "app/measure/diagnosis/validation/farthest_poses.h"
#include "app/measure/diagnosis/validation/input_ranges.h"
#include "firmware-like/effects/catalogue.h"
#include "firmware-like/kinematics/pose_distance.h"
#include "firmware-like/loads/numbered_load.h"

namespace plumbline::measure {
namespace {

// Validity domain of a corrected model and the frames of its sessions.

/// Adds to `diagnosis` the estimated frames of each session, if the cell leaves them free, and the
/// range covered by the rows that were not rejected.
void AddFramesAndDomain(const FitProblem& problem, const Model& model, Diagnosis& diagnosis) {
  const Dataset& data = problem.data;
  if (data.frames_free() || data.tip_free()) {
    for (const SessionIndex session : data.sessions.indices()) {
      model::SessionFrames frames;
      frames.id = data.sessions[session].empty() ? "1" : data.sessions[session];
      frames.X_WB = model.frames[session].X_WB;
      for (int tool = 0; data.tip_free() && tool < data.cell.tools(); ++tool) {
        if (!data.measured_tools[session][tool]) continue;
        frames.tips.push_back({deflection::SessionTipNumber(data.cell, tool),
                               model.frames[session].X_FT[tool].p, std::nullopt});
      }
      diagnosis.sessions.push_back(frames);
    }
  }
  model::Domain& domain = diagnosis.domain;
  const auto widen = [](model::Interval& interval, double value) {
    interval.low = std::min(interval.low, value);
    interval.high = std::max(interval.high, value);
  };
  std::set<int> tools, items;
  for (const RowIndex index : data.row_indices()) {
    if (problem.weights[index] < kOutlierWeight) continue;
    const MeasuredRow& row = data.measured(index);
    if (domain.q.empty()) {
      for (const double q : row.q) domain.q.push_back({q, q});
    }
    for (std::size_t i = 0; i < domain.q.size(); ++i)
      widen(domain.q[i], row.q[static_cast<int>(i)]);
    if (data.cell.tool.number) tools.insert(*data.cell.ToolAt(data.payloads[index].tool).number);
    items.insert(data.payloads[index].item);
  }
  domain.tools.assign(tools.begin(), tools.end());
  if (!data.cell.payload_items.empty()) domain.payload_items.emplace(items.begin(), items.end());
}

// Difference between an answer and its rivals at new points, where no row decides between them.

/// Standard deviation on one axis of the difference between the answer and its rivals at a distance
/// d from the measured poses, r their reach: sqrt(near_m^2 + distant_m^2 max(0, d^2 - r^2)).
struct RivalSpread {
  double near_m = 0, distant_m = 0;
};

/// Variance of one axis between the answer and the rival with the largest tip displacement [m^2].
/// Used for ranges, which do not test this difference: explanations that agree along the wire may
/// differ across it.
double VarianceBetweenRivals(const Diagnosis& diagnosis) {
  double most_m2 = 0;
  for (const Rival& rival : diagnosis.rivals) {
    double sum_m2 = 0;
    for (const Vec3& shift_W : rival.shift_W) sum_m2 += shift_W.squaredNorm() / 3;
    const double rows = static_cast<double>(std::max<std::size_t>(1, rival.shift_W.size()));
    most_m2 = std::max(most_m2, sum_m2 / rows);
  }
  return most_m2;
}

/// Least squares fit of the squared differences, both terms at least 0. On the rows the
/// explanations agree, so held-out rows do not show how they differ elsewhere; between the points
/// of a grid they may differ however near these are.
/// @param from   distance from the measured poses
/// @param reach  their reach [rad]
/// @param axes  measured lengths per row: 3, or 1 for ranges
RivalSpread SpreadOfRivals(const std::vector<RivalSeparation>& separations,
                           const kinematics::PoseDistance& from, double reach, double axes) {
  double n = 0, sum_x = 0, sum_xx = 0, sum_y = 0, sum_xy = 0;
  for (const RivalSeparation& at : separations) {
    const double x = std::max(0.0, std::pow(from.Of(at.q), 2) - reach * reach);
    const double y = at.distance_m * at.distance_m / axes;
    n += 1, sum_x += x, sum_xx += x * x, sum_y += y, sum_xy += x * y;
  }
  if (n == 0) return {};
  const double spread = n * sum_xx - sum_x * sum_x;
  const double slope = spread > 0 ? (n * sum_xy - sum_x * sum_y) / spread : 0;
  const double intercept = (sum_y - slope * sum_x) / n;
  if (slope < 0) return {std::sqrt(sum_y / n), 0};
  if (intercept < 0) return {0, sum_xx > 0 ? std::sqrt(sum_xy / sum_xx) : 0};
  return {std::sqrt(intercept), std::sqrt(slope)};
}

/// The problem in which rows that the model does not fit have no weight.
FitProblem WithoutMisfit(FitProblem problem, const std::optional<Misfit>& misfit) {
  if (!misfit || !misfit->outside_domain) return problem;
  for (const RowIndex row : problem.weights.indices()) {
    if (Meets(misfit->condition, problem.data, row)) problem.weights[row] = 0;
  }
  return problem;
}

/// Adds a note if the correction depends on torques whose directions are not known.
void AddLoadNote(const std::vector<effects::ActiveEffect>& found, bool weight_known,
                 Diagnosis& diagnosis) {
  const bool unknown_loads =
      !weight_known && std::ranges::any_of(found, [](const effects::ActiveEffect& effect) {
        const effects::EffectTraits& traits = effect.term.effect->traits();
        return traits.Needs(effects::Signal::kNoTorques, effect.term.word) ||
               traits.Needs(effects::Signal::kTorques, effect.term.word);
      });
  if (!unknown_loads) return;
  diagnosis.notes.emplace_back(
      "link_mass_kg is not declared for every link, so that the torques in which these rows load "
      "the joints are not known: points that load a joint in a direction that no row shows count "
      "as measured, with a radius that is too small if it yields differently there. Declare the "
      "masses");
}

bool InTime(std::string_view column) {
  return column == "t_s" || column == "row";
}

/// RMS displacement by the findings that follow time, among which an event counts unless it is
/// confirmed, since its step then remains. 0 if only a rival or a driver follows time, nullopt if
/// nothing does.
std::optional<double> DriftOf(const Diagnosis& diagnosis) {
  const bool confirmed = CausesConfirmed(diagnosis);
  std::optional<double> drift_m;
  for (const Finding& finding : diagnosis.findings) {
    const effects::EffectTerm& term = finding.effect.term;
    if (effects::FollowsTime(term) || std::ranges::any_of(term.drivers, InTime) ||
        (!confirmed && ActsFromEventTime(term)))
      drift_m = std::hypot(drift_m.value_or(0), finding.tip_rms_m);
  }
  const bool suspected =
      std::ranges::any_of(diagnosis.drivers, InTime) ||
      std::ranges::any_of(diagnosis.rivals, [](const Rival& rival) {
        const effects::Effect* effect = effects::FindEffect(rival.id);
        return InTime(rival.along) ||
               (effect != nullptr && effect->traits().Needs(effects::Signal::kTime, rival.word));
      });
  return drift_m || !suspected ? drift_m : std::optional<double>(0);
}

/// A correction fades with the distance from the measured rows unless its causes are confirmed.
Correction CorrectionOf(const Diagnosis& diagnosis) {
  if (!diagnosis.withheld.empty()) return Correction::kNone;
  return CausesConfirmed(diagnosis) ? Correction::kWritten : Correction::kFading;
}

/// Adds the frames of the declared model, which replace those of the sessions as a correction
/// fades.
void AddDeclaredFrames(const Dataset& data, const Model& declared, Diagnosis& diagnosis) {
  for (std::size_t k = 0; k < diagnosis.sessions.size(); ++k) {
    model::SessionFrames& frames = diagnosis.sessions[k];
    const Model::Frames& of_declared = declared.frames[SessionIndex(static_cast<int>(k))];
    frames.X_WB_declared = of_declared.X_WB;
    for (model::SessionTip& tip : frames.tips) {
      const auto tool = tip.tool ? loads::ToolIndexOf(data.cell, tip.tool) : 0;
      tip.declared_F = of_declared.X_FT[tool.value_or(0)].p;
    }
  }
}

/// Adds the expected residuals of new points, near the measured poses and far from them. Rivals
/// count as errors of the correction, so that one which fades does so sooner.
/// @param accepted  rows that were not rejected
/// @param ranges    of these rows
void AddSpread(const Task& task, const Identified& found, const Model& declared,
               const FitRows& accepted, const InputRanges& ranges, const CorrectedModel& corrected,
               Diagnosis& diagnosis) {
  if (!RadiusCanBeStated(task, corrected.validation, diagnosis)) {
    if (!task.data.instrument_used() && !diagnosis.not_observable.empty())
      diagnosis.notes.emplace_back(
          "the radius of new points is not validated by these rows: all are on artefacts, which "
          "cannot show every error of the tip (not_observable). Measure some positions with an "
          "instrument");
    return;
  }
  const std::optional<double> drift_m = DriftOf(diagnosis);
  auto spread = SpreadOf(corrected.validation, found.fit, CorrectionOf(diagnosis), drift_m);
  if (!spread) return;
  if (task.data.ranges()) {
    spread->near_m = std::hypot(spread->near_m, std::sqrt(VarianceBetweenRivals(diagnosis)));
  }
  const model::CellModel cell = CellOf(task.data, corrected.model, SessionIndex(0));
  const std::vector<model::JointVector> poses = StoredPoses(cell, task.data, accepted);
  const kinematics::PoseDistance from = DistanceFrom(cell, poses);
  const double reach = ReachOf(from, task.data, accepted);
  const RivalSpread rivals =
      SpreadOfRivals(diagnosis.rival_separations, from, reach, task.data.lengths_per_row());
  spread->near_m = std::hypot(spread->near_m, rivals.near_m);
  spread->distant_m = std::hypot(spread->distant_m, rivals.distant_m);
  diagnosis.domain.residual_sigma_m = spread->near_m;
  diagnosis.domain.covariance_share = CovarianceShare(found, corrected.discrepancy_parameters);
  diagnosis.domain.distant_sigma_m = spread->distant_m;
  diagnosis.domain.poses = poses;
  diagnosis.domain.reach_rad = reach;
  ranges.StateIn(diagnosis.domain,
                 InputRanges::Growth{spread->growth_m, spread->deviation_m, drift_m.has_value()});
  if (!spread->declared_m) return;
  diagnosis.domain.declared_sigma_m = spread->declared_m;
  AddDeclaredFrames(task.data, declared, diagnosis);
}

/// Length of the largest residual of the rows that are not outliers.
double LargestResidual(const PerRow<Vec3>& errors, const PerRow<double>& weights) {
  double largest_m = 0;
  for (const RowIndex row : errors.indices()) {
    if (weights[row] >= kOutlierWeight) largest_m = std::max(largest_m, errors[row].norm());
  }
  return largest_m;
}

}  // namespace

void AddDomain(const Task& task, const Identified& found, const FittedModel& declared,
               const FitOfAllRows& fit, const CorrectedModel& corrected, Diagnosis& diagnosis) {
  const FitProblem validated = WithoutMisfit(fit.problem, diagnosis.misfit);
  AddFramesAndDomain(validated, corrected.model, diagnosis);
  AddLoadNote(corrected.model.effects, task.data.weight_known, diagnosis);
  diagnosis.domain.largest_residual_m = LargestResidual(declared.errors, fit.problem.weights);
  FitRows accepted;
  for (const RowIndex row : task.data.row_indices()) {
    if (validated.weights[row] >= kOutlierWeight) accepted.push_back(row);
  }
  InputsOfRows inputs = InputsOf(task.data, corrected.model, validated.weights);
  inputs.units = corrected.units;  // those in which the growths were estimated
  const InputRanges ranges(inputs, accepted);
  ranges.StateIn(diagnosis.domain, std::nullopt);
  AddSpread(task, found, declared.model, accepted, ranges, corrected, diagnosis);
  const std::size_t rejected = diagnosis.outlier_rows.size(), rows = fit.problem.weights.size();
  if (diagnosis.domain.residual_sigma_m &&
      static_cast<double>(rejected) > kOutsideRadius * static_cast<double>(rows)) {
    diagnosis.notes.push_back(
        fmt::format("{} of {} rows are rejected as outliers, more than a 95 % radius may exclude: "
                    "the radius is widened to include them; find out what they have in common",
                    rejected, rows));
  }
  const std::optional<double> cell_zero_s = TimeZeroOf(task.data.cell);
  diagnosis.domain.time_zero_s = cell_zero_s ? cell_zero_s : task.options.time_zero_s;
}

}  // namespace plumbline::measure
