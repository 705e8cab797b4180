// Picture of a program's path with the error at its points before and after the correction.
#pragma once

#include <string>

#include "app/programs/correction/program_correction.h"

namespace plumbline::programs {

/// Two views of the path in the robot's base frame, from above and from the side, as inline SVG.
/// Errors are enlarged by a stated factor; empty if no point is corrected.
std::string PathPicture(const ProgramCorrection& correction);

}  // namespace plumbline::programs
