#include "app/diagnosis/robust.h"

#include <algorithm>
#include <cmath>

#include "app/diagnosis/thresholds.h"
#include "firmware-like/statistics/median.h"

namespace plumbline {

namespace {

double WholeWeightUpTo(int axes) {
  return axes == 1 ? 3.5 : 4.2;
}

}  // namespace

double RobustSigma(const PerRow<Vec3>& residuals, int axes) {
  std::vector<double> sizes;
  sizes.reserve(residuals.size());
  for (const Vec3& r : residuals) sizes.push_back(r.head(axes).norm());
  return MedianOf(sizes) / (axes == 1 ? 0.6745 : 1.5382);  // medians of chi_1 and chi_3
}

double OutlierScale(const PerRow<Vec3>& residuals, double sigma_m, int axes) {
  std::vector<double> sizes;
  sizes.reserve(residuals.size());
  for (const Vec3& r : residuals) sizes.push_back(r.head(axes).norm());
  const auto place =
      static_cast<std::size_t>((1 - kMostOutliers) * static_cast<double>(sizes.size() - 1));
  std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(place), sizes.end());
  return std::max({sigma_m, sizes[place] / WholeWeightUpTo(axes), 1e-7});
}

PerRow<double> HampelWeights(const PerRow<Vec3>& residuals, double sigma_m, int axes) {
  const double whole = WholeWeightUpTo(axes);
  const double falling = whole + 1.3, none = 2 * whole;
  PerRow<double> weights;
  for (const Vec3& r : residuals) {
    const double d = r.head(axes).norm() / sigma_m;
    double weight = 1;
    if (d > none) {
      weight = 0;
    } else if (d > falling) {
      weight = whole / d * (none - d) / (none - falling);
    } else if (d > whole) {
      weight = whole / d;
    }
    weights.push_back(weight);
  }
  return weights;
}

double HampelLoss(const PerRow<Vec3>& residuals, double sigma_m, int axes) {
  const double whole = WholeWeightUpTo(axes);
  const double falling = whole + 1.3, none = 2 * whole;
  double sum = 0;
  for (const Vec3& r : residuals) {
    const double d = r.head(axes).norm() / sigma_m;
    const double square = std::min(d, whole);
    sum += square * square;
    if (d > whole) sum += 2 * whole * (std::min(d, falling) - whole);
    if (d > falling) {
      const double left = 1 - (std::min(d, none) - falling) / (none - falling);
      sum += whole * (none - falling) * (1 - left * left);
    }
  }
  return sum;
}

}  // namespace plumbline
