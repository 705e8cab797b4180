#include "app/measure/diagnosis/stated_domain.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "app/measure/diagnosis/covariance_share.h"
#include "app/measure/diagnosis/diagnosis_text.h"
#include "app/measure/diagnosis/farthest_poses.h"
#include "app/measure/diagnosis/joint_combinations.h"
#include "app/measure/diagnosis/joint_loads.h"
#include "app/measure/diagnosis/measured_range.h"
#include "app/measure/diagnosis/outlier_condition.h"
#include "app/measure/diagnosis/residual_spread.h"
#include "app/measure/diagnosis/rival_spread.h"
#include "app/measure/diagnosis/thresholds.h"
#include "firmware-like/effects/catalogue.h"

namespace plumbline::measure {
namespace {

/// The problem in which rows that the model does not fit have no weight.
FitProblem WithoutMisfit(FitProblem problem, const std::optional<Misfit>& misfit) {
  if (!misfit || !misfit->outside_domain) return problem;
  for (const RowIndex row : problem.weights.indices()) {
    if (Meets(misfit->condition, problem.data, row)) problem.weights[row] = 0;
  }
  return problem;
}

/// Joints of rivals that depend on their gravity torque, 0-based.
std::set<int> LoadedJointsOf(const std::vector<Rival>& rivals, int joints) {
  std::set<int> found;
  for (const Rival& rival : rivals) {
    const effects::Effect* effect = effects::FindEffect(rival.id);
    if (effect == nullptr || !effect->traits().Needs(effects::Signal::kTorques, rival.word))
      continue;
    for (int joint = 0; joint < joints; ++joint) {
      const std::string name = fmt::format("q{}", joint + 1);
      if (std::find(rival.scope.begin(), rival.scope.end(), name) != rival.scope.end())
        found.insert(joint);
    }
  }
  return found;
}

/// Adds notes on directions of load that the rows do not show, or that are not known.
void AddLoadNotes(const std::vector<effects::ActiveEffect>& found, bool weight_known,
                  const std::vector<model::JointLoad>& loads, Diagnosis& diagnosis) {
  if (!loads.empty()) {
    std::vector<std::string> joints;
    joints.reserve(loads.size());
    for (const model::JointLoad& load : loads) joints.push_back(fmt::format("q{}", load.joint + 1));
    diagnosis.notes.push_back(fmt::format(
        "too few poses load {} in one of the two directions to show how the joint yields there: "
        "points that load it that way by more than the noise are outside [domain]",
        Listed(joints, "or")));
  }
  const bool unknown_loads =
      !weight_known &&
      std::any_of(found.begin(), found.end(), [](const effects::ActiveEffect& effect) {
        const effects::EffectTraits& traits = effect.term.effect->traits();
        return traits.Needs(effects::Signal::kNoTorques, effect.term.word) ||
               traits.Needs(effects::Signal::kTorques, effect.term.word);
      });
  if (!unknown_loads) return;
  diagnosis.notes.emplace_back(
      "link_mass_kg is not declared for every link, so that the directions in which these rows "
      "load "
      "the joints are not known: points that load a joint in a direction that no row shows count "
      "as "
      "measured, with a radius that is too small if it yields differently there. Declare the "
      "masses");
}

/// A correction fades with the distance from the measured poses unless its causes are confirmed.
Correction CorrectionOf(const Diagnosis& diagnosis) {
  if (!diagnosis.withheld.empty()) return Correction::kNone;
  const bool confirmed = diagnosis.verdict != Verdict::kUnknown && diagnosis.discrepancy.empty();
  return confirmed ? Correction::kWritten : Correction::kFading;
}

/// Adds the frames of the declared model, which replace those of the sessions as a correction
/// fades.
void AddDeclaredFrames(const Dataset& data, const Model& declared, Diagnosis& diagnosis) {
  for (std::size_t k = 0; k < diagnosis.sessions.size(); ++k) {
    model::SessionFrames& frames = diagnosis.sessions[k];
    const Model::Frames& of_declared = declared.frames[SessionIndex(static_cast<int>(k))];
    frames.X_WB_declared = of_declared.X_WB;
    if (data.tip_free()) frames.tip_declared_F = of_declared.tip_F;
  }
}

/// Adds the expected residuals of new points, near the measured poses and far from them. Rivals
/// count as errors of the correction, so that one which fades does so sooner.
void AddSpread(const Task& task, const Identified& found, const Model& declared,
               const PerRow<double>& weights, const CorrectedModel& corrected,
               Diagnosis& diagnosis) {
  auto spread = SpreadOf(corrected.validation, found.fit, CorrectionOf(diagnosis));
  if (!spread) return;
  if (!task.data.instrument_used() && !diagnosis.not_observable.empty()) {
    // Held-out rows on artefacts cannot show errors in directions that no row observes.
    diagnosis.notes.emplace_back(
        "the radius of new points is not validated by these rows: all are on artefacts, which "
        "cannot "
        "show every error of the tip (not_observable). Measure some positions with an instrument");
    return;
  }
  if (task.data.ranges()) {
    spread->near_m = std::hypot(spread->near_m, std::sqrt(VarianceBetweenRivals(diagnosis)));
  }
  FitRows accepted;
  for (const RowIndex row : task.data.row_indices()) {
    if (weights[row] >= kOutlierWeight) accepted.push_back(row);
  }
  const model::CellModel cell = CellOf(task.data, corrected.model, SessionIndex(0));
  const std::vector<model::JointVector> poses = StoredPoses(cell, task.data, accepted);
  const kinematics::PoseDistance from = DistanceFrom(cell, poses);
  const RivalSpread rivals =
      SpreadOfRivals(diagnosis.rival_separations, from, task.data.lengths_per_row());
  spread->near_m = std::hypot(spread->near_m, rivals.near_m);
  spread->distant_m = std::hypot(spread->distant_m, rivals.distant_m);
  diagnosis.domain.residual_sigma_m = spread->near_m;
  diagnosis.domain.covariance_share = CovarianceShare(found, corrected.discrepancy_parameters);
  // Half a turn away, where d is 2, it would add less than 0.5 %.
  constexpr double kNegligible = 0.05;
  if (spread->distant_m < kNegligible * spread->near_m) return;
  diagnosis.domain.distant_sigma_m = spread->distant_m;
  diagnosis.domain.poses = poses;
  if (!spread->declared_m) return;
  diagnosis.domain.declared_sigma_m = spread->declared_m;
  diagnosis.domain.reach_rad = ReachOf(from, task.data, accepted);
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
  diagnosis.domain.joint_loads = JointLoadsOf(
      validated, corrected.model, LoadedJointsOf(diagnosis.rivals, task.data.cell.robot.size()));
  AddLoadNotes(corrected.model.effects, task.data.weight_known, diagnosis.domain.joint_loads,
               diagnosis);
  diagnosis.domain.largest_residual_m = LargestResidual(declared.errors, fit.problem.weights);
  AddSpread(task, found, declared.model, validated.weights, corrected, diagnosis);
  const std::size_t rejected = diagnosis.outlier_rows.size(), rows = fit.problem.weights.size();
  if (diagnosis.domain.residual_sigma_m &&
      static_cast<double>(rejected) > kOutsideRadius * static_cast<double>(rows)) {
    diagnosis.notes.push_back(
        fmt::format("{} of {} rows are rejected as outliers, more than a 95 % radius may exclude: "
                    "the radius is widened to include them; find out what they have in common",
                    rejected, rows));
  }
  if (const auto note = MovedTogetherNote(diagnosis.domain.combinations)) {
    diagnosis.notes.push_back(*note);
  }
  const std::optional<double> cell_zero_s = TimeZeroOf(task.data.cell);
  diagnosis.domain.time_zero_s = cell_zero_s ? cell_zero_s : task.options.time_zero_s;
}

}  // namespace plumbline::measure
