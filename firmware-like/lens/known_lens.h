// Lens parameters with their covariance.
#pragma once

#include "firmware-like/image/image_size.h"
#include "firmware-like/lens/lens.h"

namespace plumbline::lens {

/// Number of lens parameters, in the order of Lens: fx, fy, cx, cy [px], k1, k2, p1, p2, k3 (1).
inline constexpr int kLensParameters = 9;
using LensVector = Eigen::Matrix<double, kLensParameters, 1>;
using LensCovariance = Eigen::Matrix<double, kLensParameters, kLensParameters>;

struct KnownLens {
  Lens lens;
  LensCovariance covariance = LensCovariance::Zero();  ///< in the order of LensVector
  image::ImageSize size{};  ///< size of the calibration images; 0 x 0: unknown
};

}  // namespace plumbline::lens
