// A first guess of the lens and of the board's poses, for the fit to begin from.
#pragma once

#include <span>

#include "app/lens/board.h"
#include "firmware-like/geometry/pose.h"

namespace plumbline {

/// Focal lengths to begin from, best first: the one that makes the columns of all homographies
/// equally long and perpendicular [Z. Zhang, PAMI 22 (2000) 1330, with the principal point in the
/// middle and square pixels], where the views tell one, and a few spread over what lenses have.
std::vector<double> FocalGuesses(const Board& board, std::span<const BoardView> views,
                                 ImageSize size);

/// Both poses of a flat board that a view allows, the better one first [T. Collins and A. Bartoli,
/// Infinitesimal plane-based pose estimation, IJCV 109 (2014)].
std::vector<Pose> BoardPoses(const Board& board, const BoardView& view, const Lens& lens);

}  // namespace plumbline
