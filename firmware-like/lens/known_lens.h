// A lens with what is known of its error.
#pragma once

#include "firmware-like/lens/lens.h"

namespace plumbline {

/// Parameters of a lens in the order of Lens: fx, fy, cx, cy [px], k1, k2, p1, p2, k3 (1).
inline constexpr int kLensParameters = 9;
using LensVector = Eigen::Matrix<double, kLensParameters, 1>;
using LensCovariance = Eigen::Matrix<double, kLensParameters, kLensParameters>;

struct KnownLens {
  Lens lens;
  LensCovariance covariance = LensCovariance::Zero();  ///< order of LensVector; units of Lens
  ImageSize size{};  ///< of the images that it was calibrated with; 0 x 0: not known
};

}  // namespace plumbline
