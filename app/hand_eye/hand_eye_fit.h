// Camera, target, lens, joint offsets and each robot pose adjusted together.
#pragma once

#include <vector>

#include "app/hand_eye/linear_hand_eye.h"

namespace plumbline {

/// Parameters that all views share, in this order; then the joint offsets.
enum HandEyeShared : int {
  kCameraPlace = 0,  ///< 3: p of Y [m]
  kCameraTurn = 3,   ///< 3: Y.R exp(w) [rad]
  kTargetPlace = 6,
  kTargetTurn = 9,
  kTargetSize = 12,  ///< the target's true size over the told one, less 1
  kLensFirst = 13,   ///< 9: in the order of LensCovariance
  kOffsetFirst = 22  ///< kMaxJoints: added to the joints [rad]
};
inline constexpr int kHandEyeShared = kOffsetFirst + kMaxJoints;
using HandEyeMatrix = Eigen::Matrix<double, kHandEyeShared, kHandEyeShared>;

/// A robot's place errs by what its flange's turn errs times about this lever: an error of the
/// joints moves a flange by their distance from it [m].
inline constexpr double kTurnLever_m = 1;

/// What is known of the noise: of the corners, and of the robot's poses. Place and turn of a pose
/// are one component, robot_m = kTurnLever_m robot_rad: a few images do not tell them apart, and a
/// wrong lens would be taken for turns.
struct HandEyeNoise {
  double corner_px = 0.3;
  double robot_m = 1e-3;
  double robot_rad = 1e-3 / kTurnLever_m;
};

/// The present values.
struct HandEyeState {
  HandEyePoses poses;
  double size = 1;
  Lens lens;
  JointVector offsets;       ///< [rad]; empty where no joints are known
  std::vector<Pose> errors;  ///< E_k of each view
};

/// What is known beforehand of lens, size and offsets: inverse covariance of those parameters, zero
/// for the poses, which nothing is known of. A parameter that is not adjusted is not `active`.
struct HandEyePrior {
  HandEyeMatrix information = HandEyeMatrix::Zero();
  std::array<bool, kHandEyeShared> active{};
  Lens lens;  ///< that the information is about
};

/// The lens within its covariance where it is free (a term without deviation stays as it is, a lens
/// without any gets weak priors), the size within 10 % where it is, the offsets of the joints but
/// the first and the last within 10 mrad where they are: those two turn what Y and X stand in.
/// @param joints  0 where only poses are known
HandEyePrior PriorOf(const KnownLens& lens, const HandEyeOptions& options, int joints);

struct HandEyeFit {
  bool converged = false;
  double cost = 0;  ///< the sum below
  HandEyeMatrix covariance = HandEyeMatrix::Zero();
  double rms_px = 0;                ///< a point
  std::vector<double> view_rms_px;  ///< a point
  /// Each view's robot error in its own deviations: place and turn, RMS over three axes.
  std::vector<double> place_misfit, turn_misfit;
  /// Variance components by this fit: observed squares over their redundancy [W. Foerstner 1979].
  HandEyeNoise noise;
};

/// Where the chain puts the target in C:
///   eye to hand: X_CK = Y^-1 X_BF E X;   eye in hand: X_CK = Y^-1 E X_BF^-1 X
/// @param E  the robot's error at its flange; identity: as it reports
Pose ChainPose(const HandEyeOptions& options, const HandEyePoses& poses, const Pose& X_BF,
               const Pose& E);

/// The flange as the robot reports it, its joints moved by `offsets`.
Pose FlangePose(const HandEyeOptions& options, const HandEyeView& view, const JointVector& offsets);

/// Least squares by Levenberg and Marquardt over
///   sum |pixel - Project(lens, Y^-1 A_k(q + offsets) E_k X size p_K)|^2 / corner^2 (Huber at 3)
///   + sum |E_k|^2 / robot^2 + (lens, size, offsets) by the prior,
/// the errors E_k eliminated view by view (Schur).
HandEyeFit FitHandEye(const std::vector<HandEyeView>& views, const HandEyeOptions& options,
                      const HandEyePrior& prior, const HandEyeNoise& noise, HandEyeState& state);

}  // namespace plumbline
