// Fit of one straight dark-to-bright edge to the surrounding grey levels.
#pragma once

#include <optional>

#include "firmware-like/image/luma_view.h"
#include "firmware-like/lens/lens.h"

namespace plumbline::vision {

/// Approximate position of an edge. Its bright outside is to the left when going from start to end
/// as seen in the image (v downwards).
struct EdgeRegion {
  lens::Vec2 start, end;     ///< corners [px], accurate to about half a pixel
  lens::Vec2 before, after;  ///< outward unit normals of the adjacent sides at start and end
  double cell_px = 0;        ///< width of the dark zone inside and of the bright zone outside
  double bow_px = 0;         ///< outward deflection of the edge at its middle
};

/// Fitted edge; d0 and d1 are its outward distances from start and end.
struct EdgeFit {
  double d0 = 0, d1 = 0;       ///< [px]
  Eigen::Matrix2d covariance;  ///< of (d0, d1), from the residuals [px^2]
  double blur_px = 0;          ///< standard deviation of the blur
  double noise = 0;            ///< standard deviation of the residuals [grey levels]
};

/// See corner_refinement.h for the model. Pixels closer to an adjacent side than three times the
/// blur are excluded.
std::optional<EdgeFit> FitEdge(const image::LumaView& image, const EdgeRegion& region);

}  // namespace plumbline::vision
