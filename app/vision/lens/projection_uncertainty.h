// Projection uncertainty of a calibrated lens over the image.
#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include "app/vision/lens/lens_model.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::vision {

/// One standard deviation of the projection on a grid of pixels, row by row from the top left.
struct ProjectionUncertainty {
  std::optional<double> distance_m;  ///< infinity if nullopt
  int columns = 0, rows = 0;
  std::vector<double> sd_px;  ///< in the worst direction, at each grid point
  double max_px = 0;          ///< the largest within the radius
};

/// A change d of the lens parameters moves the image of each direction. The part of that motion
/// which a rotation of the camera compensates is harmless, because poses are estimated with the
/// same lens. What remains is
///   e(q) = J(q) d - R(q) (sum R^T R)^-1 sum R^T J d
/// with J the derivative of the pixel of a fixed direction with respect to the lens, and R that
/// with respect to a small camera rotation. At a finite distance a translation is compensated as
/// well. The result is the standard deviation of e(q) in its worst direction, from the covariance
/// of d.
/// @param radius_px  if only pixels up to this distance from the image's middle are used (see
///                   KnownLens): the sums are over these
ProjectionUncertainty ProjectionUncertaintyOf(const lens::Lens& lens,
                                              const lens::LensCovariance& covariance,
                                              image::ImageSize size,
                                              std::optional<double> distance_m = std::nullopt,
                                              double radius_px = INFINITY);

/// Likewise for a lens with five distortion coefficients.
inline ProjectionUncertainty ProjectionUncertaintyOf(
    const lens::Lens& lens, const LensMatrix& covariance, image::ImageSize size,
    std::optional<double> distance_m = std::nullopt, double radius_px = INFINITY) {
  return ProjectionUncertaintyOf(lens, FullCovariance(covariance), size, distance_m, radius_px);
}

/// Weight W of the lens's covariance C in the mean variance of the projection over the image, the
/// mean of tr(E C E^T) = tr(W C) with E the derivative of e(q) [px^2].
lens::LensCovariance ProjectionWeight(const lens::Lens& lens, image::ImageSize size,
                                      std::optional<double> distance_m = std::nullopt);

/// Largest difference between two lenses over the image by the same measure [px].
double LargestDifference(const lens::Lens& a, const lens::Lens& b, image::ImageSize size,
                         std::optional<double> distance_m = std::nullopt,
                         double radius_px = INFINITY);

/// The same lens with square pixels, the most likely one by the covariance C. With a = fx / fy and
/// g its derivative by the lens,
///   lens - C g (a - 1) / (g^T C g)
/// Nothing if a is within three of its standard deviations of 1, since the covariance then contains
/// it, or within 0.06 %: sensors and prints are assumed to be true to that.
std::optional<lens::Lens> WithSquarePixels(const lens::Lens& lens,
                                           const lens::LensCovariance& covariance);

/// Pixels that represent the image up to a distance from its middle: the points of a grid, and of
/// the circle around the middle.
std::vector<lens::Vec2> PixelsWithin(image::ImageSize size, double radius_px, int columns,
                                     int rows);

}  // namespace plumbline::vision
