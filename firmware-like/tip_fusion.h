// Fusion of tip positions that several cameras measured at the same time.
#pragma once

#include <span>

#include "firmware-like/geometry/pose.h"
#include "firmware-like/model/plc_command.h"

namespace plumbline {

/// Tool tip measured by one camera, in the measurement frame W.
struct MeasuredTip {
  Vec3 p_W = Vec3::Zero();               ///< [m]
  Mat3 covariance_W = Mat3::Zero();      ///< N: due to image noise and the lens [m^2]
  Mat3 tag_covariance_W = Mat3::Zero();  ///< D: due to errors in the declared tag positions [m^2]
};

struct TipFusion {
  MeasuredTip tip;
  bool agree = true;  ///< the differences between cameras are explained by N + D
};

/// Mean of measurements with independent noise, weighted by their information:
///   N = (sum_k N_k^-1)^-1,  W_k = N N_k^-1,  p = sum_k W_k p_k,  D = sum_k W_k D_k W_k^T
/// The result counts as one measurement, not several, because the robot's repeatability and the
/// model's error are common to all cameras. A camera is least accurate along its viewing direction;
/// cameras with different directions compensate for this. D does not enter the weights (nor the
/// journal): it is a bias, and comparisons between probes require the smallest noise.
///   chi^2 = (p_a - p_b)^T (N_a + D_a + N_b + D_b)^-1 (p_a - p_b)
/// @param tips  1..kMaxCameras tips; a single one is returned unchanged
/// @return      `agree` is false if chi^2 of any pair exceeds kTipAgreementLimit (one of the two is
///              wrong, but it is unknown which), or if a covariance is not invertible
TipFusion FuseTips(std::span<const MeasuredTip> tips);

/// chi^2 with 3 degrees of freedom exceeds this value with probability 1e-5.
inline constexpr double kTipAgreementLimit = 25.9;

}  // namespace plumbline
