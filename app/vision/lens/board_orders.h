// Order of a symmetric board's points in each view: which way round the board was held.
#pragma once

#include <span>

#include "app/vision/lens/board_view.h"
#include "app/vision/lens/capture_diagnosis.h"
#include "app/vision/lens/lens_fit.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::vision {

/// Renumbers the points of views in which the board was held another way round than in most, if the
/// residuals show it. A board without a mark looks the same after half a turn, a square one often
/// after a quarter, so that the order of its points is a discrete unknown of each view. It does not
/// matter on a flat and true board, but one that is S-shaped or unevenly printed would seem to be a
/// different board in each order.
///
/// The displacements d of the board's points, the lens l, the poses a_j and the turns g_j are
/// fitted together, linearly about the fit,
///   r_j = A_j a_j + L_j l + D_j P(g_j) d + e_j,
/// with r_j the residuals of view j and P the permutation and rotation by a turn: alternately d and
/// l for given turns, and the best turn of each view for given d and l, from several starts. The
/// turns are adopted if
///  - they more than halve the squared residuals of the renumbered views, d and l fitted in both
///    cases: otherwise the board explains less than remains, and the order hardly matters; and
///  - the views predict each other. With c_j the residual of view j along the difference that its
///    turn makes according to the other views, scaled to +1 for its turn and -1 for the other one,
///    w_j the information about it, and s_j = -1 for the renumbered views and 1 for the others,
///      n / 2 ln(min_m sum w_j (s_j c_j - m)^2 / min_m sum w_j (c_j - m)^2) > n ln(orders) + 5,
///    n = (sum w_j)^2 / sum w_j^2. The scatter between views takes the place of the corners' noise,
///    because the residuals within a view are correlated; ln(orders) is the price of choosing.
/// @param fit          of `views`
/// @param consistency  corners used, and noise of each view
/// @return             whether any view was renumbered; `fit` no longer belongs to them then
bool RenumberToOneOrder(const target::Board& board, image::ImageSize size, const LensFit& fit,
                        const ViewConsistency& consistency, std::span<BoardView> views);

}  // namespace plumbline::vision
