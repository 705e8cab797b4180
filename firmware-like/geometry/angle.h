// Conversion factors between degrees and radians.
#pragma once

#include <numbers>

namespace plumbline {

inline constexpr double kRadPerDeg = std::numbers::pi / 180;
inline constexpr double kDegPerRad = 180 / std::numbers::pi;

}  // namespace plumbline
