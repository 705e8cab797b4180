// Information gain about the lens from one further view of the calibration board.
#pragma once

#include <optional>
#include <set>

#include "app/vision/lens/lens_fit.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/lens/board_prompt.h"

namespace plumbline::vision {

/// Fisher information about the shared parameters from a view of the board at X_CK, whose pose is
/// estimated too:
///   (sum J_s^T J_s - J_s^T J_p (J_p^T J_p)^-1 J_p^T J_s) / sigma^2
/// @return  nullopt if a corner is behind the camera or more than a tenth of the corners lie
///          outside the image
std::optional<SharedMatrix> InformationOfView(const target::Board& board,
                                              const SharedVector& shared, const Pose& X_CK,
                                              image::ImageSize size, double sigma_px);

/// Pose of the board (X_CK) if a prompt is followed; `lens` need only be roughly right.
Pose PoseOfPrompt(lens::BoardPrompt prompt, const target::Board& board, const lens::Lens& lens,
                  image::ImageSize size);

/// The prompt whose view would leave the smallest maximum projection uncertainty in the image;
/// candidates are tilts, image corners, closer and farther.
/// @param avoid  prompts to skip: their view is already covered, or they brought no new view
/// @return       kShowBoard if no candidate remains
lens::BoardPrompt BestPrompt(const target::Board& board, const LensFit& fit, image::ImageSize size,
                             const std::set<lens::BoardPrompt>& avoid = {});

}  // namespace plumbline::vision
