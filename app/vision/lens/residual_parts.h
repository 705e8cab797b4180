// Residuals of a lens fit by what they belong to: the image, the board, a view, or the detector.
#pragma once

#include <span>

#include "app/vision/lens/board_view.h"
#include "app/vision/lens/lens_fit.h"
#include "app/vision/lens/usable_region.h"
#include "app/vision/lens/view_consistency.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::vision {

/// Standard deviations of the parts of the residuals, of a corner's coordinate [px]:
///   r_jk = f(cell of the image) + b_k + v_jk + noise,   view j, board point k
/// Two residuals of different views share f if they lie in one cell of the image, and b if they are
/// of one board point; their mean product is the variance of that part, whatever v is. The
/// remainder of the variance beyond the detector's noise differs from view to view. Whether the
/// image has a part at all is decided by random signs of the views, which keep what residuals of
/// one view share. The points of a board that hardly moves stay in the same cells: errors of its
/// print then pass for a part of the image as well.
struct ResidualParts {
  double noise_px = 0;  ///< of the detector, see ViewConsistency
  double image_px = 0;  ///< fixed in the image: a drop, a windscreen, distortion the model lacks
  double board_px = 0;  ///< fixed on the board: its print or shape
  double view_px = 0;   ///< of a view: motion, air, focus
  /// Mean number of corners of all views in a cell of the image.
  double corners_per_cell = 0;
  /// Root mean square displacement of the field fixed in the image at its worst place within each
  /// candidate radius, both coordinates together [px]. Of a cell with a median m over the views, of
  /// variance s^2, and variance t^2 of the field over the image,
  ///   E |f|^2 = |m t^2 / (t^2 + s^2)|^2 + t^2 s^2 / (t^2 + s^2)
  /// where chance makes no such |m| in the cells of one capture in a hundred, |m|^2. Corners that
  /// the fit excludes count here: behind a drop they are outliers in every view.
  RadiusErrors field_px{};
};

ResidualParts PartsOf(const LensFit& fit, const ViewConsistency& consistency,
                      std::span<const BoardView> views, image::ImageSize size);

/// Factor on the covariance of the lens for the part that is fixed in the image, which is common to
/// all corners of a cell.
/// @param sigma_px  of a corner's coordinate, from the residuals
/// @param unit_px   standard deviation for which the covariance is stated
double WideningByImage(const ResidualParts& parts, double sigma_px, double unit_px);

}  // namespace plumbline::vision
