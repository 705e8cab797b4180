// Usable region of a lens: the part of the image in which its projection is certain enough.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "app/vision/lens/lens_model.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::vision {

/// Candidate regions are circles around the middle of the image, the largest first: the first
/// contains the whole image, the others shrink by a fortieth of half the diagonal each.
inline constexpr std::size_t kCandidateRadii = 21;
/// One value for each candidate.
using RadiusErrors = std::array<double, kCandidateRadii>;

/// Radius of a candidate region [px]; infinite for the first one.
inline double CandidateRadius(std::size_t k, image::ImageSize size) {
  if (k == 0) return std::numeric_limits<double>::infinity();
  return (1 - static_cast<double>(k) / 40) * 0.5 * std::hypot(size.width - 1, size.height - 1);
}

/// Largest difference between two lenses within each candidate radius [px].
RadiusErrors DifferencesWithin(const lens::Lens& a, const lens::Lens& b, image::ImageSize size);

/// The error of a lens that is none over the whole image, as one that changes: that within the
/// largest candidate radius in which it is finite, everywhere.
RadiusErrors CountedEverywhere(RadiusErrors error_px);

struct RegionChoice {
  bool acceptable = false;  ///< otherwise the values are those of the whole image
  double radius_px = std::numeric_limits<double>::infinity();
  double plain_px = 0;  ///< largest standard deviation within, by the covariance [px]
  double error_px = 0;  ///< largest error within that is not in the covariance [px]
  /// Both together over the whole image [px].
  double everywhere_px = 0;
  /// Both together within the candidate region where they are least [px]; only if not acceptable.
  double least_px = std::numeric_limits<double>::infinity();
};

/// The largest region in which the standard deviation of the projection and the error that may come
/// with it are together at most `acceptable_px`. A region of less than half of the image is of no
/// use. Pixels beyond the region do not take part in the compensation by a rotation, because
/// nothing may be measured there.
RegionChoice LargestRegion(const lens::Lens& lens, const lens::LensCovariance& covariance,
                           const RadiusErrors& error_px, image::ImageSize size,
                           std::optional<double> distance_m, double acceptable_px);

}  // namespace plumbline::vision
