// Detection of saddle points: candidates for the corners of a chessboard.
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <vector>

#include "firmware-like/lens/lens.h"

namespace plumbline::vision {

/// A point around which the image is bright, dark, bright, dark.
struct SaddlePoint {
  lens::Vec2 at = lens::Vec2::Zero();       ///< [px]
  std::array<double, 2> edge_rad = {0, 0};  ///< directions of the two edges, 0 <= angle < pi; the
                                            ///< sector from [0] to [1] is bright
  double strength = 0;                      ///< Ixy^2 - Ixx Iyy, grey levels^2 / px^4
};

/// Saddle points of a grey image, strongest first: local maxima of
///   S = Ixy^2 - Ixx Iyy
/// around which a ring of `radius` pixels crosses its mean four times, point-symmetrically.
/// @param smooth  CV_32F, already smoothed
/// @param most    maximum number of points
std::vector<SaddlePoint> FindSaddlePoints(const cv::Mat& smooth, double radius, std::size_t most);

}  // namespace plumbline::vision
