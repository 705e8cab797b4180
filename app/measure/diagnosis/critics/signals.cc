#include "app/measure/diagnosis/critics/signals.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <map>

#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/linear/empirical_columns.h"
#include "app/measure/diagnosis/linear/linear_problem.h"
#include "app/measure/diagnosis/linear/robust.h"
#include "app/measure/diagnosis/shapes/periodic_search.h"

namespace plumbline::measure {
namespace {

/// Tests for each recorded signal whether a residual follows it through any carrier: the explained
/// share of chi2, and its p-value by a permutation test that flips the signs of whole clusters and
/// takes the maximum over all signals (family-wise).
/// @param residual  whitened and projected
/// @param flips     number of permutations
std::vector<SignalTrace> TestSignals(const LinearProblem& problem, const Eigen::VectorXd& residual,
                                     int flips) {
  const Dataset& data = problem.data();
  const auto carriers = Carriers(data);
  // One orthonormal basis per signal and carrier, spanning its linear and quadratic columns.
  const auto indices = problem.rows().indices();
  const std::vector<FitRowIndex> all(indices.begin(), indices.end());
  Indexed<SignalIndex, std::vector<Eigen::MatrixXd>> bases(data.signals.size());
  for (const SignalIndex s : data.signals.indices()) {
    const std::vector<int> degrees = Degrees(data.signals[s], 3);
    if (degrees.empty()) continue;
    const int degree = degrees[std::min<std::size_t>(degrees.size() - 1, 2)];
    for (const std::vector<int>& carrier : carriers) {
      if (!MayFollow(carrier, data.signals[s])) continue;
      Eigen::MatrixXd columns =
          problem.Carried(carrier, Polynomials(problem, all, s, degree).rightCols(degree));
      problem.Project(columns);
      Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(columns);
      qr.setThreshold(1e-6);
      bases[s].push_back(qr.householderQ() * Eigen::MatrixXd::Identity(columns.rows(), qr.rank()));
    }
  }
  // The gain of a basis, standardised by its mean and standard deviation under noise.
  const auto statistic = [](const Eigen::MatrixXd& basis, const Eigen::VectorXd& r) {
    if (basis.cols() == 0) return 0.0;
    const double rank = static_cast<double>(basis.cols());
    return ((basis.transpose() * r).squaredNorm() - rank) / std::sqrt(2 * rank);
  };
  Indexed<SignalIndex, double> observed(data.signals.size(), 0.0), shares = observed;
  const double total = std::max(1e-12, residual.squaredNorm());
  for (const SignalIndex s : bases.indices()) {
    for (const Eigen::MatrixXd& basis : bases[s]) {
      observed[s] = std::max(observed[s], statistic(basis, residual));
      shares[s] = std::max(shares[s], (basis.transpose() * residual).squaredNorm() / total);
    }
  }
  Indexed<SignalIndex, int> beaten(data.signals.size(), 0);
  Random random(20240607);
  for (int flip = 0; flip < flips; ++flip) {
    std::map<ClusterIndex, double> signs;
    Eigen::VectorXd flipped = residual;
    for (const FitRowIndex j : problem.rows().indices()) {
      const ClusterIndex cluster = data.cluster_of[problem.rows()[j]];
      const auto [sign, inserted] = signs.emplace(cluster, 0.0);
      if (inserted) sign->second = random.Sign();
      problem.layout().PartOf(flipped, j) *= sign->second;
    }
    double largest = 0;
    for (const auto& of_signal : bases) {
      for (const Eigen::MatrixXd& basis : of_signal) {
        largest = std::max(largest, statistic(basis, flipped));
      }
    }
    for (const SignalIndex s : observed.indices()) beaten[s] += largest >= observed[s] ? 1 : 0;
  }
  std::vector<SignalTrace> traces;
  for (const SignalIndex s : data.signals.indices()) {
    traces.push_back({data.signals[s].column, data.signals[s].values,
                      (1.0 + beaten[s]) / (1.0 + flips), shares[s]});
  }
  return traces;
}

}  // namespace

ResidualSignals SignalsOfResidual(const Dataset& all, const Identified& found) {
  constexpr int kSignalRows = 1000;  // used to test the signals
  const LinearProblem subset(found.fit.WithRows(EvenlySpacedRows(found.fit.data, kSignalRows)),
                             found.linear, found.model);
  CandidateSet candidate_set(subset);
  std::vector<BlockIndex> support;
  for (const BlockIndex block : found.best.blocks) {
    support.push_back(candidate_set.Add(found.candidate_set->blocks()[block]));
  }
  const Eigen::VectorXd residual = candidate_set.Residual(candidate_set.Fit(support));
  ResidualSignals signals{TestSignals(subset, residual, kSignFlips), {}};
  for (const SignalIndex s : all.signals.indices()) {
    signals.traces[s.offset()].values = all.signals[s].values;
  }
  for (const PeriodicLine& line : PeriodicLines(subset, residual)) {
    signals.spectrum.push_back({line.joint, line.cycles_per_turn, line.amplitude_rad});
  }
  return signals;
}

}  // namespace plumbline::measure
