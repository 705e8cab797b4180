// Dark discs that hang together as one grid.
#pragma once

#include <map>
#include <opencv2/core.hpp>
#include <vector>

#include "firmware-like/lens/lens.h"

namespace plumbline {

/// A dark region with the moments of a filled ellipse.
struct Disc {
  Vec2 at = Vec2::Zero();                            ///< centroid [px]
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();  ///< second central moments [px^2]
  double area = 0;                                   ///< [px^2]

  /// Of the ellipse that has these moments, along the unit vector n [px].
  double RadiusAlong(const Vec2& n) const { return 1 / std::sqrt(n.dot(spread.inverse() * n) / 4); }
};

/// Regions darker than the mean over a square of `around` pixels, whose area is that of the ellipse
/// with their moments, 4 pi sqrt(det spread). Largest first, at most `most` of them.
/// @param smooth  CV_8U
std::vector<Disc> FindDiscs(const cv::Mat& smooth, int around, std::size_t most);

/// Whole steps of a lattice; the axes are two of its shortest steps, x cross y away from the
/// viewer.
struct LatticePlace {
  int x = 0, y = 0;
  auto operator<=>(const LatticePlace&) const = default;  // NOLINT(modernize-use-nullptr)
};

/// Connected pieces, largest first: from disc to disc by steps that change little, between discs
/// whose sizes differ little.
std::vector<std::map<LatticePlace, int>> FindDiscLattices(const std::vector<Disc>& discs);

}  // namespace plumbline
