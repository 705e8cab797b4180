// Detection of quaternions whose numbers are in another order than the header states.
#pragma once

#include <optional>
#include <string>

#include "app/measure/diagnosis/dataset.h"

namespace plumbline::measure {

/// Finds quaternions whose columns are in the order x, y, z, w, or that are inverse (the
/// measurement frame in the TCP frame). The rotation from one row to the next, in the tool frame,
///   q_k^-1 q_(k+1)
/// does not depend on the instrument's frame, and on the tool only by one constant rotation, which
/// is fitted; it is compared with the rotation of the predicted tip. Both mistakes look alike:
/// (w, x, y, z) -> (x, y, z, w) and the inverse are orthogonal maps of the four numbers with
/// determinant -1, and the product of two such maps is q -> a q b with constant rotations a, b.
/// @return  a sentence with the remedy if the median difference is above 5 deg as written and below
///          1 deg with the inverse; nullopt if not, if no row is a pose, or with fewer than 6 clear
///          rotations
std::optional<std::string> QuaternionsInOtherOrder(const Dataset& data);

}  // namespace plumbline::measure
