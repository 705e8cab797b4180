// Sub-pixel refinement of a tag's corners, with their covariance.
#pragma once

#include <optional>

#include "app/vision/tracking/edge_alignment.h"
#include "app/vision/tracking/quads.h"
#include "firmware-like/image/luma_view.h"
#include "firmware-like/lens/lens.h"

namespace plumbline::vision {

/// Covariance of four corners (u0, v0, u1, v1, ..) [px^2]. Neighbouring corners share a side and
/// are therefore correlated.
using CornersCovariance = Eigen::Matrix<double, 8, 8>;

struct RefinedCorners {
  Corners corners;
  CornersCovariance covariance;
  double blur_px = 0;  ///< standard deviation of the edges' blur, mean over the four sides
};

/// Fits the edge of each side (see FitEdge). Blur from pixel area, optics and motion is symmetric
/// and does not shift it. Lens distortion bends a side to a parabola through both corners. The
/// corners are the intersections of the sides; their covariance follows from the residual grey
/// levels. The initial corners must be accurate to about half a pixel.
/// @param hidden  parts of the sides to be ignored
/// @param cells   per side, including the border
/// @param lens    null if unknown: sides are then assumed to be straight in the image
/// @return        nullopt if a side has too few pixels or its edge cannot be fitted
std::optional<RefinedCorners> RefineCorners(const image::LumaView& image, const Corners& rough,
                                            const std::array<HiddenParts, 4>& hidden, int cells,
                                            const lens::Lens* lens);

}  // namespace plumbline::vision
