// Experimental design: measured poses with time, temperature and payload.
#pragma once

#include <random>

#include "tests/simulator/table.h"

namespace simulator {

struct Design {
  int rows = 80;
  int repeats = 16;  ///< repeated visits of some poses, interleaved
  int tests = 300;
  bool dynamic = false;   ///< velocities and accelerations are recorded
  bool vertical = false;  ///< tool pointing down and one payload: few effects are separable
  bool one_payload = false;
  bool pressure = false;        ///< an air_pressure_bar column
  bool tilt = false;            ///< an inclinometer on the base, tilt_x_deg and tilt_y_deg
  bool steady_rise = false;     ///< the temperature rises linearly with time
  double tests_warmer_K = 0.0;  ///< of the test poses, above the measured range
  int sessions = 1;
};

using Generator = std::mt19937_64;

inline double Uniform(Generator& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

inline double Normal(Generator& random) {
  return std::normal_distribution<double>()(random);
}

struct Tables {
  Table measured;  ///< xyz not filled yet
  Table tests;
};

/// Poses over one and a half hours in a warming hall, in chronological order.
Tables DrawDesign(const Cell& cell, const Design& design, Generator& random);

/// The poses of a file in its order; test poses within its joint ranges and with its
/// payloads.
Tables DesignAt(const Table& poses, Cell cell, const Design& design, Generator& random);

}  // namespace simulator
