#include "app/measure/plan/d_optimal.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace plumbline::measure {
namespace {

constexpr double kWorthExchange = 1e-6;

/// Gain in log det by adding a row: log det(1 + X H^-1 X^T).
double GainOf(const Eigen::MatrixXd& X, const Eigen::MatrixXd& inverse) {
  const Eigen::MatrixXd S =
      Eigen::MatrixXd::Identity(X.rows(), X.rows()) + X * inverse * X.transpose();
  return LogDeterminant(S);
}

Eigen::MatrixXd Inverted(const Eigen::MatrixXd& H) {
  return H.ldlt().solve(Eigen::MatrixXd::Identity(H.rows(), H.cols()));
}

/// The unused row with the largest gain.
int BestRow(const std::vector<Eigen::MatrixXd>& rows, const std::vector<bool>& used,
            const Eigen::MatrixXd& inverse, double& gain) {
  int best = -1;
  gain = -1;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (used[i]) continue;
    const double of_row = GainOf(rows[i], inverse);
    if (of_row > gain) gain = of_row, best = static_cast<int>(i);
  }
  return best;
}

}  // namespace

double LogDeterminant(const Eigen::MatrixXd& matrix) {
  return 2 * Eigen::MatrixXd(matrix.llt().matrixL()).diagonal().array().log().sum();
}

Eigen::MatrixXd Information(const std::vector<Eigen::MatrixXd>& rows,
                            const std::vector<int>& selected) {
  const Eigen::Index size = rows.empty() ? 0 : rows.front().cols();
  Eigen::MatrixXd H = Eigen::MatrixXd::Identity(size, size);
  for (const int i : selected) {
    const Eigen::MatrixXd& X = rows[i];
    H += X.transpose() * X;
  }
  return H;
}

std::vector<int> DOptimalRows(const std::vector<Eigen::MatrixXd>& rows, int count, int passes) {
  std::vector<bool> used(rows.size(), false);
  std::vector<int> selected;
  double gain = 0;
  while (static_cast<int>(selected.size()) < std::min(count, static_cast<int>(rows.size()))) {
    const int best = BestRow(rows, used, Inverted(Information(rows, selected)), gain);
    used[best] = true;
    selected.push_back(best);
  }
  for (int pass = 0; pass < passes; ++pass) {
    bool exchanged = false;
    for (int& row : selected) {
      const Eigen::MatrixXd& X = rows[row];
      const Eigen::MatrixXd inverse = Inverted(Information(rows, selected) - X.transpose() * X);
      const double kept = GainOf(X, inverse);
      const int best = BestRow(rows, used, inverse, gain);
      if (best < 0 || gain < kept + kWorthExchange) continue;
      used[row] = false;
      used[best] = true;
      row = best;
      exchanged = true;
    }
    if (!exchanged) break;
  }
  return selected;
}

}  // namespace plumbline::measure
