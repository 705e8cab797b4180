// Value ranges shared by several file formats.
#pragma once

#include "app/config/toml_reader.h"
#include "firmware-like/loads/gravity.h"

namespace plumbline::config {

inline constexpr double kSecondPerMs = 1e-3;

/// Positions and orientations in the cell.
inline constexpr NumberRange kPlaceRange{-100000, 100000, kMetrePerMm};
inline constexpr NumberRange kTurnRange{-360, 360, kRadPerDeg};

}  // namespace plumbline::config
