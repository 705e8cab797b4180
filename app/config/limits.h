// Limits that more than one file format knows.
#pragma once

#include "app/config/toml_reader.h"
#include "firmware-like/loads/gravity.h"

namespace plumbline {

inline constexpr double kSecondPerMs = 1e-3;

/// Where a thing of the cell may be, and how it may be turned.
inline constexpr NumberRange kPlaceRange{-100000, 100000, kMetrePerMm};
inline constexpr NumberRange kTurnRange{-360, 360, kRadPerDeg};

}  // namespace plumbline
