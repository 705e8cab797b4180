// Whether the lens that the views show depends on how the board was held, or on the time.
#pragma once

#include <optional>
#include <span>

#include "app/vision/lens/board_view.h"
#include "app/vision/lens/lens_fit.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::vision {

/// In what the views of a capture differ.
enum class ViewTrait {
  kTime,      ///< steadily
  kLateHalf,  ///< the second half of the views
  kDistance,
  kTiltX,  ///< of the board, to the side
  kTiltY,  ///< up or down
  kTurn,   ///< of the board in its plane, across or along the image
  kPlaceX,
  kPlaceY
};

inline bool IsOfTime(ViewTrait trait) {
  return trait == ViewTrait::kTime || trait == ViewTrait::kLateHalf;
}

/// One lens is the same in every view, whatever the cause of an error. If it depends on a trait w
/// of the views, from -1/2 to 1/2, shared_j = shared + w_j d, the same score test applies as for
/// changes (see CaptureChange), here of all lens parameters at once:
///   S = sum w_j g_j,   V = sum w_j^2 H_j - A C A + prior,   A = sum w_j H_j
/// It is separated into independent directions u_k of the lens, W u_k = m_k V u_k and u^T V u = 1,
/// with W the weight of the lens in the projection: z_k = u_k^T S is standard normal and moves the
/// projection by z_k sqrt(m_k) pixels. Directions beyond what chance brings in any trait of one
/// capture in a hundred are taken to be real.
struct ViewDependence {
  ViewTrait trait = ViewTrait::kTime;  ///< with the largest effect
  double effect_px = 0;  ///< RMS over the image, from one end of the trait to the other
  double chi2 = 0;       ///< of its real directions
  /// e e^T, with e = +-d / 2 - C A d the larger error of the fitted lens at either end.
  LensMatrix covariance = LensMatrix::Zero();
};

/// @param views     the views of `fit`, in order of time
/// @param lens      that of the fit
/// @param widening  factor on the covariance for correlated corner errors
/// @return          nothing if no trait has a real effect
std::optional<ViewDependence> DependenceOnViews(const LensFit& fit,
                                                std::span<const BoardView> views,
                                                const lens::Lens& lens, const target::Board& board,
                                                image::ImageSize size, double widening);

}  // namespace plumbline::vision
