#include "app/measure/diagnosis/line_sums.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>

namespace plumbline::measure {

LineSums::LineSums(const Eigen::VectorXd& q, double first, double step, Eigen::Index steps)
    : steps_(steps), start_(static_cast<std::size_t>(q.size())), spread_(2 * kSpread, q.size()) {
  constexpr int kLeastGrid = 4 * kSpread;
  grid_ = kLeastGrid;
  while (grid_ < 2 * steps) grid_ *= 2;
  // In the notation of the paper: M_r = grid, M = grid / 2, R = 2, M_sp = kSpread.
  const double spacing = 2 * std::numbers::pi / grid_;
  const double tau = std::numbers::pi * kSpread / (0.75 * grid_ * grid_);
  const Eigen::Index half = steps / 2;
  const double middle = first + step * static_cast<double>(half);
  turned_.resize(q.size());
  Eigen::ArrayXd falling(kSpread + 1);  // of the Gaussian alone at the grid points
  for (int k = 0; k <= kSpread; ++k) falling[k] = std::exp(-std::pow(k * spacing, 2) / (4 * tau));
  for (Eigen::Index row = 0; row < q.size(); ++row) {
    turned_[row] = std::polar(1.0, -middle * q[row]);
    const double turns = step * q[row] / (2 * std::numbers::pi);
    const double x = (turns - std::floor(turns)) * 2 * std::numbers::pi;
    const int below = static_cast<int>(x / spacing);
    const double beyond = x - below * spacing;
    start_[row] = below - kSpread + 1;
    // exp(-(beyond - k spacing)^2 / 4 tau) from one exponential for all k.
    const double centre = std::exp(-beyond * beyond / (4 * tau));
    const double ratio = std::exp(beyond * spacing / (2 * tau));
    double up = centre, down = centre;
    for (int k = 0; k <= kSpread; ++k, up *= ratio, down /= ratio) {
      if (k > 0 && k < kSpread) spread_(kSpread - 1 - k, row) = down * falling[k];
      spread_(kSpread - 1 + k, row) = up * falling[k];
    }
  }
  correction_.resize(steps);
  for (Eigen::Index k = 0; k < steps; ++k) {
    const auto order = static_cast<double>(k - half);
    correction_[k] = std::sqrt(std::numbers::pi / tau) * std::exp(order * order * tau) / grid_;
  }
}

Eigen::ArrayX2d LineSums::Of(const Eigen::VectorXd& weights) const {
  std::vector<std::complex<double>> on_grid(static_cast<std::size_t>(grid_)), transformed;
  for (Eigen::Index row = 0; row < weights.size(); ++row) {
    const std::complex<double> of_row = weights[row] * turned_[row];
    int point = start_[row];
    if (point < 0) point += grid_;
    for (Eigen::Index k = 0; k < spread_.rows(); ++k) {
      on_grid[point] += spread_(k, row) * of_row;
      if (++point == grid_) point = 0;
    }
  }
  thread_local Eigen::FFT<double> fft;  // keeps the factors of the lengths that it has seen
  fft.fwd(transformed, on_grid);
  Eigen::ArrayX2d sums(steps_, 2);
  for (Eigen::Index k = 0; k < steps_; ++k) {
    const Eigen::Index order = k - steps_ / 2;
    const std::complex<double> sum =
        correction_[k] * transformed[order < 0 ? order + grid_ : order];
    sums(k, 0) = -sum.imag();  // the sum is of exp(-i c q)
    sums(k, 1) = sum.real();
  }
  return sums;
}

}  // namespace plumbline::measure
