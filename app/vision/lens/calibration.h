// Lens calibration from views of a board: fit, uncertainty and the decision to accept or refuse.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "app/base/target/declared_facts.h"
#include "app/vision/lens/board_view.h"
#include "app/vision/lens/lens_fit.h"
#include "app/vision/lens/projection_uncertainty.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/lens/known_lens.h"

namespace plumbline::vision {

struct CalibrationOptions {
  /// Largest acceptable projection uncertainty over the image, one standard deviation [px].
  double acceptable_px = 0.5;
  std::optional<double> distance_m{};  ///< distance at which it is evaluated; infinity if nullopt
  /// The residuals can still contradict them: the capture is then refused, and the reason says so.
  target::DeclaredFacts declared{};
  /// If the capture does not reach the limit, accept what it proves, up to a four-hundredth of the
  /// image's width; a note says so.
  bool accept_least = false;
};

struct RefusedFrame {
  std::string name, reason;
};

/// Result of a calibration. If it is not accepted, `reasons` say what to do; the lens
/// is then the best available one, if any (fx > 0). If it is accepted for a part of the image only
/// (usable_radius_px), `notes` say so and why.
struct LensCalibration : lens::KnownLens {
  bool accepted = false;
  std::vector<std::string> reasons, notes;
  bool further_views_help = false;  ///< further views can resolve every reason or note
  target::Board board;
  double rms_px = 0;                  ///< per point
  double sigma_px = 0;                ///< per coordinate of a corner
  double board_bow_m = 0;             ///< peak-to-valley deviation of the board from its plane
  Vec3 board_bow = Vec3::Zero();      ///< kBowX, kBowY, kBowXY [1/m]
  double coverage = 0;                ///< share of the image's cells in which a corner was seen
  ProjectionUncertainty uncertainty;  ///< its maximum is that within the usable region
  double everywhere_px = 0;           ///< largest uncertainty over the whole image
  /// If not accepted: the least limit at which it would be, as far as the uncertainty decides;
  /// infinite if there is none [px].
  double least_px = std::numeric_limits<double>::infinity();
  target::DeclaredFacts declared;  ///< facts on which that rests
  std::vector<std::string> frames_used;
  std::vector<RefusedFrame> frames_refused;
};

/// Fits the lens and accepts it by criteria that a small RMS does not guarantee:
///  - the projection uncertainty is acceptable over the image, or over a region of at least half of
///    it;
///  - lens and board did not change between the first and the last view;
///  - the shape of the board is within its model;
///  - corners were seen all over the image.
/// The covariance is widened for errors that all views share (an uneven print) and for changes too
/// small to be detected.
/// @param views  in any order; their times decide which view is the last, since the lens after it
///               is the one that is used. Views of equal time keep the order given.
LensCalibration CalibrateLens(const target::Board& board, std::span<const BoardView> views,
                              image::ImageSize size, const CalibrationOptions& options = {});

}  // namespace plumbline::vision
