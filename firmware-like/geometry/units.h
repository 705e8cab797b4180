// Conversion factors of lengths and angles.
#pragma once

#include <numbers>

namespace plumbline {

inline constexpr double kMetrePerMm = 1e-3;
inline constexpr double kMmPerMetre = 1e3;

inline constexpr double kRadPerDeg = std::numbers::pi / 180;
inline constexpr double kDegPerRad = 180 / std::numbers::pi;

}  // namespace plumbline
