// The corners of a tag to a few hundredths of a pixel, with what is known of their error.
#pragma once

#include <optional>

#include "app/tracking/quads.h"
#include "firmware-like/lens/luma_view.h"

namespace plumbline {

/// Covariance of four corners (u0, v0, u1, v1, ..) [px^2]. Neighbours share a side: correlated.
using CornersCovariance = Eigen::Matrix<double, 8, 8>;

struct RefinedCorners {
  Corners corners;
  CornersCovariance covariance;
  double blur_px = 0;  ///< standard deviation of the edges' blur, mean of the four sides
};

/// Fits each side to the image as the edge of a half plane, blurred:
///   I(p) = B + b s + (A + a s) Phi(d / sigma),  d = n . p - bow(s) - d0 (1 - s) - d1 s
/// over the pixels p near the side, s in 0..1 along it, d outwards [px], Phi the normal
/// distribution; d0, d1, sigma, B, b, A, a by Gauss-Newton. The blur of a pixel's area and of
/// optics and motion are symmetric and do not move the edge. bow is the side's curvature by the
/// lens' distortion (a parabola, zero at both corners). The corners are where two sides meet;
/// the covariance follows from the residuals of the grey levels.
/// Valid for corners good to about half a pixel. @param cells  of a side, with the border
/// @param lens   nothing where it is not known: sides are then taken as straight in the image
/// @return       nothing where a side has too few pixels or its edge cannot be fitted
std::optional<RefinedCorners> RefineCorners(const LumaView& image, const Corners& rough, int cells,
                                            const Lens* lens);

}  // namespace plumbline
