// Which poses are measured, when, how warm and with what payload.
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
  bool pressure = false;        ///< an air_pressure_bar column
  bool tilt = false;            ///< an inclinometer on the base, tilt_x_deg and tilt_y_deg
  bool steady_rise = false;     ///< the temperature rises in proportion to the time
  double tests_warmer_K = 0.0;  ///< of the test poses, beyond what was measured
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
  Table measured;  ///< xyz still to be filled
  Table tests;
};

/// Poses over one and a half hours of a warming hall, in time's order.
Tables DrawDesign(const Cell& cell, const Design& design, Generator& random);

/// The poses of a file, measured in its order; tests within the range of its joints, with its
/// payloads.
Tables DesignAt(const Table& poses, Cell cell, const Design& design, Generator& random);

}  // namespace simulator
