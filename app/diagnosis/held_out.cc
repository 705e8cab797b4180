#include "app/diagnosis/held_out.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <thread>

#include "app/diagnosis/farthest_poses.h"
#include "app/diagnosis/robust.h"
#include "app/diagnosis/shape_refit.h"
#include "app/diagnosis/shape_search.h"
#include "app/diagnosis/statistics.h"
#include "app/diagnosis/unknown.h"
#include "app/diagnosis/whitener.h"

namespace plumbline::diagnosis {
namespace {

constexpr std::size_t kMinTrainingRows = 4;

/// Least squares step of each session's free frames that fits the residuals of the problem's rows.
Indexed<SessionIndex, Eigen::Matrix<double, 9, 1>> FrameSteps(const FitProblem& problem,
                                                              const Linearisation& linear,
                                                              const PerRow<RowResidual>& residual) {
  const Dataset& data = problem.data;
  Indexed<SessionIndex, Eigen::Matrix<double, 9, 1>> steps(data.sessions.size(),
                                                           Eigen::Matrix<double, 9, 1>::Zero());
  if (!data.frames_free() && !data.tip_free()) return steps;
  Indexed<SessionIndex, Eigen::Matrix<double, 9, 9>> H(data.sessions.size(),
                                                       Eigen::Matrix<double, 9, 9>::Zero());
  Indexed<SessionIndex, Eigen::Matrix<double, 9, 1>> g = steps;
  for (const RowIndex row : problem.rows) {
    const SessionIndex session = data.session_of[row];
    const double weight = problem.weights[row];
    const RowWhitening whitening(data.numbers[row], 1);
    FrameGradient J(linear.rows[row].frames.rows(), 9);
    RowResidual r(J.rows());
    whitening.Apply(linear.rows[row].frames, J);
    whitening.Apply(residual[row], r);
    if (!data.frames_free()) J.leftCols<6>().setZero();
    if (!data.tip_free()) J.rightCols<3>().setZero();
    H[session] += weight * J.transpose() * J;
    g[session] += weight * J.transpose() * r;
  }
  for (const SessionIndex session : steps.indices()) {
    H[session].diagonal().array() += 1e-10 * H[session].diagonal().maxCoeff() + 1e-15;
    steps[session] = H[session].ldlt().solve(g[session]);
  }
  return steps;
}

/// Residuals of the model without its effects, to first order [m]: the measured displacement from
/// the arm without effects.
PerRow<RowResidual> ResidualsWithoutEffects(const HeldOutInput& input) {
  PerRow<RowResidual> y;
  for (const RowIndex row : input.problem.data.row_indices()) {
    effects::Influence<double> influence;
    effects::AddEffects(input.model.effects, input.problem.data.conditions[row], influence);
    RowResidual of_row = input.linear->rows[row].residual;
    for (int entry = 0; entry < effects::Influence<double>::kSize; ++entry) {
      if (influence[entry] != 0)
        of_row += influence[entry] * input.linear->gradients[row].col(entry);
    }
    y.push_back(of_row);
  }
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
    const Block& of = candidate_set.blocks()[block];
    if (!all && !IsExemptFromShrinkage(of)) continue;
    for (const RowIndex row : data.row_indices()) {
      columns.resize(residuals[row].size(), of.columns.count());
      ColumnsAt(of.empirical() ? clamped : data, *input.linear, of, row, columns);
      for (const BlockColumnIndex c : of.columns.indices()) {
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

/// Predicts the rows of a fold whose session's frames are determined by the `framed` rows.
void PredictFold(const HeldOutInput& input, const PerRow<RowResidual>& y, const Fold& fold,
                 HeldOut& result) {
  const Dataset& data = input.problem.data;
  const int free_numbers = (data.frames_free() ? 6 : 0) + (data.tip_free() ? 3 : 0);
  const bool on_own_rows = result.other_sessions && free_numbers > 0;
  Indexed<SessionIndex, int> numbers_of_session(data.sessions.size(), 0);
  for (const RowIndex row : fold.framed) {
    if (input.problem.weights[row] < kOutlierWeight) continue;
    numbers_of_session[data.session_of[row]] += data.numbers[row].count;
  }
  const FitProblem framed = input.problem.WithRows(fold.framed);
  const auto frames = [&](const PerRow<RowResidual>& residuals) {
    return FrameSteps(framed, *input.linear, residuals);
  };
  const model::CellModel cell = CellOf(data, input.model, SessionIndex(0));
  const FitRows inliers = Inliers(input, fold);
  const kinematics::PoseDistance distance = DistanceFrom(cell, StoredPoses(cell, data, inliers));
  const double reach = ReachOf(distance, data, inliers);
  const auto before = frames(y), after = frames(fold.after), named = frames(fold.after_named);
  for (const RowIndex row : fold.test) {
    const SessionIndex session = data.session_of[row];
    const int numbers = numbers_of_session[session];
    if (numbers < free_numbers || (on_own_rows && numbers == free_numbers)) continue;
    if (fold.undetermined[row] || data.numbers[row].count == 0) continue;
    // Frames fitted to the test rows themselves absorb part of their errors.
    const double share_left =
        on_own_rows ? 1 - static_cast<double>(free_numbers) / static_cast<double>(numbers) : 1;
    const double scale = 1 / std::sqrt(share_left);
    const FrameGradient& derivative = input.linear->rows[row].frames;
    result.predicted[row] = true;
    result.distance[row] = distance.Of(data.measured(row).q);
    result.reach[row] = reach;
    result.before[row] = scale * LengthsOf(y[row] - derivative * before[session]);
    result.after[row] = scale * LengthsOf(fold.after[row] - derivative * after[session]);
    result.after_named[row] =
        scale * LengthsOf(fold.after_named[row] - derivative * named[session]);
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
  result.other_sessions = plan.aligned;
  std::vector<Fold> folds;
  for (int number = 0; number < plan.folds; ++number) folds.push_back(FoldOf(input, plan, number));
  const int threads = std::clamp(input.options.threads, 1, std::max(1, plan.folds));
  const auto search_folds = [&](int first) {
    for (int number = first; number < plan.folds; number += threads) {
      Fold& fold = folds[static_cast<std::size_t>(number)];
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
    PredictFold(input, y, fold, result);
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
    Sum& of = clusters[data.cluster_of[row]];
    for (Sum* sum : {&of, &total}) {
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
      const Sum& of = clusters[ClusterIndex(random.Below(data.clusters))];
      square += of.after;
      count += of.count;
    }
    if (count > 0) values.push_back(std::sqrt(square / count));
  }
  std::sort(values.begin(), values.end());
  if (!values.empty()) {
    error.after_low_m =
        values[static_cast<std::size_t>(0.025 * static_cast<double>(values.size()))];
    error.after_high_m =
        values[static_cast<std::size_t>(0.975 * static_cast<double>(values.size() - 1))];
  }
  return error;
}

}  // namespace plumbline::diagnosis
