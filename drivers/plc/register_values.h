// Conversions to register values that several blocks of the register map use.
#pragma once

#include <algorithm>
#include <cmath>

#include "drivers/plc/register_map.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::plc {

using Source = const MapSource&;

/// Component k of the orientation in the configured convention: deg, or 1 of a quaternion.
inline double Angle_deg(const Pose& X, Source s, int k) {
  const bool quaternion = s.convention.orientation == OrientationConvention::kQuaternion;
  return (quaternion ? 1 : kDegPerRad) * AnglesFromRotation(X.R, s.convention.orientation)[k];
}

/// A joint value [rad or m] in deg, or in mm for a prismatic joint.
inline double JointInRegisterUnit(Source s, int joint, double value) {
  const bool prismatic = (s.snapshot.prismatic_joints >> joint) & 1;
  return (prismatic ? kMmPerMetre : kDegPerRad) * value;
}

/// Basis of the 95 % radius, at its place in a validity register.
inline int BasisBits(const correction::Correction& correction) {
  return static_cast<int>(correction.basis) << registers::kBasisShift;
}

/// Age of an event in whole milliseconds; 65535: older than that, or it never happened.
inline double Age_ms(Source s, double time_s) {
  constexpr double kMaxAge_ms = 65535;
  const double age_ms = std::floor(1e3 * (s.environment.now_s - time_s));
  return age_ms < kMaxAge_ms ? std::max(0.0, age_ms) : kMaxAge_ms;
}

inline double Number(correction::CorrectionCode code) {
  return static_cast<double>(code);
}

}  // namespace plumbline::plc
