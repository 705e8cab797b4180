// How far the lens may err over the image.
#pragma once

#include <optional>
#include <vector>

#include "app/lens/lens_model.h"

namespace plumbline {

/// One standard deviation of the projection on a grid of pixels, row by row from the top left.
struct ProjectionUncertainty {
  std::optional<double> distance_m;  ///< none: at infinity
  int columns = 0, rows = 0;
  std::vector<double> sd_px;  ///< along the worst direction, at each grid point
  double max_px = 0;
};

/// A change of the lens parameters moves what each pixel sees; the part of it that a turn of the
/// camera undoes is no error of the lens, since poses are estimated with it:
///   e(q) = J(q) d - R(q) (sum R^T R)^-1 sum R^T J d
/// with J the derivative of the pixel of a fixed direction and R that by a small rotation. At a
/// distance a shift of the camera is undone as well. The standard deviation at q is that along the
/// worst direction, from the covariance of d.
ProjectionUncertainty UncertaintyOf(const Lens& lens, const LensMatrix& covariance, ImageSize size,
                                    std::optional<double> distance_m = std::nullopt);

/// Largest difference of two lenses over the image by the same measure [px].
double LargestDifference(const Lens& a, const Lens& b, ImageSize size,
                         std::optional<double> distance_m = std::nullopt);

}  // namespace plumbline
