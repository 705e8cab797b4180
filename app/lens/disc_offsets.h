// Why the centre of a disc's image is not the image of its centre.
#pragma once

#include "app/lens/lens_model.h"

namespace plumbline {

/// For each disc of the board, the centroid of its image less the image of its centre [px]: a
/// tilted disc is seen as an ellipse whose centre lies farther away from the vanishing line, by
/// about f sin(tilt) cos(tilt) (radius / distance)^2, 0.05 px for a disc of 20 px at 30 degrees and
/// 1.2 px for one of 100 px. By projecting the rim through the whole lens, bow included:
///   c = sum (q_i + q_i+1)(q_i x q_i+1) / (3 sum q_i x q_i+1)
/// over a polygon of the disc's second moment.
/// @return  zeros where the board has no discs or is not in front of the camera
std::vector<Vec2> DiscOffsets(const Board& board, const SharedVector& shared, const Pose& X_CK);

}  // namespace plumbline
