// What a further view of the board would tell of the lens.
#pragma once

#include <optional>
#include <set>

#include "app/lens/lens_fit.h"
#include "firmware-like/lens/board_prompt.h"

namespace plumbline {

/// Information that a view with the board at X_CK gives on the shared parameters, its pose being
/// free:  sum J_s^T J_s - J_s^T J_p (J_p^T J_p)^-1 J_p^T J_s, over sigma^2.
/// @return  nothing where a corner is behind the camera or the share of corners outside the image
///          is above a tenth
std::optional<SharedMatrix> InformationOfView(const Board& board, const SharedVector& shared,
                                              const Pose& X_CK, ImageSize size, double sigma_px);

/// Where the board would stand if a prompt were followed, by a lens that is roughly known.
Pose PoseOfPrompt(BoardPrompt prompt, const Board& board, const Lens& lens, ImageSize size);

/// The prompt after which the projection would be least uncertain at its worst place, were there
/// one such view more: of tilts, corners, closer, farther.
/// @param avoid  not these: they were asked for and do not come
/// @return       kShowBoard where none is left
BoardPrompt BestPrompt(const Board& board, const LensFit& fit, ImageSize size,
                       const std::set<BoardPrompt>& avoid = {});

}  // namespace plumbline
