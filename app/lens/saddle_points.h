// Where two dark and two bright squares may meet.
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <vector>

#include "firmware-like/lens/lens.h"

namespace plumbline {

/// A point around which the image is bright, dark, bright, dark.
struct SaddlePoint {
  Vec2 at = Vec2::Zero();                   ///< [px]
  std::array<double, 2> edge_rad = {0, 0};  ///< directions of the two edges, 0 <= angle < pi;
                                            ///< going on from [0] to [1] the sector is bright
  double strength = 0;                      ///< Ixy^2 - Ixx Iyy, grey levels^2 / px^4
};

/// The saddle points of a grey image, strongest first, at most `most` of them. Local maxima of
///   S = Ixy^2 - Ixx Iyy
/// whose ring of `radius` pixels crosses its mean four times, point-symmetrically.
/// @param smooth  CV_32F, already smoothed
std::vector<SaddlePoint> FindSaddlePoints(const cv::Mat& smooth, double radius, std::size_t most);

}  // namespace plumbline
