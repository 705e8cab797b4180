// Limits that more than one file format knows.
#pragma once

#include "app/config/toml_reader.h"

namespace plumbline {

/// No robot carries more [kg]: configurations, points and tables refuse a payload beyond it.
inline constexpr double kLargestPayload_kg = 5000;

inline constexpr double kSecondPerMs = 1e-3;

/// Where a thing of the cell may be, and how it may be turned.
inline constexpr NumberRange kPlaceRange{-100000, 100000, kMetrePerMm};
inline constexpr NumberRange kTurnRange{-360, 360, kRadPerDeg};

}  // namespace plumbline
