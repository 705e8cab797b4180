// Guidance for the person who holds the calibration board: where to hold it, and what is known so
// far.
#pragma once

#include <cstdint>
#include <vector>

#include "firmware-like/lens/lens.h"

namespace plumbline::lens {

/// Polylines are in pixels of the camera image, which is not undistorted; each is closed and starts
/// with the board's upper edge, from its left end.
struct BoardGuidance {
  std::vector<Vec2> wanted_px;  ///< outline of the next best view; empty: none is wanted
  std::vector<Vec2> seen_px;    ///< outline of the board in the last frame; empty if not seen
  bool met = false;             ///< the board is seen where it is wanted: only has to be held still
  std::uint16_t views = 0;
  std::uint16_t expected_views = 0;  ///< views at which the claim is expected to be met
  /// Standard deviation of the projection on a grid over the image, row by row from the top left,
  /// in units of the acceptable one: the claim is met where it is at most 1.
  std::uint16_t columns = 0, rows = 0;
  std::vector<float> uncertainty;

  /// Share of the image where the claim is met (1).
  double CertainShare() const {
    double met_count = 0;
    for (const float ratio : uncertainty) met_count += ratio <= 1 ? 1 : 0;
    return uncertainty.empty() ? 0 : met_count / static_cast<double>(uncertainty.size());
  }
};

}  // namespace plumbline::lens
