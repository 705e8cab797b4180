#include "app/measure/diagnosis/critics/lack_of_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <vector>

#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/linear/robust.h"

namespace plumbline::measure {
namespace {

constexpr double kMinFreedom = 12;

/// Rows of one cluster whose residuals can be compared: of one kind, artefact and camera, since
/// two cameras differ by more than their noise.
using ReplicatesKey = std::tuple<ClusterIndex, ObservationKind, int, std::string>;

ReplicatesKey KeyOf(const Dataset& data, RowIndex row) {
  const Observation& observation = data.observations[row];
  const int artefact = OnArtefact(observation.kind) ? observation.artefact.value() : -1;
  return {data.cluster_of[row], observation.kind, artefact, data.measured(row).camera};
}

/// True for a row that measures something at its joint readings. A touch measures the joints
/// themselves, so that two touches at equal readings are equal.
bool Compares(const Dataset& data, RowIndex row) {
  switch (data.observations[row].kind) {
    case ObservationKind::kPosition:
    case ObservationKind::kPose:
    case ObservationKind::kRange:
    case ObservationKind::kArtefactRange:
    case ObservationKind::kGauge:
      return true;
    default:
      return false;
  }
}

/// Lengths of a residual in units of the row's own noise, times the noise of the data set [m].
Vec3 ScaledLengths(const RowNumbers& numbers, const RowResidual& residual) {
  const double variance = numbers.LengthVariance() / numbers.lengths();
  return LengthsOf(residual) / std::sqrt(variance);
}

/// Sums over the rows of a group, or over groups.
struct Squares {
  double sum = 0, freedom = 0;
};

/// Excess kurtosis of all components about zero, at least 0.
double ExcessKurtosis(const std::vector<Vec3>& lengths, double components) {
  double second = 0, fourth = 0;
  for (const Vec3& one : lengths) {
    second += one.squaredNorm();
    fourth += one.array().pow(4).sum();
  }
  return second > 0 ? std::max(0.0, fourth * components / (second * second) - 3) : 0;
}

}  // namespace

std::optional<LackOfFit> LackOfFitOf(const Dataset& data, const PerRow<RowResidual>& residuals,
                                     const PerRow<double>& weights, double row_correlation,
                                     double parameters) {
  std::map<ReplicatesKey, std::vector<Vec3>> groups;
  std::map<ReplicatesKey, int> components;  // of one row
  std::vector<Vec3> all;
  double count = 0;  // of components
  for (const RowIndex row : data.row_indices()) {
    const int lengths = data.numbers[row].lengths();
    if (lengths == 0 || weights[row] < kOutlierWeight || !Compares(data, row)) continue;
    const ReplicatesKey key = KeyOf(data, row);
    groups[key].push_back(ScaledLengths(data.numbers[row], residuals[row]));
    components[key] = lengths;
    all.push_back(groups[key].back());
    count += lengths;
  }
  Squares within, between;
  for (const auto& [key, rows] : groups) {
    const auto n = static_cast<double>(rows.size());
    Vec3 mean = Vec3::Zero();
    for (const Vec3& row : rows) mean += row / n;
    for (const Vec3& row : rows) within.sum += (row - mean).squaredNorm();
    within.freedom += (n - 1) * components[key];
    between.sum += n * mean.squaredNorm();
    between.freedom += components[key];
  }
  between.freedom -= parameters;
  if (std::min(within.freedom, between.freedom) < kMinFreedom) return std::nullopt;

  LackOfFit found;
  found.replicates_m = std::sqrt(within.sum / within.freedom);
  found.replicates_freedom = within.freedom;
  found.between_poses_m = std::sqrt(between.sum / between.freedom);
  found.between_poses_freedom = between.freedom;
  // Successive replicates share a part of correlated noise.
  const double independent_m = found.replicates_m / std::sqrt(1 - row_correlation);
  found.noise_m = std::max(std::hypot(independent_m, data.reading_sigma_m), data.sigma_m);
  const double tails = 1 + ExcessKurtosis(all, count) / 2;
  const double quantile =
      FisherQuantile(kLackOfFitSignificance, between.freedom / tails, within.freedom / tails);
  const double notable = 1 + kNotableLackOfFit * kNotableLackOfFit * count / between.freedom;
  found.limit_m = found.noise_m * std::sqrt(std::max(quantile, notable));
  return found;
}

namespace {

ExplanationCheck LackOfFitCheck(const LackOfFit& found) {
  ExplanationCheck check;
  check.name = "lack_of_fit";
  check.figure = 1e3 * found.between_poses_m;
  check.limit = 1e3 * found.limit_m;
  check.passed = !found.significant();
  check.sentence = fmt::format(
      "residuals differ between poses by {:.3g} mm per axis, scaled to one row; repeated points "
      "scatter by {:.3g} mm, and a noise of {:.3g} mm accounts for at most {:.3g} mm (F test with "
      "{:.0f} and {:.0f} degrees of freedom, 0.1 %)",
      check.figure, 1e3 * found.replicates_m, 1e3 * found.noise_m, check.limit,
      found.between_poses_freedom, found.replicates_freedom);
  return check;
}

}  // namespace

Opinion OpinionOnReplicates(const Identified& found, const FitOfAllRows& fit) {
  const Dataset& data = fit.problem.data;
  const auto lack = LackOfFitOf(data, ResidualsOf(fit.linear), fit.problem.weights,
                                found.fit.row_correlation, ParametersOf(found, data));
  if (!lack) return {};
  Opinion opinion;
  opinion.checks.push_back(LackOfFitCheck(*lack));
  if (!lack->significant()) return opinion;
  opinion.notes.push_back(opinion.checks.back().sentence);
  opinion.permits = Verdict::kUnknown;
  return opinion;
}

}  // namespace plumbline::measure
