// Other readings of the robot's poses: what a table means if its unit, its orientations or its
// direction are not what they were taken for.
//
// Each reading is solved linearly, with the unit of length as one more unknown. A reading is never
// used, only named.
#pragma once

#include <string>
#include <vector>

#include "app/vision/hand_eye/linear_hand_eye.h"

namespace plumbline::vision {

/// Why the poses do not mean what they were taken for, with the remedy; empty unless another
/// reading fits the images far better.
/// @param views  with their targets' poses in the camera, in `targets`
std::string BetterReadingText(const std::vector<HandEyeView>& views,
                              const std::vector<Pose>& targets, const HandEyeOptions& options);

/// The unit that explains a target `ratio` times larger than declared, or the finding that none
/// does; empty if the ratio may be an error of measurement.
/// @param tolerance  of the logarithm of the ratio
std::string WrongUnitText(double ratio, double tolerance);

}  // namespace plumbline::vision
