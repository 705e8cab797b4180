// Eccentricity of a disc's image: its centroid minus the image of the disc's centre.
#pragma once

#include "app/vision/lens/lens_model.h"

namespace plumbline::vision {

/// For each disc of the board, the centroid of its image minus the image of its centre [px]. A
/// tilted disc appears as an ellipse whose centre is displaced away from the vanishing line by
/// about f sin(tilt) cos(tilt) (radius / distance)^2: 0.05 px for a disc of 20 px at 30
/// degrees, 1.2 px for one of 100 px. Computed by projecting the rim q_i through the complete
/// model, including distortion and board bow:
///   c = sum (q_i + q_i+1)(q_i x q_i+1) / (3 sum q_i x q_i+1)
/// over a polygon with the disc's second moment.
/// @return  zeros if the board has no discs or is not in front of the camera
std::vector<lens::Vec2> DiscOffsets(const target::Board& board, const SharedVector& shared,
                                    const Pose& X_CK);

}  // namespace plumbline::vision
