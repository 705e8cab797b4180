// Radius at which the distortion of a lens folds back, so that two directions have the same pixel.
#pragma once

#include <optional>
#include <string>

#include "firmware-like/image/image_size.h"
#include "firmware-like/lens/lens.h"

namespace plumbline::vision {

struct LensFold {
  double radius_px = 0;  ///< from the principal point; no pixel further out has a direction
  double angle_rad = 0;  ///< of the direction from the optical axis
  double corner_px = 0;  ///< distance of the farthest corner of the image
};

/// Where the radius r of the image of a direction stops growing with its angle t from the axis, if
/// that is inside the image; found in steps of 0.03 deg. Tangential and thin prism terms are
/// neglected.
///   fisheye, t < 180 deg:   r = t (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8)
///   otherwise, t < 90 deg:  r = c tan t, with c of DistortedNormalised()
std::optional<LensFold> FoldInside(const lens::Lens& lens, const image::ImageSize& size);

/// The same as a note with its remedy; empty if the lens does not fold inside the image.
std::string FoldNote(const lens::Lens& lens, const image::ImageSize& size);

}  // namespace plumbline::vision
