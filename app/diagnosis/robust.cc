#include "app/diagnosis/robust.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "app/diagnosis/thresholds.h"
#include "firmware-like/statistics/median.h"

namespace plumbline {
namespace {

/// Of the root of chi2 with so many degrees of freedom, 0..6.
struct ChiQuantiles {
  double middle;  ///< median
  double whole;   ///< exceeded once in 2000
};
constexpr std::array<ChiQuantiles, kMostResiduals + 1> kChi = {{{1, 3.5},
                                                                {0.6745, 3.5},
                                                                {1.1774, 3.9},
                                                                {1.5382, 4.2},
                                                                {1.8321, 4.5},
                                                                {2.0860, 4.7},
                                                                {2.3126, 4.9}}};

const ChiQuantiles& ChiOf(int count) {
  return kChi[static_cast<std::size_t>(count)];
}

/// Where the weight begins to fall, where it falls faster, and where it is zero.
struct HampelParts {
  double whole, falling, none;
  explicit HampelParts(int count)
      : whole(ChiOf(count).whole), falling(whole + 1.3), none(2 * whole) {}
};

}  // namespace

double MedianOfChi(int count) {
  return ChiOf(count).middle;
}

double RobustSigma(const Dataset& data, const PerRow<RowResidual>& residuals) {
  std::vector<double> sigmas;  // by each row alone
  for (const RowIndex row : residuals.indices()) {
    const RowNumbers& numbers = data.numbers[row];
    if (numbers.count == 0) continue;
    sigmas.push_back(SizeOf(numbers, residuals[row]) / MedianOfChi(numbers.count));
  }
  return sigmas.empty() ? 0 : MedianOf(sigmas);
}

double OutlierScale(const Dataset& data, const PerRow<RowResidual>& residuals, double sigma_m) {
  constexpr double kLeast_m = 1e-7;
  std::vector<double> sizes;
  for (const RowIndex row : residuals.indices()) {
    const RowNumbers& numbers = data.numbers[row];
    if (numbers.count == 0) continue;
    sizes.push_back(SizeOf(numbers, residuals[row]) / ChiOf(numbers.count).whole);
  }
  if (sizes.empty()) return std::max(sigma_m, kLeast_m);
  const auto place =
      static_cast<std::size_t>((1 - kMostOutliers) * static_cast<double>(sizes.size() - 1));
  std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(place), sizes.end());
  return std::max({sigma_m, sizes[place], kLeast_m});
}

double HampelWeight(int count, double sigmas) {
  const HampelParts parts(count);
  if (sigmas > parts.none) return 0;
  if (sigmas > parts.falling) {
    return parts.whole / sigmas * (parts.none - sigmas) / (parts.none - parts.falling);
  }
  return sigmas > parts.whole ? parts.whole / sigmas : 1;
}

double HampelLoss(int count, double sigmas) {
  const HampelParts parts(count);
  const double square = std::min(sigmas, parts.whole);
  double loss = square * square;
  if (sigmas > parts.whole) {
    loss += 2 * parts.whole * (std::min(sigmas, parts.falling) - parts.whole);
  }
  if (sigmas > parts.falling) {
    const double left =
        1 - (std::min(sigmas, parts.none) - parts.falling) / (parts.none - parts.falling);
    loss += parts.whole * (parts.none - parts.falling) * (1 - left * left);
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

}  // namespace plumbline
