#include "app/measure/diagnosis/linear/robust.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unsupported/Eigen/SpecialFunctions>

#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
double FisherTail(double value, double d1, double d2) {
  if (value <= 0) return 1;
  return Eigen::numext::betainc(d2 / 2, d1 / 2, d2 / (d2 + d1 * value));
}

double FisherQuantile(double probability, double d1, double d2) {
  double low = 0, high = 1;
  while (FisherTail(high, d1, d2) > probability && high < 1e12) high *= 2;
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (low + high);
    (FisherTail(middle, d1, d2) > probability ? low : high) = middle;
  }
  return high;
}

std::uint64_t Random::Next() {
  std::uint64_t z = (state_ += 0x9E3779B97F4A7C15ULL);
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31);
}

double Random::Uniform() {
  return static_cast<double>(Next() >> 11) * 0x1.0p-53;
}

int Random::Below(int count) {
  return static_cast<int>(Uniform() * count);
}

namespace {

/// Quantiles of the chi distribution; the table is indexed by the degrees of freedom, 0..6.
struct ChiQuantiles {
  double median;
  double extreme;  ///< exceeded once in 2000
};
constexpr std::array<ChiQuantiles, kMaxResiduals + 1> kChi = {{{1, 3.5},
                                                               {0.6745, 3.5},
                                                               {1.1774, 3.9},
                                                               {1.5382, 4.2},
                                                               {1.8321, 4.5},
                                                               {2.0860, 4.7},
                                                               {2.3126, 4.9}}};

const ChiQuantiles& ChiOf(int count) {
  return kChi[count];
}

/// Limits of the three parts: end of full weight, start of the steeper descent, start of zero
/// weight.
struct HampelParts {
  double full, descent, zero;
  explicit HampelParts(int count)
      : full(ChiOf(count).extreme), descent(full + 1.3), zero(2 * full) {}
};

}  // namespace

double MedianOfChi(int count) {
  return ChiOf(count).median;
}

double RobustSigma(const Dataset& data, const PerRow<RowResidual>& residuals) {
  std::vector<double> sigmas;  // estimates from single rows
  for (const RowIndex row : residuals.indices()) {
    const RowNumbers& numbers = data.numbers[row];
    if (numbers.count == 0) continue;
    sigmas.push_back(SizeOf(numbers, residuals[row]) / MedianOfChi(numbers.count));
  }
  return sigmas.empty() ? 0 : statistics::MedianOf(sigmas);
}

double ResidualScatter(const FitProblem& problem, const PerRow<RowResidual>& residuals,
                       double parameters) {
  double square = 0, lengths = 0;
  for (const RowIndex row : residuals.indices()) {
    const RowNumbers& numbers = problem.data.numbers[row];
    if (numbers.count == 0 || problem.weights[row] < kOutlierWeight) continue;
    square += problem.weights[row] * std::pow(SizeOf(numbers, residuals[row]), 2);
    lengths += problem.weights[row] * numbers.count;
  }
  return std::sqrt(square / std::max(1.0, lengths - parameters));
}

double OutlierScale(const Dataset& data, const PerRow<RowResidual>& residuals, double sigma_m) {
  constexpr double kMin_m = 1e-7;
  std::vector<double> sizes;
  for (const RowIndex row : residuals.indices()) {
    const RowNumbers& numbers = data.numbers[row];
    if (numbers.count == 0) continue;
    sizes.push_back(SizeOf(numbers, residuals[row]) / ChiOf(numbers.count).extreme);
  }
  if (sizes.empty()) return std::max(sigma_m, kMin_m);
  const auto place =
      static_cast<std::size_t>((1 - kMaxOutliers) * static_cast<double>(sizes.size() - 1));
  std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(place), sizes.end());
  return std::max({sigma_m, sizes[place], kMin_m});
}

double HampelWeight(int count, double sigmas) {
  const HampelParts parts(count);
  if (sigmas > parts.zero) return 0;
  if (sigmas > parts.descent) {
    return parts.full / sigmas * (parts.zero - sigmas) / (parts.zero - parts.descent);
  }
  return sigmas > parts.full ? parts.full / sigmas : 1;
}

double HampelLoss(int count, double sigmas) {
  const HampelParts parts(count);
  const double square = std::min(sigmas, parts.full);
  double loss = square * square;
  if (sigmas > parts.full) {
    loss += 2 * parts.full * (std::min(sigmas, parts.descent) - parts.full);
  }
  if (sigmas > parts.descent) {
    const double left =
        1 - (std::min(sigmas, parts.zero) - parts.descent) / (parts.zero - parts.descent);
    loss += parts.full * (parts.zero - parts.descent) * (1 - left * left);
  }
  return loss;
}

PerRow<double> HampelWeights(const Dataset& data, const PerRow<RowResidual>& residuals,
                             double sigma_m) {
  PerRow<double> weights;
  for (const RowIndex row : residuals.indices()) {
    const RowNumbers& numbers = data.numbers[row];
    weights.push_back(numbers.count == 0
                          ? 0
                          : HampelWeight(numbers.count, SizeOf(numbers, residuals[row]) / sigma_m));
  }
  return weights;
}

double HampelLoss(const Dataset& data, const PerRow<RowResidual>& residuals, double sigma_m) {
  double sum = 0;
  for (const RowIndex row : residuals.indices()) {
    const RowNumbers& numbers = data.numbers[row];
    sum += HampelLoss(numbers.count, SizeOf(numbers, residuals[row]) / sigma_m);
  }
  return sum;
}

}  // namespace plumbline::measure
