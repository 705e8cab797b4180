// Common style and data blocks of all panels.
#pragma once

#include <fmt/format.h>

#include <string>
#include <vector>

#include "app/measure/report/gnuplot.h"

namespace plumbline::plot {

inline constexpr const char* kAccent = "#0b6e8f";
inline constexpr const char* kInk = "#25313a";
inline constexpr const char* kGrey = "#a9b4bb";

inline constexpr const char* kAxisNames[] = {"x", "y", "z"};

/// Maximum number of points in a panel; if there are more, every k-th is drawn.
inline constexpr std::size_t kMaxPoints = 800;

/// Starts a panel: a canvas of that size [px], all other settings reset.
std::string Begin(int width, int height);

/// Data block `$name << EOD` with one line per row.
std::string Data(const std::string& name, const std::vector<std::vector<double>>& rows);

/// Smallest stride that keeps the number of points within the maximum.
inline std::size_t Stride(std::size_t count) {
  return count <= kMaxPoints ? 1 : (count + kMaxPoints - 1) / kMaxPoints;
}

/// Largest number of the form 1, 2 or 5 times a power of ten that is not above `value`.
double RoundDown(double value);

}  // namespace plumbline::plot
