// Consistency of the views of a capture: repeated frames, wrong detections, and views that a
// physical change has displaced.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "app/base/target/board.h"
#include "app/vision/lens/board_view.h"
#include "app/vision/lens/lens_fit.h"

namespace plumbline::vision {

/// Residuals of a fit, separated into noise and smooth patterns. The noise is estimated from second
/// differences along rows and columns, because they are insensitive to smooth displacements (a
/// moved lens, a bent board).
struct ViewConsistency {
  double noise_px = 0;                  ///< median over the views, of a coordinate
  std::vector<double> view_noise_px;    ///< per view
  std::vector<std::vector<bool>> used;  ///< corners seen that do not deviate from their neighbours
  std::vector<std::size_t> wrong;       ///< views detected wrongly: rough residuals
  std::vector<std::size_t> displaced;   ///< views that do not fit, but whose residuals are smooth
};
ViewConsistency ConsistencyOf(const target::Board& board, const LensFit& fit,
                              std::span<const BoardView> views);

/// Indices of views whose corners equal those of an earlier view: a driver delivered a frame twice.
std::vector<std::size_t> RepeatedViews(std::span<const BoardView> views);

}  // namespace plumbline::vision
