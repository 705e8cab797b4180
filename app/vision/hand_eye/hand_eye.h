// Hand-eye calibration: pose of a camera on the flange (eye in hand) or in the cell (eye to hand).
//
// Frames: B robot base, F flange, C camera, K target (a board, or a body of tags).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/vision/tracking/tag_pose.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/kinematics/chain.h"

namespace plumbline::vision {

enum class HandEyeSetup {
  kEyeToHand,  ///< the camera is fixed in the cell, the robot carries the target
  kEyeInHand,  ///< the robot carries the camera, the target is fixed in the cell
};

/// One image of the target with the robot's pose.
struct HandEyeView {
  std::string name;
  std::vector<Vec3> points_K;      ///< [m]
  std::vector<lens::Vec2> pixels;  ///< of the same points
  Pose X_BF;                       ///< as reported by the robot; computed from `q` if that is given
  model::JointVector q;            ///< [rad] or [m]; empty if only the pose is known
};

struct HandEyeOptions {
  HandEyeSetup setup = HandEyeSetup::kEyeToHand;
  image::ImageSize image;
  /// Estimate the lens too, with its covariance as the prior; weak priors if that is zero.
  bool free_lens = false;
  /// Estimate the target's size too, which the robot's motion determines. Otherwise a size that
  /// contradicts the motion is a reason to refuse.
  bool free_size = false;
  /// Estimate joint offsets too (views with `q` only), except those of the first and the last
  /// joint, which the poses of camera and target absorb.
  const kinematics::Chain* chain = nullptr;
  bool free_joints = false;
  /// The target looks the same after half a turn, so its points may be numbered from either end.
  bool half_turn_symmetric = false;
  /// Largest acceptable standard deviation, in B or F, of a point the camera sees at the mean
  /// distance [m].
  double acceptable_m = 0.5e-3;
};

struct PoseWithCovariance {
  Pose X;
  Mat6 covariance = Mat6::Zero();  ///< of position and rotation about the pose's own axes [m, rad]
};

/// Prediction error on held-out images.
struct HandEyeError {
  double rms_px = 0;  ///< per point
  /// Distance between the target's centre predicted through the robot and that measured in the
  /// image alone, in C, RMS.
  double position_m = 0;
};

struct RefusedView {
  std::string name, reason;
};

struct HandEye {
  bool accepted = false;
  std::vector<std::string> reasons;
  PoseWithCovariance camera;                           ///< X_BC, or X_FC for eye in hand
  PoseWithCovariance target;                           ///< X_FK, or X_BK for eye in hand
  lens::KnownLens lens;                                ///< as estimated, or as given
  model::JointVector joint_offsets, joint_offset_sds;  ///< [rad]; empty if not estimated
  double sigma_px = 0;                                 ///< per coordinate of a corner
  double robot_m = 0;  ///< standard deviation of a robot position per axis; see kRotationLever_m
  double size_ratio = 1, size_ratio_sd = 0;  ///< true size of the target / declared size
  double point_sd_m = 0;                     ///< see HandEyeOptions::acceptable_m
  double rms_px = 0;                         ///< per point, with the robot's poses adjusted
  double second_axis_rad = 0;                ///< RMS rotation about the second axis between views
  HandEyeError linear, adjusted;             ///< held out: linear method, full adjustment
  std::vector<std::string> used;
  std::vector<RefusedView> refused;
};

/// Linear initialization (linear_hand_eye.h), then adjustment of all parameters (hand_eye_fit.h).
/// Views that contradict the others are excluded and named. The result is accepted, or refused with
/// advice.
HandEye CalibrateHandEye(std::vector<HandEyeView> views, const lens::KnownLens& lens,
                         const HandEyeOptions& options);

}  // namespace plumbline::vision
