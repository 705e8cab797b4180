// One straight edge from dark to bright, fitted to the grey levels around it.
#pragma once

#include <optional>

#include "firmware-like/lens/luma_view.h"

namespace plumbline {

/// Where an edge is, roughly. Its outside (bright) is to the left of the way from start to end as
/// seen (v downwards).
struct EdgeRegion {
  Vec2 start, end;     ///< corners [px], good to about half a pixel
  Vec2 before, after;  ///< unit normals of the sides that meet at start and end, outwards
  double cell_px = 0;  ///< how far dark reaches inwards and bright outwards
  double bow_px = 0;   ///< how far the edge bends outwards at its middle
};

/// What the fit found: the edge passes start and end at d0 and d1 outwards.
struct EdgeFit {
  double d0 = 0, d1 = 0;       ///< [px]
  Eigen::Matrix2d covariance;  ///< of (d0, d1), from the residuals [px^2]
  double blur_px = 0;          ///< standard deviation of the edge's spread
  double noise = 0;            ///< standard deviation of the residuals [grey levels]
};

/// The equation stands in corner_refinement.h. Pixels closer to a neighbouring side than
/// three times the blur are left out.
std::optional<EdgeFit> FitEdge(const LumaView& image, const EdgeRegion& region);

}  // namespace plumbline
