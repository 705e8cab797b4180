// Which poses are measured, when, how warm, with what payload, and how badly.
#pragma once

#include <random>

#include "tests/simulator/table.h"

namespace simulator {

struct Design {
  int rows = 80;
  int repeats = 16;  ///< second and later visits of some of the poses, in between
  int tests = 300;
  bool dynamic = false;   ///< velocities and accelerations are recorded
  bool vertical = false;  ///< tool straight down and one payload: little can be told apart
  bool one_payload = false;
  bool pressure = false;  ///< an air_pressure_bar column
  int sessions = 1;
  double outliers = 0.0;  ///< share of the rows, 10 to 100 sigma off
  bool heavy_tails = false;
};

using Generator = std::mt19937_64;

inline double Uniform(Generator& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

struct Tables {
  Table measured;  ///< xyz still to be filled
  Table tests;
};

/// Poses over one and a half hours of a warming hall, in time's order.
Tables DrawDesign(const Cell& cell, const Design& design, Generator& random);

/// What the instrument reads. Returns the file lines of the outliers.
std::vector<int> Measure(const Cell& cell, const Design& design,
                         const std::vector<Eigen::Vector3d>& truth_m, Table& measured,
                         Generator& random);

}  // namespace simulator
