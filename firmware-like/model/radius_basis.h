// What a stated 95 % radius rests on.
#pragma once

#include <algorithm>
#include <cstdint>

namespace plumbline {

/// Basis of an expanded uncertainty, weakest first: a greater one rests on more evidence. The
/// numbers are those of the register map.
enum class RadiusBasis : std::uint8_t {
  kUnknown = 0,     ///< a source of error has neither a declaration nor a prior; do not rely on it
  kAssumed = 1,     ///< typical values: priors for what the cell does not declare
  kPropagated = 2,  ///< from a parameter covariance, or a deviation that was declared
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

/// A radius [m] that holds 95 % of the landings, never without its basis.
struct StatedRadius {
  double radius_m = 0;
  RadiusBasis basis = RadiusBasis::kUnknown;
  bool known() const { return radius_m > 0; }
};

/// Deviation of each declared deflection, as a share of it.
struct DeclaredDeviation {
  double share = 0.1;
  bool stated = false;  ///< by the configuration; otherwise a typical value
};

/// The weaker of two.
constexpr RadiusBasis Weakest(RadiusBasis a, RadiusBasis b) {
  return std::min(a, b);
}

}  // namespace plumbline
