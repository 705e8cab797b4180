// One tip of what several cameras measured at once.
#pragma once

#include <span>

#include "firmware-like/geometry/pose.h"
#include "firmware-like/model/plc_command.h"

namespace plumbline {

/// The tool's tip by one camera, in the measurement frame W.
struct MeasuredTip {
  Vec3 p_W = Vec3::Zero();
  Mat3 covariance_W = Mat3::Zero();  ///< N: by the image's noise and the lens [m^2]
  Mat3 places_W = Mat3::Zero();      ///< D: besides, by errors of the tags' declared places [m^2]
};

struct TipFusion {
  MeasuredTip tip;
  bool agree = true;  ///< what they differ by is explained by N + D
};

/// The mean of measurements whose noise is independent, weighed by it:
///   N = (sum_k N_k^-1)^-1,  W_k = N N_k^-1,  p = sum_k W_k p_k,  D = sum_k W_k D_k W_k^T
/// One measurement, not two: what the robot does not repeat and the model does not hold is the same
/// in both, and would be counted twice. Each camera is weak along its own view; together they are
/// not. D takes no part in the weights, as it takes none in the journal: it is a bias, and what
/// compares probes with each other wants the least noise.
///   chi^2 = (p_a - p_b)^T (N_a + D_a + N_b + D_b)^-1 (p_a - p_b)
/// @param tips  at least one; of one it is that one
/// @return      agree is false where chi^2 of two of them is above kTipsDisagree: one is wrong, and
///              nobody knows which
TipFusion FuseTips(std::span<const MeasuredTip> tips);

/// The value that chi^2 with 3 degrees of freedom exceeds once in 100,000.
inline constexpr double kTipsDisagree = 25.9;

}  // namespace plumbline
