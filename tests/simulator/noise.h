// Measurement noise: normal, heavy-tailed, correlated along the rows, directional (laser tracker),
// and outliers.
#pragma once

#include "tests/simulator/design.h"

namespace simulator {

struct Noise {
  bool heavy_tails = false;  ///< Student's t with 3 degrees of freedom
  double ar1 = 0.0;          ///< correlation of consecutive rows, per axis
  bool tracker = false;      ///< grows with the distance from the tracker; small along its beam
  double outliers = 0.0;     ///< fraction of the rows, displaced by 10 to 100 sigma
  bool runs = false;         ///< outliers in runs of 3 to 7 consecutive rows, one direction per run
};

/// Adds noise to the true tips. Its mean square per axis over all rows is sigma^2.
/// @return the file lines of the outliers (the header is line 1)
std::vector<int> Measure(const Cell& cell, const Noise& noise,
                         const std::vector<Eigen::Vector3d>& truth_m, Table& measured,
                         Generator& random);

/// Adds rotation noise of sigma_rad on each axis to the true orientations.
void MeasureAxes(const Cell& cell, const std::vector<Eigen::Matrix3d>& truth, Table& measured,
                 Generator& random);

}  // namespace simulator
