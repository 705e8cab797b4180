#include "app/diagnosis/held_out.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <thread>

#include "app/diagnosis/farthest_poses.h"
#include "app/diagnosis/robust.h"
#include "app/diagnosis/shape_search.h"
#include "app/diagnosis/statistics.h"
#include "app/diagnosis/unknown.h"

namespace plumbline {
namespace {

constexpr std::size_t kLeastTraining = 4;

/// Frames' numbers of each session by least squares of unwhitened residuals of the training rows.
std::vector<Eigen::Matrix<double, 9, 1>> FramesFor(const Dataset& data, const Linearisation& linear,
                                                   const std::vector<int>& rows,
                                                   const std::vector<double>& weights,
                                                   const std::vector<Vec3>& residual) {
  std::vector<Eigen::Matrix<double, 9, 1>> steps(data.sessions.size(),
                                                 Eigen::Matrix<double, 9, 1>::Zero());
  if (!data.frames_free() && !data.tip_free()) return steps;
  std::vector<Eigen::Matrix<double, 9, 9>> H(data.sessions.size(),
                                             Eigen::Matrix<double, 9, 9>::Zero());
  std::vector<Eigen::Matrix<double, 9, 1>> g = steps;
  for (const int k : rows) {
    const auto row = static_cast<std::size_t>(k);
    const auto session = static_cast<std::size_t>(data.session_of[row]);
    Eigen::Matrix<double, 3, 9> J = linear.rows[row].frames;
    if (!data.frames_free()) J.leftCols<6>().setZero();
    if (!data.tip_free()) J.rightCols<3>().setZero();
    H[session] += weights[row] * J.transpose() * J;
    g[session] += weights[row] * J.transpose() * residual[row];
  }
  for (std::size_t session = 0; session < steps.size(); ++session) {
    H[session].diagonal().array() += 1e-10 * H[session].diagonal().maxCoeff() + 1e-15;
    steps[session] = H[session].ldlt().solve(g[session]);
  }
  return steps;
}

/// What each row moves away from the arm without effects, measured: residuals of the model with all
/// of its effects taken out again [m].
std::vector<Vec3> WithoutEffects(const HeldOutInput& input) {
  std::vector<Vec3> y;
  for (int k = 0; k < input.data.rows(); ++k) {
    const auto row = static_cast<std::size_t>(k);
    Influence<double> influence;
    AddEffects(input.model.effects, input.data.conditions[row], influence);
    Vec3 of_row = input.linear->rows[row].residual;
    for (int entry = 0; entry < Influence<double>::kSize; ++entry) {
      if (influence[entry] != 0)
        of_row += influence[entry] * input.linear->gradients[row].col(entry);
    }
    y.push_back(of_row);
  }
  return y;
}

/// Takes the displacement by an explanation's blocks out of residuals; those that a discrepancy
/// model carries itself only where `all`. Empirical curves are read in `held`.
void Subtract(const HeldOutInput& input, const Dataset& held, const Pool& pool,
              const Explanation& explanation, bool all, std::vector<Vec3>& residuals) {
  Eigen::MatrixXd columns;
  const Coefficients coefficients = pool.CoefficientsOf(explanation);
  for (const int block : explanation.blocks) {
    const Block& of = pool.blocks()[static_cast<std::size_t>(block)];
    if (!all && !Stays(of)) continue;
    columns.resize(3, static_cast<int>(of.columns.size()));
    for (int k = 0; k < input.data.rows(); ++k) {
      ColumnsAt(of.empirical() ? held : input.data, *input.linear, of, k, columns);
      for (int c = 0; c < columns.cols(); ++c) {
        const auto value = coefficients.find({block, c});
        if (value == coefficients.end()) continue;
        residuals[static_cast<std::size_t>(k)] -= value->second * columns.col(c);
      }
    }
  }
}

/// The data with each recorded signal held at the range of the training rows, as a written curve
/// holds it. A joint's angle stays: the discrepancy model's curves along it go on (see CurveOf).
Dataset HeldAtRange(const Dataset& data, const std::vector<int>& training, bool of_joints) {
  Dataset held = data;
  for (RecordedSignal& signal : held.signals) {
    if (signal.of_joint && !of_joints) continue;
    double low = 1e300, high = -1e300;
    for (const int k : training) {
      low = std::min(low, signal.values[static_cast<std::size_t>(k)]);
      high = std::max(high, signal.values[static_cast<std::size_t>(k)]);
    }
    for (double& value : signal.values) value = std::clamp(value, low, high);
  }
  return held;
}

/// One fold: its rows, and what was chosen without them.
struct Fold {
  std::vector<int> training, test, framed;  ///< `framed` locate the free frames
  std::vector<SelectedEffect> selected;
  std::vector<Vec3> after, after_named;  ///< of all rows
  std::vector<bool> open;                ///< of all rows: the training rows do not decide
  bool searched = false;
};

Fold FoldOf(const HeldOutInput& input, const FoldPlan& plan, int number) {
  Fold fold;
  for (int k = 0; k < input.data.rows(); ++k) {
    const bool held_out = plan.fold_of[static_cast<std::size_t>(k)] == number;
    (held_out ? fold.test : fold.training).push_back(k);
    if (!held_out || plan.aligned) fold.framed.push_back(k);
  }
  return fold;
}

/// The test rows at which the training rows do not decide whether an effect acts, a step among
/// them.
std::vector<bool> LeftOpen(const Pool& pool, const Explanation& explanation,
                           const std::vector<int>& test, int rows) {
  std::vector<bool> open(static_cast<std::size_t>(rows), false);
  for (const int index : explanation.blocks) {
    const Block& block = pool.blocks()[static_cast<std::size_t>(index)];
    const ShapeSearch* search = ShapeSearchOf(*block.term.effect);
    if (search == nullptr) continue;
    for (const int row : test) {
      if (search->LeavesOpen(pool.problem(), block, row))
        open[static_cast<std::size_t>(row)] = true;
    }
  }
  return open;
}

std::vector<SelectedEffect> SelectedBy(const Pool& pool, const Explanation& explanation) {
  std::map<EffectKey, std::set<int>> joints;
  for (const int column : explanation.columns) {
    const int index = pool.BlockOfColumn(column);
    const Block& block = pool.blocks()[static_cast<std::size_t>(index)];
    std::set<int>& of_effect = joints[KeyOf(block)];
    const int joint = pool.JointOfColumn(column);
    if (joint >= 0) of_effect.insert(joint);
  }
  std::vector<SelectedEffect> selected;
  for (auto& [key, of_effect] : joints) selected.push_back({key, std::move(of_effect)});
  return selected;
}

void SearchFold(const HeldOutInput& input, const std::vector<Vec3>& y, Fold& fold) {
  constexpr int kThreads = 1;  // the folds run beside each other
  const LinearProblem problem(input.data, input.linear, input.model, fold.training, input.weights,
                              input.sigma_m, kThreads);
  Pool pool(problem);
  const std::vector<Explanation> ranked =
      Search(pool, input.candidates, input.most_blocks, input.options.interrupted);
  const Explanation best = input.with_unknown ? WithUnknown(pool, ranked) : ranked.front();
  fold.selected = SelectedBy(pool, best);
  const Dataset held = HeldAtRange(input.data, fold.training, true);
  fold.after_named = y;
  Subtract(input, held, pool, best, true, fold.after_named);
  fold.after = fold.after_named;
  fold.open = LeftOpen(pool, best, fold.test, input.data.rows());
  fold.searched = true;
  if (!input.with_discrepancy) return;
  const std::optional<Remainder> rest = RemainderOf(pool, best, input.candidates, {});
  if (!rest) return;
  fold.after = y;
  Subtract(input, held, pool, best, false, fold.after);
  const Dataset by_signals = HeldAtRange(input.data, fold.training, false);
  for (int k = 0; k < input.data.rows(); ++k) {
    fold.after[static_cast<std::size_t>(k)] -= DisplacementBy(*rest, by_signals, *input.linear, k);
  }
}

std::vector<int> Inliers(const HeldOutInput& input, const Fold& fold) {
  std::vector<int> rows;
  std::copy_if(fold.training.begin(), fold.training.end(), std::back_inserter(rows), [&](int row) {
    return input.weights[static_cast<std::size_t>(row)] >= kOutlierWeight;
  });
  return rows;
}

/// Predicts the rows of a fold, where the rows beside it locate their session's frames.
void PredictFold(const HeldOutInput& input, const std::vector<Vec3>& y, const Fold& fold,
                 HeldOut& result) {
  const Dataset& data = input.data;
  const int free_numbers = (data.frames_free() ? 6 : 0) + (data.tip_free() ? 3 : 0);
  std::vector<int> rows_of_session(data.sessions.size(), 0);
  for (const int k : fold.framed) {
    if (input.weights[static_cast<std::size_t>(k)] < kOutlierWeight) continue;
    ++rows_of_session[static_cast<std::size_t>(data.session_of[static_cast<std::size_t>(k)])];
  }
  const auto frames = [&](const std::vector<Vec3>& residuals) {
    return FramesFor(data, *input.linear, fold.framed, input.weights, residuals);
  };
  const PoseDistance distance = DistanceFrom(data.cell, KeptPoses(data, Inliers(input, fold)));
  const auto before = frames(y), after = frames(fold.after), named = frames(fold.after_named);
  for (const int k : fold.test) {
    const auto row = static_cast<std::size_t>(k);
    const auto session = static_cast<std::size_t>(data.session_of[row]);
    if (rows_of_session[session] * data.axes() < free_numbers || fold.open[row]) continue;
    const auto& derivative = input.linear->rows[row].frames;
    result.predicted[row] = true;
    result.distance[row] = distance.Of(data.table.rows[row].q);
    result.before[row] = y[row] - derivative * before[session];
    result.after[row] = fold.after[row] - derivative * after[session];
    result.after_named[row] = fold.after_named[row] - derivative * named[session];
  }
}

}  // namespace

HeldOut HoldOut(const HeldOutInput& input, const FoldPlan& plan) {
  const std::vector<Vec3> y = WithoutEffects(input);
  HeldOut result;
  result.by = plan.by;
  result.fold_of = plan.fold_of;
  result.before = result.after = result.after_named = y;
  result.predicted.assign(y.size(), false);
  result.distance.assign(y.size(), 0);
  result.other_sessions = plan.aligned;
  std::vector<Fold> folds;
  for (int number = 0; number < plan.folds; ++number) folds.push_back(FoldOf(input, plan, number));
  const int threads = std::clamp(input.options.threads, 1, std::max(1, plan.folds));
  const auto search_every = [&](int first) {
    for (int number = first; number < plan.folds; number += threads) {
      Fold& fold = folds[static_cast<std::size_t>(number)];
      if (input.options.interrupted && input.options.interrupted()) return;
      if (fold.test.empty() || fold.training.size() < kLeastTraining) continue;
      SearchFold(input, y, fold);
    }
  };
  std::vector<std::thread> others;
  for (int thread = 1; thread < threads; ++thread) others.emplace_back(search_every, thread);
  search_every(0);
  for (std::thread& other : others) other.join();
  for (const Fold& fold : folds) {
    if (!fold.searched) continue;
    result.selected.push_back(fold.selected);
    PredictFold(input, y, fold, result);
  }
  return result;
}

std::optional<HeldOutError> ErrorOf(const Dataset& data, const HeldOut& held_out,
                                    const std::vector<double>& weights, int resamples) {
  struct Sum {
    double before = 0, after = 0, count = 0;
  };
  std::vector<Sum> clusters(static_cast<std::size_t>(data.clusters));
  Sum total;
  for (int k = 0; k < data.rows(); ++k) {
    const auto row = static_cast<std::size_t>(k);
    if (!held_out.predicted[row] || weights[row] < kOutlierWeight) continue;
    Sum& of = clusters[static_cast<std::size_t>(data.cluster_of[row])];
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
      const Sum& of = clusters[static_cast<std::size_t>(random.Below(data.clusters))];
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

}  // namespace plumbline
