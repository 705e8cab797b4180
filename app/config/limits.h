// Limits that more than one file format knows.
#pragma once

namespace plumbline {

/// No robot carries more [kg]: configurations, points and tables refuse a payload beyond it.
inline constexpr double kLargestPayload_kg = 5000;

}  // namespace plumbline
