// Initial guesses for the lens fit: focal lengths and board poses.
#pragma once

#include <span>

#include "app/base/target/board.h"
#include "app/vision/lens/board_view.h"
#include "firmware-like/geometry/pose.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::vision {

/// Candidate focal lengths [px], best first: the one for which the columns of all homographies are
/// equally long and perpendicular [Z. Zhang, PAMI 22 (2000) 1330, with the principal point at the
/// image centre and square pixels], if the views determine one, then a few that cover common
/// lenses.
std::vector<double> FocalGuesses(const target::Board& board, std::span<const BoardView> views,
                                 image::ImageSize size);

/// The two poses of a flat board that are consistent with a view, the better one first [T. Collins
/// and A. Bartoli, Infinitesimal plane-based pose estimation, IJCV 109 (2014)].
std::vector<Pose> BoardPoses(const target::Board& board, const BoardView& view,
                             const lens::Lens& lens);

}  // namespace plumbline::vision
