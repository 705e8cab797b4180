// Selection of the views of a capture that take part in a lens calibration.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "app/vision/lens/board_view.h"
#include "app/vision/lens/calibration.h"
#include "app/vision/lens/capture_diagnosis.h"

namespace plumbline::vision {

inline constexpr const char* kDoesNotFit =
    "does not fit the other views: moved, or detected wrongly";

/// The views without those that are far more blurred than the others.
std::vector<BoardView> RemoveBlurred(std::span<const BoardView> views,
                                     std::vector<RefusedFrame>& refused);

/// Removes the views with these indices, which are ascending.
void RemoveViews(const std::vector<std::size_t>& indices, const std::string& why,
                 std::vector<BoardView>& views, std::vector<RefusedFrame>& refused);

/// Share of the image's cells in which a corner was seen.
double Coverage(std::span<const BoardView> views, image::ImageSize size);

/// Variance of a corner's coordinate that is common to all views: errors of the print and board
/// shape beyond the model.
double SharedVariance(const LensFit& fit);

/// Fit of all views that were not detected wrongly, and their consistency.
struct ConsistentFit {
  LensFit fit;
  ViewConsistency consistency;
};

/// Removes views that were detected wrongly until none is left.
Result<ConsistentFit> FitConsistentViews(const target::Board& board, image::ImageSize size,
                                         std::vector<BoardView>& kept,
                                         std::vector<RefusedFrame>& refused);

/// Names of the views after the last one that is used: nothing shows the state of the lens then.
std::vector<std::string> UnusedAtTheEnd(std::span<const BoardView> views,
                                        std::span<const BoardView> kept);

}  // namespace plumbline::vision
