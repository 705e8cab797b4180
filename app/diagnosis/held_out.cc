#include "app/diagnosis/held_out.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>

#include "app/diagnosis/robust.h"
#include "app/diagnosis/statistics.h"
#include "app/diagnosis/unknown.h"

namespace plumbline {
namespace {

constexpr int kFolds = 5;
constexpr int kBlocksPerFold = 4;

std::vector<int> FoldsOf(const Dataset& data) {
  const int count = data.rows();
  const int blocks = std::min(count, kFolds * kBlocksPerFold);
  std::map<int, int> of_cluster;
  std::vector<int> folds;
  for (int k = 0; k < count; ++k) {
    const int block = static_cast<int>(std::int64_t{k} * blocks / count);
    const auto [fold, fresh] =
        of_cluster.emplace(data.cluster_of[static_cast<std::size_t>(k)], block % kFolds);
    folds.push_back(fold->second);
  }
  return folds;
}

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

}  // namespace

HeldOut HoldOut(const Dataset& data, const std::shared_ptr<const Linearisation>& at,
                const Model& model, const Candidates& candidates,
                const std::vector<double>& weights, double sigma_m, bool with_unknown,
                std::size_t most_blocks, const Remainder* remainder,
                const DiagnosisOptions& options) {
  const Linearisation& linear = *at;
  HeldOut result;
  result.fold_of = FoldsOf(data);
  // y = residual with all effects taken out of the model again, in metres.
  std::vector<Vec3> y;
  for (int k = 0; k < data.rows(); ++k) {
    const auto row = static_cast<std::size_t>(k);
    Influence<double> influence;
    AddEffects(model.effects, data.conditions[row], influence);
    Vec3 of_row = linear.rows[row].residual;
    for (int entry = 0; entry < Influence<double>::kSize; ++entry) {
      if (influence[entry] != 0) of_row += influence[entry] * linear.rows[row].dp.col(entry);
    }
    y.push_back(of_row);
  }
  result.before = y;
  result.after = y;
  result.predicted.assign(y.size(), false);
  const int free_numbers = (data.frames_free() ? 6 : 0) + (data.tip_free() ? 3 : 0);
  const int folds = std::min(kFolds, data.rows());
  for (int fold = 0; fold < folds; ++fold) {
    if (options.interrupted && options.interrupted()) break;
    std::vector<int> training, test;
    for (int k = 0; k < data.rows(); ++k) {
      (result.fold_of[static_cast<std::size_t>(k)] == fold ? test : training).push_back(k);
    }
    if (test.empty() || training.size() < 4) continue;
    const LinearProblem problem(data, at, model, training, weights, sigma_m, options.threads);
    Pool pool(problem);
    const std::vector<Explanation> ranked =
        Search(pool, candidates, most_blocks, options.interrupted);
    const Explanation best = with_unknown ? WithUnknown(pool, ranked) : ranked.front();
    std::optional<Remainder> rest;
    if (remainder) rest = RemainderOf(pool, best, candidates, remainder->ratio);
    std::vector<Vec3> after = y;
    for (int k = 0; rest && k < data.rows(); ++k) {
      after[static_cast<std::size_t>(k)] -= DisplacementBy(*rest, data, linear, k);
    }
    Eigen::MatrixXd columns;
    const Coefficients coefficients = pool.CoefficientsOf(best);
    for (const int block : best.blocks) {
      const Block& of = pool.blocks()[static_cast<std::size_t>(block)];
      if (rest && !Stays(of)) continue;  // the remainder has it
      columns.resize(3, static_cast<int>(of.columns.size()));
      for (int k = 0; k < data.rows(); ++k) {
        ColumnsAt(data, linear, of, k, columns);
        for (int c = 0; c < columns.cols(); ++c) {
          const auto value = coefficients.find({block, c});
          if (value == coefficients.end()) continue;
          after[static_cast<std::size_t>(k)] -= value->second * columns.col(c);
        }
      }
    }
    std::vector<int> rows_of_session(data.sessions.size(), 0);
    for (const int k : training) {
      if (weights[static_cast<std::size_t>(k)] < kOutlierWeight) continue;
      ++rows_of_session[static_cast<std::size_t>(data.session_of[static_cast<std::size_t>(k)])];
    }
    const auto frames_before = FramesFor(data, linear, training, weights, y);
    const auto frames_after = FramesFor(data, linear, training, weights, after);
    for (const int k : test) {
      const auto row = static_cast<std::size_t>(k);
      const auto session = static_cast<std::size_t>(data.session_of[row]);
      if (rows_of_session[session] * data.axes() < free_numbers) continue;
      result.predicted[row] = true;
      result.before[row] = y[row] - linear.rows[row].frames * frames_before[session];
      result.after[row] = after[row] - linear.rows[row].frames * frames_after[session];
    }
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
