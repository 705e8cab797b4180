// Value ranges shared by several file formats.
#pragma once

#include "app/base/config/toml_reader.h"
#include "firmware-like/loads/gravity.h"

namespace plumbline::config {

inline constexpr double kSecondPerMs = 1e-3;

/// Positions and orientations in the cell.
inline constexpr NumberRange kPlaceRange{-100000, 100000, kMetrePerMm};
inline constexpr NumberRange kTurnRange{-360, 360, kRadPerDeg};

/// Standard deviations of measured positions, and temperatures [deg C].
inline constexpr NumberRange kSigmaRange{1e-6, 100, kMetrePerMm};
inline constexpr NumberRange kTemperatureRange{-50, 150};

/// Largest number of a tool or a payload item: what a register holds.
inline constexpr int kLargestNumber = 65535;

}  // namespace plumbline::config
