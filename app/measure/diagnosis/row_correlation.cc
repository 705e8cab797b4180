#include "app/measure/diagnosis/row_correlation.h"

#include <algorithm>
#include <cmath>

#include "app/measure/diagnosis/thresholds.h"

namespace plumbline::measure {

double RowCorrelation(const Dataset& data, const PerRow<RowResidual>& residuals,
                      const PerRow<double>& weights) {
  constexpr double kMost = 0.95;
  double product = 0, square = 0;
  double variance = 0;  // of `product` under independence
  for (RowIndex row(1); row.value() < data.rows(); ++row) {
    const RowIndex previous(row.value() - 1);
    if (data.session_of[row] != data.session_of[previous]) continue;
    if (data.cluster_of[row] == data.cluster_of[previous]) continue;
    if (std::min(weights[row], weights[previous]) < kOutlierWeight) continue;
    const int count = data.numbers[row].lengths();
    if (count == 0 || count != data.numbers[previous].lengths()) continue;
    const auto current = residuals[row].head(count), last = residuals[previous].head(count);
    product += current.dot(last);
    variance += current.dot(last) * current.dot(last);
    square += (current.squaredNorm() + last.squaredNorm()) / 2;
  }
  if (!(square > 0)) return 0;
  const double correlation = product / square;
  if (product < kCorrelatedSigmas * std::sqrt(variance)) return 0;
  return std::min(kMost, correlation);
}

double VarianceInflation(const LinearProblem& problem,
                         const Eigen::Ref<const Eigen::VectorXd>& column) {
  const double rho = problem.fit().row_correlation;
  const double length = column.squaredNorm();
  if (!(rho > 0) || !(length > 0)) return 1;
  const Dataset& data = problem.data();
  const FitLayout& layout = problem.layout();
  RowResidual weighted_sum;  // over previous rows of rho^distance x
  double cross = 0;
  std::optional<RowIndex> previous;
  for (const FitRowIndex fit_row : problem.rows().indices()) {
    const RowIndex row = problem.rows()[fit_row];
    const auto x = layout.PartOf(column, fit_row);
    if (x.size() == 0) continue;
    const bool continues = previous && data.session_of[row] == data.session_of[*previous] &&
                           weighted_sum.size() == x.size();
    if (continues) {
      weighted_sum *= std::pow(rho, row.value() - previous->value());
      cross += x.dot(weighted_sum);
      weighted_sum += x;
    } else {
      weighted_sum = x;
    }
    previous = row;
  }
  return std::max(1.0, 1 + 2 * cross / length);
}

}  // namespace plumbline::measure
