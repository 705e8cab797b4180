// Fit of one straight dark-to-bright edge to the surrounding grey levels.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "app/vision/tracking/edge_alignment.h"
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
  HiddenParts hidden;        ///< not to be used
};

/// Fitted edge; d0 and d1 are its outward distances from start and end.
struct EdgeFit {
  double d0 = 0, d1 = 0;       ///< [px]
  Eigen::Matrix2d covariance;  ///< of (d0, d1), from the residuals [px^2]
  double blur_px = 0;          ///< standard deviation of the blur
};

/// Fits the blurred edge of a half plane to the pixels p near a side:
///   I(p) = B(s) + A(s) Phi(t) - C Phi(t - w / sigma)
///   t = d / sigma,  d = n . p - bow(s) - d0 (1 - s) - d1 s
/// with s in 0..1 along the side, d outwards [px] and Phi the normal distribution function. B and A
/// are linear between some knots along the side, since a shadow may cross it. C is the edge of a
/// bright margin of width w, if that is so thin that it is near the edge. All are estimated by
/// Gauss-Newton, with less weight on pixels that do not fit: something may cover a part of the
/// edge. Pixels closer to an adjacent side than three times the blur are excluded.
/// @return  nullopt if there are too few pixels, or no such edge
std::optional<EdgeFit> FitEdge(const image::LumaView& image, const EdgeRegion& region);

}  // namespace plumbline::vision
