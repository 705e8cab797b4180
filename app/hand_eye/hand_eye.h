// Camera and robot calibrated against each other: where the camera is, on the flange or in the
// cell.
//
// Frames: B robot base, F flange, C camera, K target (a board, or a body of tags).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/tracking/tag_pose.h"
#include "firmware-like/kinematics/chain.h"

namespace plumbline {

enum class HandEyeSetup {
  kEyeToHand,  ///< the camera stands in the cell, the robot carries the target
  kEyeInHand,  ///< the robot carries the camera, the target stands in the cell
};

/// One image of the target and where the robot stood.
struct HandEyeView {
  std::string name;
  std::vector<Vec3> points_K;  ///< [m]
  std::vector<Vec2> pixels;    ///< of the same points
  Pose X_BF;                   ///< as the robot reports it; with joints, found from `q`
  JointVector q;               ///< [rad] or [m]; empty where only the pose is known
};

struct HandEyeOptions {
  HandEyeSetup setup = HandEyeSetup::kEyeToHand;
  ImageSize image;
  /// The lens is adjusted with its covariance as what is known before; where that is zero, weak
  /// priors stand in its place.
  bool free_lens = false;
  /// The target's size is adjusted too: the robot's motion tells it. Else a size that contradicts
  /// the motion is a reason to refuse.
  bool free_size = false;
  /// Joint offsets are adjusted too (views with `q` only); the first and the last joint's are not,
  /// the poses of camera and target take them up.
  const Chain* chain = nullptr;
  bool free_joints = false;
  /// The target's points may stand for half a turn of it: a board that looks the same so.
  bool half_turns = false;
  /// Largest deviation of a point that the camera sees at the mean distance, in B or F [m].
  double acceptable_m = 0.5e-3;
};

/// A pose that was found, and what is known of it.
struct FoundPose {
  Pose X;
  Mat6 covariance = Mat6::Zero();  ///< of the place, and of the turn about its own axes [m, rad]
};

/// How well images that took no part are foretold.
struct HandEyeError {
  double rms_px = 0;      ///< a point
  double position_m = 0;  ///< of the target's middle in C, by chain against by image alone; RMS
};

struct RefusedView {
  std::string name, reason;
};

struct HandEye {
  bool accepted = false;
  std::vector<std::string> reasons;
  FoundPose camera;                             ///< X_BC, or X_FC of an eye in hand
  FoundPose target;                             ///< X_FK, or X_BK of an eye in hand
  KnownLens lens;                               ///< as adjusted, or as given
  JointVector joint_offsets, joint_offset_sds;  ///< [rad]; empty where not adjusted
  double sigma_px = 0;                          ///< of a corner's coordinate
  double robot_m = 0;  ///< deviation of a robot pose, one axis; of its turn see kTurnLever_m
  double size_ratio = 1, size_ratio_sd = 0;  ///< the target's true size over the told one
  double point_sd_m = 0;                     ///< see acceptable_m
  double rms_px = 0;                         ///< of a point, the robot's poses adjusted
  double second_turn_rad = 0;                ///< RMS turn about the second axis between views
  HandEyeError linear, adjusted;             ///< held out: by the linear method, and by all
  std::vector<std::string> used;
  std::vector<RefusedView> refused;
};

/// Linear start (linear_hand_eye.h), then one adjustment of everything (hand_eye_fit.h); views that
/// contradict the others are left out by name; accepted, or refused with what to do.
HandEye CalibrateHandEye(std::vector<HandEyeView> views, const KnownLens& lens,
                         const HandEyeOptions& options);

}  // namespace plumbline
