#include "app/diagnosis/row_correlation.h"

#include <algorithm>
#include <cmath>

#include "app/diagnosis/thresholds.h"

namespace plumbline {

double RowCorrelation(const Dataset& data, const PerRow<RowResidual>& residuals,
                      const PerRow<double>& weights) {
  constexpr double kMost = 0.95;
  double together = 0, alone = 0, variance = 0;  // the last of `together` under independence
  for (RowIndex row(1); row.value() < data.rows(); ++row) {
    const RowIndex before(row.value() - 1);
    if (data.session_of[row] != data.session_of[before]) continue;
    if (data.cluster_of[row] == data.cluster_of[before]) continue;
    if (std::min(weights[row], weights[before]) < kOutlierWeight) continue;
    const int count = data.numbers[row].lengths();
    if (count == 0 || count != data.numbers[before].lengths()) continue;
    const auto now = residuals[row].head(count), then = residuals[before].head(count);
    together += now.dot(then);
    variance += now.dot(then) * now.dot(then);
    alone += (now.squaredNorm() + then.squaredNorm()) / 2;
  }
  if (!(alone > 0)) return 0;
  const double correlation = together / alone;
  if (together < kCorrelatedSigmas * std::sqrt(variance)) return 0;
  return std::min(kMost, correlation);
}

double VarianceInflation(const LinearProblem& problem,
                         const Eigen::Ref<const Eigen::VectorXd>& column) {
  const double rho = problem.fit().row_correlation;
  const double length = column.squaredNorm();
  if (!(rho > 0) || !(length > 0)) return 1;
  const Dataset& data = problem.data();
  const FitLayout& layout = problem.layout();
  RowResidual carried;  // sum over the rows before of rho^distance x
  double together = 0;
  std::optional<RowIndex> before;
  for (const FitRowIndex fit_row : problem.rows().indices()) {
    const RowIndex row = problem.rows()[fit_row];
    const auto x = layout.PartOf(column, fit_row);
    if (x.size() == 0) continue;
    const bool goes_on =
        before && data.session_of[row] == data.session_of[*before] && carried.size() == x.size();
    if (goes_on) {
      carried *= std::pow(rho, row.value() - before->value());
      together += x.dot(carried);
      carried += x;
    } else {
      carried = x;
    }
    before = row;
  }
  return std::max(1.0, 1 + 2 * together / length);
}

}  // namespace plumbline
