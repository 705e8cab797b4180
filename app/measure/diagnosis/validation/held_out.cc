#include "app/measure/diagnosis/validation/held_out.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <thread>

#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/linear/fit_problem.h"
#include "app/measure/diagnosis/linear/nuisances.h"
#include "app/measure/diagnosis/linear/robust.h"
#include "app/measure/diagnosis/linear/shape_search.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/diagnosis/search/unknown.h"
#include "app/measure/diagnosis/validation/farthest_poses.h"

namespace plumbline::measure {
namespace {

std::vector<HeldOutError> ErrorsOfSchemes(const HeldOutInput& input,
                                          const std::vector<HeldOut>& schemes) {
  std::vector<HeldOutError> errors;
  for (const HeldOut& scheme : schemes) {
    const auto error = ErrorOf(input.problem, scheme, input.options.bootstrap);
    if (error) errors.push_back(*error);
  }
  return errors;
}

/// Sums of squared errors of the predicted rows, with and without the discrepancy model.
std::pair<double, double> SquaresOf(const HeldOut& scheme, const PerRow<double>& weights) {
  double with = 0, without = 0;
  for (const RowIndex row : scheme.after.indices()) {
    if (!scheme.predicted[row] || weights[row] < kOutlierWeight) continue;
    with += scheme.after[row].squaredNorm();
    without += scheme.after_named[row].squaredNorm();
  }
  return {with, without};
}

}  // namespace

Validation Validate(const HeldOutInput& input, bool with_halves) {
  const Dataset& data = input.problem.data;
  const std::vector<FoldPlan> plans = {BlocksOfTime(data), RegionsOfJointSpace(data),
                                       Sessions(data), Places(data)};
  const FoldPlan halves = with_halves ? OppositeHalves(data) : FoldPlan{};
  double all_folds = halves.folds, done_folds = 0;
  for (const FoldPlan& plan : plans) all_folds += plan.folds;
  const auto hold_out = [&](const FoldPlan& plan) {
    HeldOutInput part = input;
    part.progress = [&](double share) {
      if (input.progress) input.progress((done_folds + share * plan.folds) / all_folds);
    };
    HeldOut held_out = HoldOut(part, plan);
    done_folds += plan.folds;
    return held_out;
  };
  Validation validation;
  for (const FoldPlan& plan : plans) {
    if (plan.folds > 0) validation.schemes.push_back(hold_out(plan));
  }
  validation.errors = ErrorsOfSchemes(input, validation.schemes);
  if (halves.folds > 0) validation.halves = hold_out(halves);
  return validation;
}

double BestShare(const HeldOut& scheme, const PerRow<double>& weights) {
  double along = 0, square = 0;
  for (const RowIndex row : scheme.predicted.indices()) {
    if (!scheme.predicted[row] || weights[row] < kOutlierWeight) continue;
    const Vec3 moved = scheme.before[row] - scheme.after[row];
    along += scheme.before[row].dot(moved);
    square += moved.squaredNorm();
  }
  return square > 0 ? std::clamp(along / square, 0.0, 1.0) : 1;
}

void AddError(double added_error_m, Validation& validation) {
  validation.added_error_m = std::hypot(validation.added_error_m, added_error_m);
  for (HeldOutError& error : validation.errors) {
    for (double* rms_m : {&error.after_m, &error.after_low_m, &error.after_high_m}) {
      *rms_m = std::hypot(*rms_m, added_error_m);
    }
  }
}

bool AdmitsDiscrepancy(const Validation& validation, const PerRow<double>& weights) {
  const auto lowers = [&](const HeldOut& scheme) {
    const auto [with, without] = SquaresOf(scheme, weights);
    return with < without;
  };
  bool any_beyond = false;  // regions or sessions were predicted
  for (std::size_t scheme = 1; scheme < validation.schemes.size(); ++scheme) {
    const PerRow<bool>& predicted = validation.schemes[scheme].predicted;
    if (std::ranges::find(predicted, true) == predicted.end()) continue;
    if (!lowers(validation.schemes[scheme])) return false;
    any_beyond = true;
  }
  return any_beyond || (!validation.schemes.empty() && lowers(validation.schemes.front()));
}

Validation WithoutDiscrepancy(const HeldOutInput& input, Validation validation) {
  for (HeldOut& scheme : validation.schemes) scheme.after = scheme.after_named;
  if (validation.halves) validation.halves->after = validation.halves->after_named;
  validation.errors = ErrorsOfSchemes(input, validation.schemes);
  return validation;
}

std::string ReasonToWithhold(const Validation& validation, bool empirical) {
  if (validation.errors.empty()) {
    return "too few rows to hold any out: the correction cannot be validated, and none is written; "
           "measure more poses, spread over the cell";
  }
  const auto between_rows = [&](const HeldOutError& error) {
    return error.by == validation.schemes.front().by;
  };
  const bool any_between = std::ranges::any_of(validation.errors, between_rows);
  for (const HeldOutError& error : validation.errors) {
    if (!empirical && any_between && !between_rows(error)) continue;
    if (error.after_m <= error.before_m) continue;
    return fmt::format(
        "held out by {}, the corrected model has an error of {} mm, the declared model {} mm: no "
        "correction is written; find the cause first",
        error.by, MillimetreText(error.after_m), MillimetreText(error.before_m));
  }
  return {};
}

namespace {

constexpr std::size_t kMinTrainingRows = 4;

/// Least squares step of the nuisances that fits the residuals of the problem's rows.
Eigen::VectorXd NuisanceStepOf(const FitProblem& problem, const Linearisation& linear,
                               const Model& model, const PerRow<RowResidual>& residual) {
  const Dataset& data = problem.data;
  const Nuisances nuisances(data);
  NuisanceEquations equations(nuisances);
  if (nuisances.size() == 0) return equations.g;
  for (const RowIndex row : problem.rows) {
    equations.Add(data, nuisances, linear.rows[row], row, problem.weights[row], residual[row]);
  }
  equations.Add(nuisances.EquationsAt(model), problem.sigma_m * problem.sigma_m);
  Eigen::MatrixXd& H = equations.H;
  H.diagonal().array() += 1e-10 * H.diagonal().maxCoeff() + 1e-15;
  return H.ldlt().solve(equations.g);
}

/// Residuals of the model without its effects, to first order [m]: the measured displacement from
/// the arm without effects.
PerRow<RowResidual> ResidualsWithoutEffects(const HeldOutInput& input) {
  PerRow<RowResidual> y;
  const Dataset& data = input.problem.data;
  for (const RowIndex row : data.row_indices())
    y.push_back(input.linear->rows[row].residual +
                DisplacementBy(input.model.effects, data, *input.linear, row));
  return y;
}

/// Subtracts the displacement by the blocks of an explanation from the residuals; without `all`,
/// only that by blocks that a discrepancy model does not contain. Empirical curves are evaluated at
/// the signals of `clamped`.
void SubtractEffects(const HeldOutInput& input, const Dataset& clamped,
                     const CandidateSet& candidate_set, const Explanation& explanation, bool all,
                     PerRow<RowResidual>& residuals) {
  const Dataset& data = input.problem.data;
  Eigen::MatrixXd columns;
  const Coefficients coefficients = candidate_set.CoefficientsOf(explanation);
  for (const BlockIndex block : explanation.blocks) {
    const Block& own = candidate_set.blocks()[block];
    if (!all && !IsExemptFromShrinkage(own)) continue;
    for (const RowIndex row : data.row_indices()) {
      columns.resize(residuals[row].size(), own.columns.count());
      ColumnsAt(own.empirical() ? clamped : data, *input.linear, own, row, columns);
      for (const BlockColumnIndex c : own.columns.indices()) {
        const auto value = coefficients.find({block, c});
        if (value == coefficients.end()) continue;
        residuals[row] -= value->second * columns.col(c.value());
      }
    }
  }
}

/// The data with each recorded signal clamped to the range of the training rows, like the curves of
/// a written model. Joint angles are clamped only if `of_joints`: the discrepancy model's curves
/// along them extend beyond the rows (see CurveOf).
Dataset ClampedToRange(const Dataset& data, const FitRows& training, bool of_joints) {
  Dataset clamped = data;
  for (RecordedSignal& signal : clamped.signals) {
    if (signal.of_joint && !of_joints) continue;
    double low = 1e300, high = -1e300;
    for (const RowIndex row : training) {
      low = std::min(low, signal.values[row]);
      high = std::max(high, signal.values[row]);
    }
    for (double& value : signal.values) value = std::clamp(value, low, high);
  }
  return clamped;
}

/// A fold: its rows, and the result of the search without them.
struct Fold {
  FitRows training, framed;  ///< `framed`: rows that determine the free frames
  std::vector<RowIndex> test;
  std::vector<SelectedEffect> selected;
  PerRow<RowResidual> after, after_named;
  PerRow<bool>
      undetermined;  ///< rows at which the training rows do not determine whether an effect acts
  bool searched = false;
};

Fold FoldOf(const HeldOutInput& input, const FoldPlan& plan, int number) {
  Fold fold;
  for (const RowIndex row : input.problem.data.row_indices()) {
    const bool held_out = plan.fold_of[row] == number;
    if (held_out) fold.test.push_back(row);
    if (!held_out) fold.training.push_back(row);
    if (!held_out || plan.aligned) fold.framed.push_back(row);
  }
  return fold;
}

/// The test rows at which the training rows do not determine whether an effect acts, such as rows
/// next to a step.
PerRow<bool> UndeterminedRows(const CandidateSet& candidate_set, const Explanation& explanation,
                              const std::vector<RowIndex>& test) {
  PerRow<bool> undetermined(candidate_set.problem().data().table.rows.size(), false);
  for (const BlockIndex index : explanation.blocks) {
    const Block& block = candidate_set.blocks()[index];
    const ShapeSearch* search = ShapeSearchOf(*block.term.effect);
    if (search == nullptr) continue;
    for (const RowIndex row : test) {
      if (search->LeavesUndetermined(candidate_set.problem(), block, row)) undetermined[row] = true;
    }
  }
  return undetermined;
}

}  // namespace

std::vector<SelectedEffect> SelectedEffects(const CandidateSet& candidate_set,
                                            const Explanation& explanation) {
  std::map<EffectKey, std::set<int>> joints;
  for (const ColumnIndex column : explanation.columns) {
    const Block& block = candidate_set.blocks()[candidate_set.BlockOfColumn(column)];
    std::set<int>& of_effect = joints[KeyOf(block)];
    const int joint = candidate_set.JointOfColumn(column);
    if (joint >= 0) of_effect.insert(joint);
  }
  std::vector<SelectedEffect> selected;
  for (auto& [key, of_effect] : joints) selected.push_back({key, std::move(of_effect)});
  return selected;
}

namespace {

void SearchFold(const HeldOutInput& input, const PerRow<RowResidual>& y, Fold& fold) {
  FitProblem training = input.problem.WithRows(fold.training);
  training.threads = 1;  // the folds run in parallel
  const LinearProblem problem(std::move(training), input.linear, input.model);
  CandidateSet candidate_set(problem);
  const std::vector<Explanation> ranked =
      Search(candidate_set, input.candidates, input.most_blocks, input.options.interrupted);
  const Explanation best = WithRefittedShapes(
      candidate_set, input.with_unknown ? WithUnknown(candidate_set, ranked) : ranked.front());
  fold.selected = SelectedEffects(candidate_set, best);
  const Dataset clamped = ClampedToRange(input.problem.data, fold.training, true);
  fold.after_named = y;
  SubtractEffects(input, clamped, candidate_set, best, true, fold.after_named);
  fold.after = fold.after_named;
  fold.undetermined = UndeterminedRows(candidate_set, best, fold.test);
  fold.searched = true;
  if (!input.with_discrepancy) return;
  const std::optional<DiscrepancyModel> discrepancy =
      DiscrepancyModelOf(candidate_set, best, input.candidates);
  if (!discrepancy) return;
  fold.after = y;
  SubtractEffects(input, clamped, candidate_set, best, false, fold.after);
  const Dataset by_signals = ClampedToRange(input.problem.data, fold.training, false);
  for (const RowIndex row : fold.after.indices()) {
    fold.after[row] -= DisplacementBy(*discrepancy, by_signals, *input.linear, row);
  }
}

FitRows Inliers(const HeldOutInput& input, const Fold& fold) {
  FitRows rows;
  for (const RowIndex row : fold.training) {
    if (input.problem.weights[row] >= kOutlierWeight) rows.push_back(row);
  }
  return rows;
}

/// Number of residuals of the inliers that determine the frames of each session, the tip of each
/// tool there and each group of the other nuisances.
struct Determining {
  Determining(const HeldOutInput& input, const Nuisances& nuisances, const FitRows& rows)
      : of_session(input.problem.data.sessions.size(), 0),
        of_group(static_cast<std::size_t>(nuisances.groups()), 0),
        frames_(nuisances.frames()),
        tip_(nuisances.tip()) {
    for (const RowIndex row : rows) {
      if (input.problem.weights[row] < kOutlierWeight) continue;
      const int count = input.problem.data.numbers[row].count;
      const SessionIndex session = input.problem.data.session_of[row];
      of_session[session] += count;
      if (count > 0) of_tip_[{session, input.problem.data.payloads[row].tool}] += count;
      if (const auto group = nuisances.GroupOf(row)) of_group[*group] += count;
    }
  }

