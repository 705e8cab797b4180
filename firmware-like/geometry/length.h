// Conversion factors between millimetres and metres.
#pragma once

namespace plumbline {

inline constexpr double kMetrePerMm = 1e-3;
inline constexpr double kMmPerMetre = 1e3;

}  // namespace plumbline
