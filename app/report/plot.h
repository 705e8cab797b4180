// What all panels share: size, type, colours, data blocks.
#pragma once

#include <fmt/format.h>

#include <string>
#include <vector>

#include "app/report/gnuplot.h"

namespace plumbline::plot {

inline constexpr const char* kAccent = "#0b6e8f";
inline constexpr const char* kInk = "#25313a";
inline constexpr const char* kGrey = "#a9b4bb";
inline constexpr const char* kFaint = "#d5dce0";

inline constexpr const char* kAxisNames[] = {"x", "y", "z"};

/// Most points that a panel draws; of more, every k-th.
inline constexpr std::size_t kMostPoints = 800;

/// Start of a panel: a canvas of that many pixels, everything else reset.
std::string Begin(int width, int height);

/// `$name << EOD` with one line a row.
std::string Data(const std::string& name, const std::vector<std::vector<double>>& rows);

/// The step that keeps `count` points below the most.
inline std::size_t Stride(std::size_t count) {
  return count <= kMostPoints ? 1 : (count + kMostPoints - 1) / kMostPoints;
}

/// The largest of 1, 2, 5 times a power of ten that is not above value.
double RoundDown(double value);

}  // namespace plumbline::plot
