// Pose estimation of a tag, or of a body of several tags, from corners.
//
// Frames: C camera; M marker: origin at the tag's centre, x to its right, y downwards as seen
// upright, z into it, so that a tag that faces the camera upright has the identity rotation.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "app/vision/tracking/corner_refinement.h"
#include "firmware-like/geometry/pose.h"
#include "firmware-like/lens/known_lens.h"

namespace plumbline::vision {

using Mat6 = Eigen::Matrix<double, 6, 6>;
using PoseByLens = Eigen::Matrix<double, 6, lens::kLensParameters>;

/// The four corners of a tag in the frame of the body (or tag) K and in the image.
struct CornerSet {
  std::array<Vec3, 4> p_K;  ///< [m]
  Corners pixels;
  CornersCovariance covariance;  ///< [px^2]
};

/// The corners of a tag in its own frame M, clockwise from the top left [m].
std::array<Vec3, 4> CornersInTag(double side_m);

/// An estimated pose with its covariance.
struct PoseEstimate {
  Pose X_CK;
  /// Of (delta, phi) with X = (exp([phi]x) R_CK, p_CK + delta), both in the camera's axes
  /// [m^2, m rad, rad^2]. From corner noise and, if given, the lens covariance.
  Mat6 covariance = Mat6::Zero();
  /// Derivative of (delta, phi) with respect to the lens at fixed corners: the error that two poses
  /// from one image have in common.
  PoseByLens by_lens = PoseByLens::Zero();
  /// Covariance of (delta, phi) that an error of 1 m^2 per axis in each tag's declared position in
  /// K would cause, with the errors of different tags independent: sum A A^T, with A the derivative
  /// with respect to one tag's position. Not included in `covariance`.
  Mat6 unit_position_covariance = Mat6::Zero();
  double chi2 = 0;  ///< squared reprojection error, normalized by the corners' covariance
  int degrees_of_freedom = 0;  ///< coordinates minus six
};

/// Covariance of a point fixed in K, in the camera's axes [m^2].
Mat3 PointCovariance(const PoseEstimate& estimate, const Vec3& p_KQ);

/// The two poses of a flat square that are consistent with its corners
/// [T. Collins, A. Bartoli, Infinitesimal plane-based pose estimation, IJCV 109 (2014)].
/// @param normalised  normalized image coordinates of the corners (1)
/// @return            the one with the smaller reprojection error first; empty if the corners are
///                    degenerate
std::vector<Pose> PosesOfSquare(const std::array<lens::Vec2, 4>& normalised, double side_m);

/// Minimizes chi2 from a start by Levenberg-Marquardt.
/// @return  nullopt unless it converges with every corner in front of the camera
std::optional<PoseEstimate> RefinePose(const lens::KnownLens& lens,
                                       const std::vector<CornerSet>& sets, const Pose& start);

/// The best pose and, if there is a second minimum, the next best.
struct PosePair {
  PoseEstimate best;
  std::optional<PoseEstimate> other;

  /// True if the corners do not separate the two poses: the chi2 of the other is larger by less
  /// than 16, in units of the best one's reduced chi2 (a likelihood ratio of 3000).
  bool ambiguous() const;
};

/// Refines each start; minima within 3 standard deviations of each other count as one.
std::optional<PosePair> BestPoses(const lens::KnownLens& lens, const std::vector<CornerSet>& sets,
                                  const std::vector<Pose>& starts);

/// Both poses of a single tag. @return  nullopt if its corners are not those of a square, clockwise
std::optional<PosePair> PosesOfTag(const lens::KnownLens& lens, const Corners& pixels,
                                   const CornersCovariance& covariance, double side_m);

/// Rotation angle between two poses [rad].
double AngleBetween(const Pose& a, const Pose& b);

}  // namespace plumbline::vision
