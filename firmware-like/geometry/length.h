// Lengths of the files in SI.
#pragma once

namespace plumbline {

inline constexpr double kMetrePerMm = 1e-3;
inline constexpr double kMmPerMetre = 1e3;

}  // namespace plumbline
