// Priors on lens, target size and joint offsets.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "app/vision/hand_eye/hand_eye_fit.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::vision {
namespace {

/// Prior for a lens of unknown covariance, by the effect of each parameter at the image's corner.
lens::LensCovariance WeakLensPrior(const lens::Lens& lens, const image::ImageSize& image) {
  const double corner = std::hypot(image.width, image.height) / (lens.fx + lens.fy);
  const double c2 = corner * corner;
  lens::LensVector sd = lens::LensVector::Zero();
  sd.head<9>() << 0.03 * lens.fx, 0.03 * lens.fy, 0.02 * image.width, 0.02 * image.width, 0.3 / c2,
      0.1 / (c2 * c2), 0.01, 0.01, 0.03 / (c2 * c2 * c2);
  return lens::LensCovariance(sd.cwiseAbs2().asDiagonal());
}

}  // namespace

HandEyePrior MakePrior(const lens::KnownLens& lens, const HandEyeOptions& options, int joints) {
  constexpr double kSizeSd = 0.1, kOffsetSd_rad = 0.01;
  HandEyePrior prior;
  prior.lens = lens.lens;
  std::fill_n(prior.active.begin(), kTargetSize, true);
  prior.active[kTargetSize] = options.free_size;
  prior.information(kTargetSize, kTargetSize) = 1 / (kSizeSd * kSizeSd);
  if (options.free_lens) {
    // The terms of other distortion models stay as calibrated.
    lens::LensCovariance covariance = lens.covariance;
    if ((covariance.diagonal().array() <= 0).all())
      covariance = WeakLensPrior(lens.lens, options.image);
    std::vector<int> known;  // zero variance: dropped by the calibration, so it stays fixed
    for (int i = 0; i < 9; ++i) {
      if (covariance(i, i) > 0) known.push_back(i);
    }
    const auto n = static_cast<Eigen::Index>(known.size());
    Eigen::MatrixXd part(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j) part(i, j) = covariance(known[i], known[j]);
    }
    const Eigen::MatrixXd information = part.ldlt().solve(Eigen::MatrixXd::Identity(n, n));
    for (Eigen::Index i = 0; i < n; ++i) {
      const int row = kLensFirst + known[i];
      prior.active[row] = true;
      for (Eigen::Index j = 0; j < n; ++j)
        prior.information(row, kLensFirst + known[j]) = information(i, j);
    }
  }
  for (int i = 0; i < joints; ++i) {
    const int row = kOffsetFirst + i;
    prior.information(row, row) = 1 / (kOffsetSd_rad * kOffsetSd_rad);
    // Offsets of the first and the last joint are equivalent to rotations of Y and X.
    prior.active[row] = options.free_joints && i > 0 && i + 1 < joints;
  }
  return prior;
}

}  // namespace plumbline::vision
