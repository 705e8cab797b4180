// The calibration library mrcal as a peer, on the same corners.
#pragma once

#include <optional>
#include <span>

#include "app/base/target/board.h"
#include "app/vision/lens/board_view.h"
#include "app/vision/lens/lens_model.h"
#include "firmware-like/image/image_size.h"

namespace plumbline {

struct MrcalFit {
  lens::Lens lens;
  double fx_sd =
      0;  ///< claimed, its way: by the noise of the observations as the residuals tell it
};

/// Solves with mrcal's defaults for calibrating a camera (all parameters of its OpenCV5 model,
/// poses, a board that may be bowed, regularisation, no outliers), from the lens and the poses
/// given.
/// @return  nothing where the build has no mrcal, or where it does not solve
std::optional<MrcalFit> SolveWithMrcal(const target::Board& board,
                                       std::span<const vision::BoardView> views,
                                       image::ImageSize size, const lens::Lens& start,
                                       std::span<const Pose> X_CK);

/// Whether the build found it.
bool HasMrcal();

}  // namespace plumbline
