#include "app/measure/diagnosis/prediction/covariance_share.h"

#include <algorithm>

#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/linear/fit_problem.h"

namespace plumbline::measure {
namespace {

/// The identifiable parameters of one effect.
struct Adjusted {
  std::vector<int> values;           ///< indices into the effect's values
  std::vector<Eigen::Index> places;  ///< indices into the covariance
};

Adjusted AdjustedOf(const Refit& refit, int effect) {
  Adjusted adjusted;
  for (std::size_t j = 0; j < refit.parameters.size(); ++j) {
    if (refit.parameters[j].first != effect || !refit.identifiable[j]) continue;
    adjusted.values.push_back(refit.parameters[j].second);
    adjusted.places.push_back(static_cast<Eigen::Index>(j));
  }
  return adjusted;
}

/// Sum over the rows of the variances predicted by one effect's covariance alone, in units of the
/// variance of a row.
double VarianceByItself(const Identified& found, int effect) {
  const FitProblem& fit = found.fit;
  const effects::ActiveEffect& active = found.refit.model.effects[effect];
  const Adjusted adjusted = AdjustedOf(found.refit, effect);
  if (adjusted.values.empty()) return 0;
  const Eigen::MatrixXd covariance =
      found.refit.covariance(adjusted.places, adjusted.places) / (fit.sigma_m * fit.sigma_m);
  double sum = 0;
  for (const RowIndex row : fit.rows) {
    if (fit.weights[row] < kOutlierWeight) continue;
    const Gradient& gradient = found.linear->gradients[row];
    Eigen::MatrixXd columns(gradient.rows(), static_cast<Eigen::Index>(adjusted.values.size()));
    TermColumns(active.term, active.values, adjusted.values, fit.data.conditions[row], gradient,
                columns);
    Eigen::MatrixXd whitened(columns.rows(), columns.cols());
    RowWhitening(fit.data.numbers[row], 1).Apply(columns, whitened);
    sum += fit.weights[row] * (whitened * covariance).cwiseProduct(whitened).sum();
  }
  return sum;
}

}  // namespace

double CovarianceShare(const Identified& found, double discrepancy_parameters) {
  if (found.fit.data.ranges()) return 1;
  double apart = discrepancy_parameters;
  for (std::size_t effect = 0; effect < found.refit.model.effects.size(); ++effect) {
    apart += VarianceByItself(found, static_cast<int>(effect));
  }
  const auto held = static_cast<double>(std::ranges::count(found.refit.identifiable, true));
  const double together = std::max(held, discrepancy_parameters);
  return apart > together ? together / apart : 1;
}

}  // namespace plumbline::measure
