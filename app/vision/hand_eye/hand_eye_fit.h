// Joint least-squares adjustment of camera pose, target pose, lens, joint offsets and robot poses.
#pragma once

#include <vector>

#include "app/vision/hand_eye/linear_hand_eye.h"

namespace plumbline::vision {

/// Parameters shared by all views, in this order; the joint offsets are last.
enum HandEyeShared : int {
  kCameraPosition = 0,  ///< 3: p of Y [m]
  kCameraRotation = 3,  ///< 3: Y.R exp(w) [rad]
  kTargetPosition = 6,
  kTargetRotation = 9,
  kTargetSize = 12,  ///< true size of the target / declared size, minus 1
  kLensFirst = 13,   ///< 9: in the order of LensCovariance
  kOffsetFirst = 22  ///< kMaxJoints: added to the joints [rad]
};
inline constexpr int kHandEyeShared = kOffsetFirst + model::kMaxJoints;
using HandEyeMatrix = Eigen::Matrix<double, kHandEyeShared, kHandEyeShared>;

/// Ratio of a robot's position errors to its flange rotation errors [m]: a joint error displaces
/// the flange in proportion to the joint's distance from it.
inline constexpr double kRotationLever_m = 1;

/// Standard deviations of the noise in corners and robot poses. Position and rotation of a pose
/// form one variance component, robot_m = kRotationLever_m robot_rad: a few images cannot separate
/// them, and a wrong lens would be mistaken for rotation errors.
struct HandEyeNoise {
  double corner_px = 0.3;
  double robot_m = 1e-3;
  double robot_rad = 1e-3 / kRotationLever_m;
};

/// Current estimates.
struct HandEyeState {
  HandEyePoses poses;
  double size = 1;
  lens::Lens lens;
  model::JointVector offsets;  ///< [rad]; empty if the joints are unknown
  std::vector<Pose> errors;    ///< robot pose error E_k of each view
};

/// Prior on lens, size and joint offsets. Its inverse covariance is zero for the poses.
struct HandEyePrior {
  HandEyeMatrix information = HandEyeMatrix::Zero();
  std::array<bool, kHandEyeShared> active{};  ///< estimated parameters
  lens::Lens lens;                            ///< mean
};

/// Prior for the given options. A free lens has its own covariance; a parameter of zero variance
/// stays fixed, and a lens without any covariance gets weak priors. The prior standard deviation of
/// a free size is 10 %, that of free joint offsets 10 mrad; the offsets of the first and the last
/// joint are equivalent to rotations of Y and X and stay fixed.
/// @param joints  0 if only poses are known
HandEyePrior MakePrior(const lens::KnownLens& lens, const HandEyeOptions& options, int joints);

struct HandEyeFit {
  bool converged = false;
  double cost = 0;  ///< the sum below
  HandEyeMatrix covariance = HandEyeMatrix::Zero();
  double rms_px = 0;                ///< per point
  std::vector<double> view_rms_px;  ///< per point
  /// Robot error of each view in units of its standard deviation, RMS over three axes.
  std::vector<double> position_misfit, rotation_misfit;
  /// Variance components from this fit: sums of squares over their redundancy [W. Foerstner 1979].
  HandEyeNoise noise;
};

/// Pose of the target in C through the robot:
///   eye to hand: X_CK = Y^-1 X_BF E X;   eye in hand: X_CK = Y^-1 E X_BF^-1 X
/// @param E  the robot's pose error at the flange; the identity for the pose as reported
Pose ChainPose(const HandEyeOptions& options, const HandEyePoses& poses, const Pose& X_BF,
               const Pose& E);

/// Pose of the flange as reported by the robot, with `offsets` added to its joints.
Pose FlangePose(const HandEyeOptions& options, const HandEyeView& view,
                const model::JointVector& offsets);

/// Levenberg-Marquardt on
///   sum |pixel - Project(lens, Y^-1 A_k(q + offsets) E_k X size p_K)|^2 / corner^2 (Huber at 3)
///   + sum |E_k|^2 / robot^2 + prior(lens, size, offsets),
/// with the errors E_k eliminated view by view (Schur complement).
/// @param state  initial values on input, the solution on output
HandEyeFit FitHandEye(const std::vector<HandEyeView>& views, const HandEyeOptions& options,
                      const HandEyePrior& prior, const HandEyeNoise& noise, HandEyeState& state);

}  // namespace plumbline::vision
