// A 95 % radius together with its basis.
#pragma once

#include <algorithm>
#include <cstdint>

namespace plumbline::model {

/// Basis of an expanded uncertainty, weakest first. The numbers are those of the register map.
enum class RadiusBasis : std::uint8_t {
  kUnknown = 0,     ///< an error source has neither a declared value nor a prior; do not rely on it
  kAssumed = 1,     ///< typical values: priors for undeclared parameters
  kPropagated = 2,  ///< propagated from a parameter covariance or a declared deviation
  kMeasured = 3,    ///< validated against held-out measurements
};

/// One word for display, log and files: "unknown", "assumed", "propagated", "measured".
constexpr const char* Describe(RadiusBasis basis) {
  switch (basis) {
    case RadiusBasis::kUnknown:
      return "unknown";
    case RadiusBasis::kAssumed:
      return "assumed";
    case RadiusBasis::kPropagated:
      return "propagated";
    case RadiusBasis::kMeasured:
      return "measured";
  }
  return "unknown";
}

/// Radius [m] of the sphere around the predicted tip that contains 95 % of the attained positions,
/// and its basis.
struct StatedRadius {
  double radius_m = 0;
  RadiusBasis basis = RadiusBasis::kUnknown;
  bool known() const { return radius_m > 0; }
};

/// Standard deviation of each declared deflection, as a fraction of the deflection.
struct DeclaredDeviation {
  double share = 0.1;
  bool stated = false;  ///< from the configuration; otherwise a typical value
};

/// The weaker of two bases.
constexpr RadiusBasis Weakest(RadiusBasis a, RadiusBasis b) {
  return std::min(a, b);
}

}  // namespace plumbline::model
