// Detection of dark discs and their grouping into lattices.
#pragma once

#include <map>
#include <opencv2/core.hpp>
#include <vector>

#include "firmware-like/lens/lens.h"

namespace plumbline::vision {

/// A dark region with the moments of a filled ellipse.
struct Disc {
  lens::Vec2 at = lens::Vec2::Zero();                ///< centroid [px]
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();  ///< second central moments [px^2]
  double area = 0;                                   ///< [px^2]

  /// Radius along the unit vector n of the ellipse with these moments [px].
  double RadiusAlong(const lens::Vec2& n) const {
    return 1 / std::sqrt(n.dot(spread.inverse() * n) / 4);
  }
};

/// Regions darker than the local mean whose area equals that of the ellipse with their moments,
/// 4 pi sqrt(det spread). Largest first.
/// @param smooth  CV_8U
/// @param around  side of the square over which the mean is taken [px]
/// @param most    maximum number of discs
std::vector<Disc> FindDiscs(const cv::Mat& smooth, int around, std::size_t most);

/// Integer lattice coordinates. The axes are two of the lattice's shortest steps, with x cross y
/// pointing away from the viewer.
struct LatticePlace {
  int x = 0, y = 0;
  auto operator<=>(const LatticePlace&) const = default;  // NOLINT(modernize-use-nullptr)
};

/// Connected lattices, largest first, as disc indices by place. A lattice grows from disc to disc
/// while its steps and the discs' sizes change little.
std::vector<std::map<LatticePlace, int>> FindDiscLattices(const std::vector<Disc>& discs);

}  // namespace plumbline::vision