  /// Whether the rows determine the frames that a row of this tool depends on.
  bool FramesOf(SessionIndex session, int tool) const {
    int tips = 0;
    for (const auto& [session_and_tool, count] : of_tip_)
      tips += session_and_tool.first == session ? 1 : 0;
    const int free = (frames_ ? 6 : 0) + (tip_ ? 3 * tips : 0);
    return of_session[session] >= free && (!tip_ || OfTip(session, tool) >= 3);
  }
  /// The share of a row's variance that its own frames, fitted to these rows, absorb on average:
  /// the base shared with the session, the tip with the rows of its tool.
  double ShareOfFrames(SessionIndex session, int tool) const {
    return (frames_ ? 6.0 / of_session[session] : 0) + (tip_ ? 3.0 / OfTip(session, tool) : 0);
  }

  Indexed<SessionIndex, int> of_session;
  Indexed<GroupIndex, int> of_group;

 private:
  int OfTip(SessionIndex session, int tool) const {
    const auto found = of_tip_.find({session, tool});
    return found == of_tip_.end() ? 0 : found->second;
  }

  bool frames_, tip_;
  std::map<std::pair<SessionIndex, int>, int> of_tip_;  ///< residuals by session and tool
};

/// Places that were held out as a whole are fitted to their own rows and to what is declared of
/// them, with all else from the other folds: `step` receives their part. Places at known distances
/// are fitted together; FoldPlan holds them out together.
void FitHeldOutPlaces(const HeldOutInput& input, const Fold& fold,
                      const PerRow<RowResidual>& residual, Eigen::VectorXd& step) {
  const Dataset& data = input.problem.data;
  const Nuisances nuisances(data);
  std::set<ComponentIndex> components;
  for (const RowIndex row : fold.test) {
    if (const auto group = nuisances.GroupOf(row)) components.insert(nuisances.ComponentOf(*group));
  }
  std::vector<int> free;
  NuisanceEquations equations(nuisances);
  for (const ComponentIndex component : components) {
    for (const GroupIndex group : nuisances.GroupsOf(component)) {
      for (int k = 0; k < nuisances.CountOf(group); ++k)
        free.push_back(nuisances.FirstOf(group) + k);
    }
    equations.Add(nuisances.EquationsAt(input.model, component),
                  input.problem.sigma_m * input.problem.sigma_m);
  }
  for (const int k : free) step[k] = 0;
  for (const RowIndex row : fold.test) {
    const LinearRow& at = input.linear->rows[row];
    const RowResidual left = residual[row] - nuisances.Change(at, row, step);
    equations.Add(data, nuisances, at, row, input.problem.weights[row], left);
  }
  if (free.empty()) return;
  Eigen::MatrixXd H = equations.H(free, free);
  H.diagonal().array() += 1e-10 * H.diagonal().maxCoeff() + 1e-15;
  const Eigen::VectorXd solution = H.ldlt().solve(Eigen::VectorXd(equations.g(free)));
  step(free) = solution;
}

/// The share of the variance of a row's error that is left after the nuisances were fitted to the
/// test rows themselves; nullopt if the rows do not determine them.
std::optional<double> ShareLeft(const Nuisances& nuisances, const Determining& framed,
                                const Determining& tested, bool sessions, bool places,
                                SessionIndex session, int tool, RowIndex row) {
  const auto left = [](int free, int numbers) -> std::optional<double> {
    if (free > 0 && numbers <= free) return std::nullopt;
    return free > 0 ? 1 - static_cast<double>(free) / numbers : 1.0;
  };
  if (!framed.FramesOf(session, tool)) return std::nullopt;
  if (sessions) {
    const double left_by_frames = 1 - framed.ShareOfFrames(session, tool);
    return left_by_frames > 0 ? std::optional(left_by_frames) : std::nullopt;
  }
  const auto group = nuisances.GroupOf(row);
  if (!group) return 1.0;
  if (places) return left(nuisances.CountOf(*group), tested.of_group[*group]);
  return framed.of_group[*group] >= nuisances.CountOf(*group) ? std::optional(1.0) : std::nullopt;
}

/// Predicts the rows of a fold whose session's frames are determined by the `framed` rows.
void PredictFold(const HeldOutInput& input, const PerRow<RowResidual>& y, const FoldPlan& plan,
                 const Fold& fold, HeldOut& result) {
  const Dataset& data = input.problem.data;
  const Nuisances nuisances(data);
  const FitRows test(std::vector<RowIndex>(fold.test.begin(), fold.test.end()));
  const Determining by_framed(input, nuisances, fold.framed), by_test(input, nuisances, test);
  const FitProblem framed = input.problem.WithRows(fold.framed);
  const auto steps = [&](const PerRow<RowResidual>& residuals) {
    Eigen::VectorXd step = NuisanceStepOf(framed, *input.linear, input.model, residuals);
    if (plan.places) FitHeldOutPlaces(input, fold, residuals, step);
    return step;
  };
  const model::CellModel cell = CellOf(data, input.model, SessionIndex(0));
  const FitRows inliers = Inliers(input, fold);
  const InputRanges ranges(input.inputs, inliers);
  const kinematics::PoseDistance distance = DistanceFrom(cell, StoredPoses(cell, data, inliers));
  const double reach = ReachOf(distance, data, inliers);
  const Eigen::VectorXd before = steps(y), after = steps(fold.after),
                        named = steps(fold.after_named);
  for (const RowIndex row : fold.test) {
    const auto share_left =
        ShareLeft(nuisances, by_framed, by_test, result.other_sessions, plan.places,
                  data.session_of[row], data.payloads[row].tool, row);
    if (!share_left || fold.undetermined[row] || data.numbers[row].count == 0) continue;
    // Nuisances fitted to the test rows themselves absorb part of their errors.
    const double scale = 1 / std::sqrt(*share_left);
    const LinearRow& at = input.linear->rows[row];
    const auto error = [&](const RowResidual& residual, const Eigen::VectorXd& step) -> Vec3 {
      return scale * LengthsOf(RowResidual(residual - nuisances.Change(at, row, step)));
    };
    result.predicted[row] = true;
    result.distance[row] = distance.Of(data.measured(row).q);
    result.reach[row] = reach;
    result.beyond[row] = ranges.Beyond(input.inputs.rows[row]);
    result.before[row] = error(y[row], before);
    result.after[row] = error(fold.after[row], after);
    result.after_named[row] = error(fold.after_named[row], named);
  }
}

}  // namespace

HeldOut HoldOut(const HeldOutInput& input, const FoldPlan& plan) {
  const PerRow<RowResidual> y = ResidualsWithoutEffects(input);
  HeldOut result;
  result.by = plan.by;
  result.fold_of = plan.fold_of;
  for (const RowResidual& of_row : y) result.before.push_back(LengthsOf(of_row));
  result.after = result.after_named = result.before;
  result.predicted.assign(y.size(), false);
  result.distance.assign(y.size(), 0);
  result.reach.assign(y.size(), 0);
  result.beyond.assign(y.size(), BeyondRanges::Zero());
  result.other_sessions = plan.aligned;
  std::vector<Fold> folds;
  for (int number = 0; number < plan.folds; ++number) folds.push_back(FoldOf(input, plan, number));
  const int threads = std::clamp(input.options.threads, 1, std::max(1, plan.folds));
  const auto search_folds = [&](int first) {
    for (int number = first; number < plan.folds; number += threads) {
      Fold& fold = folds[number];
      if (input.options.interrupted && input.options.interrupted()) return;
      if (first == 0 && input.progress) input.progress(static_cast<double>(number) / plan.folds);
      if (fold.test.empty() || fold.training.size() < kMinTrainingRows) continue;
      SearchFold(input, y, fold);
    }
  };
  std::vector<std::thread> others;
  for (int thread = 1; thread < threads; ++thread) others.emplace_back(search_folds, thread);
  search_folds(0);
  for (std::thread& other : others) other.join();
  for (const Fold& fold : folds) {
    if (!fold.searched) continue;
    result.selected.push_back(fold.selected);
    PredictFold(input, y, plan, fold, result);
  }
  return result;
}

std::optional<HeldOutError> ErrorOf(const FitProblem& problem, const HeldOut& held_out,
                                    int resamples) {
  const Dataset& data = problem.data;
  struct Sum {
    double before = 0, after = 0, count = 0;
  };
  Indexed<ClusterIndex, Sum> clusters(static_cast<std::size_t>(data.clusters));
  Sum total;
  for (const RowIndex row : data.row_indices()) {
    if (!held_out.predicted[row] || problem.weights[row] < kOutlierWeight) continue;
    Sum& cluster = clusters[data.cluster_of[row]];
    for (Sum* sum : {&cluster, &total}) {
      sum->before += held_out.before[row].squaredNorm();
      sum->after += held_out.after[row].squaredNorm();
      sum->count += 1;
    }
  }
  if (total.count == 0) return std::nullopt;
  HeldOutError error;
  error.by = held_out.by;
  error.before_m = std::sqrt(total.before / total.count);
  error.after_m = std::sqrt(total.after / total.count);
  Random random(77);
  std::vector<double> values;
  for (int resample = 0; resample < resamples; ++resample) {
    double square = 0, count = 0;
    for (int draw = 0; draw < data.clusters; ++draw) {
      const Sum& cluster = clusters[ClusterIndex(random.Below(data.clusters))];
      square += cluster.after;
      count += cluster.count;
    }
    if (count > 0) values.push_back(std::sqrt(square / count));
  }
  std::ranges::sort(values);
  if (!values.empty()) {
    error.after_low_m =
        values[static_cast<std::size_t>(0.025 * static_cast<double>(values.size()))];
    error.after_high_m =
        values[static_cast<std::size_t>(0.975 * static_cast<double>(values.size() - 1))];
  }
  return error;
}

}  // namespace plumbline::measure
