// Universal Robots: URScript (.script, .urscript) and PolyScope programs (.urp).
#pragma once

#include "app/programs/brand.h"

namespace plumbline::programs {

/// URScript is read; a PolyScope program is refused, since it holds joint angles in a compressed
/// file that the robot runs in place of the script beside it.
const Brand& UniversalRobots();

}  // namespace plumbline::programs
