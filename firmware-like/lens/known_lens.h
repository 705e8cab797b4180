// Lens parameters with their covariance.
#pragma once

#include <limits>

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
  /// Usable region: the lens is trusted up to this distance from the middle of the image [px].
  double usable_radius_px = std::numeric_limits<double>::infinity();  ///< infinite: everywhere
};

/// Middle of an image: between the centres of its outermost pixels [px].
inline Vec2 MiddleOf(image::ImageSize size) {
  return {0.5 * (size.width - 1), 0.5 * (size.height - 1)};
}

/// Whether nothing in the image lies outside the lens's usable region.
inline bool UsableEverywhere(const KnownLens& lens) {
  return lens.usable_radius_px >= MiddleOf(lens.size).norm();
}

/// Whether a pixel lies in the lens's usable region.
inline bool UsableAt(const KnownLens& lens, const Vec2& pixel) {
  return lens.usable_radius_px == std::numeric_limits<double>::infinity() ||
         (pixel - MiddleOf(lens.size)).norm() <= lens.usable_radius_px;
}

/// Share of the image that lies in the usable region, by counting cells (1).
inline double UsableShare(const KnownLens& lens) {
  constexpr int kCells = 64;
  int inside = 0;
  for (int row = 0; row < kCells; ++row) {
    for (int column = 0; column < kCells; ++column) {
      inside += UsableAt(lens, {(column + 0.5) / kCells * lens.size.width - 0.5,
                                (row + 0.5) / kCells * lens.size.height - 0.5});
    }
  }
  return inside / static_cast<double>(kCells * kCells);
}

}  // namespace plumbline::lens
