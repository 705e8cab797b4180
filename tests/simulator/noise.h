// How an instrument errs: normal noise, heavy tails, correlation along the rows, a tracker's
// directions, outliers.
#pragma once

#include "tests/simulator/design.h"

namespace simulator {

struct Noise {
  bool heavy_tails = false;  ///< Student's t with 3 degrees of freedom
  double ar1 = 0.0;          ///< correlation of consecutive rows, each axis by itself
  bool tracker = false;      ///< grows with the distance from a tracker; small along its beam
  double outliers = 0.0;     ///< share of the rows, 10 to 100 sigma off
  bool runs = false;         ///< outliers in runs of 3 to 7 consecutive rows, a direction each
};

/// Adds the noise to the true tips. Over all rows its mean square on one axis is sigma^2.
/// @return the file lines of the outliers (the header is line 1)
std::vector<int> Measure(const Cell& cell, const Noise& noise,
                         const std::vector<Eigen::Vector3d>& truth_m, Table& measured,
                         Generator& random);

}  // namespace simulator
