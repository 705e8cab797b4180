// From the views of a board to a lens that is accepted, or refused with reasons.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "app/lens/lens_fit.h"
#include "app/lens/projection_uncertainty.h"
#include "firmware-like/lens/known_lens.h"

namespace plumbline {

struct CalibrationOptions {
  /// Largest projection uncertainty over the image that is accepted, one standard deviation [px].
  double acceptable_px = 0.5;
  std::optional<double> distance_m;  ///< basis of it; none: infinity
};

struct RefusedFrame {
  std::string name, reason;
};

/// The answer. Where it is not accepted, `reasons` say what an operator should do; the lens is then
/// the best there is, if there is one at all (fx > 0).
struct LensCalibration : KnownLens {
  bool accepted = false;
  std::vector<std::string> reasons;
  bool further_views_help = false;  ///< of a refusal: more or other views can mend every reason
  Board board;
  double rms_px = 0;       ///< a point
  double sigma_px = 0;     ///< a coordinate of a corner
  double board_bow_m = 0;  ///< largest height of the board over its plane
  double coverage = 0;     ///< share of the image's cells that saw a corner
  ProjectionUncertainty uncertainty;
  std::vector<std::string> frames_used;
  std::vector<RefusedFrame> frames_refused;
};

/// Fits, and accepts by what a small RMS does not tell: the projection uncertainty over the image,
/// a lens and a board that stood still from the first view to the last, a board that is bent no
/// further than its model, corners all over the image. Errors that all views share (an uneven
/// print) widen the covariance, and so does what may have moved too little to be told.
/// @param views  in order of time
LensCalibration CalibrateLens(const Board& board, std::span<const BoardView> views, ImageSize size,
                              const CalibrationOptions& options = {});

}  // namespace plumbline
