// The pose of a tag, or of a body of several, from its corners.
//
// Frames: C camera; M marker: origin at the tag's centre, x to its right, y downwards as seen
// upright, z into it, so that a tag that faces the camera upright has the identity rotation.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "app/tracking/corner_refinement.h"
#include "firmware-like/geometry/pose.h"
#include "firmware-like/lens/known_lens.h"

namespace plumbline {

using Mat6 = Eigen::Matrix<double, 6, 6>;

/// Four corners of a tag: where they are in the frame of the body (or tag) K, and in the image.
struct CornerSet {
  std::array<Vec3, 4> p_K;  ///< [m]
  Corners pixels;
  CornersCovariance covariance;  ///< [px^2]
};

/// The corners of a tag in its own frame M, from the top left clockwise [m].
std::array<Vec3, 4> CornersInTag(double side_m);

/// A pose with what is known of its error.
struct PoseEstimate {
  Pose X_CK;
  /// Of (delta, phi): X = (exp([phi]x) R_CK, p_CK + delta), both along the camera's axes
  /// [m^2, m rad, rad^2]. From the corners' noise, and where it is given the lens' covariance.
  Mat6 covariance = Mat6::Zero();
  /// Derivative of (delta, phi) by the lens, at fixed corners: what two poses of one image share.
  Eigen::Matrix<double, 6, 9> by_lens = Eigen::Matrix<double, 6, 9>::Zero();
  /// Of (delta, phi), for each square metre of variance that each set's place in K has along each
  /// axis, the sets independent and their four corners alike: sum A A^T, A the derivative by one
  /// set's place. Not in `covariance`.
  Mat6 by_places = Mat6::Zero();
  double chi2 = 0;  ///< squared reprojection error, each corner in its own deviation
  int freedom = 0;  ///< coordinates less six
};

/// Covariance of a point fixed in K, along the camera's axes [m^2].
Mat3 PointCovariance(const PoseEstimate& estimate, const Vec3& p_KQ);

/// The two poses that a flat square can have by its corners:
///   [T. Collins, A. Bartoli, Infinitesimal plane-based pose estimation, IJCV 109 (2014)]
/// @param normalised  the corners' directions (1)
/// @return            the one that reprojects better first; empty where the corners are degenerate
std::vector<Pose> PosesOfSquare(const std::array<Vec2, 4>& normalised, double side_m);

/// The pose with the least chi2 near a start, by Levenberg and Marquardt.
/// @return  nothing where it does not converge with every corner in front of the camera
std::optional<PoseEstimate> RefinePose(const KnownLens& lens, const std::vector<CornerSet>& sets,
                                       const Pose& start);

/// The best pose and, where there is a second minimum, the next best.
struct PosePair {
  PoseEstimate best;
  std::optional<PoseEstimate> other;

  /// The corners do not tell the two apart: the other's chi2 is larger by less than 16, in units
  /// of the best one's own misfit. (A likelihood ratio of 3000.)
  bool ambiguous() const;
};

/// Refines each start; starts that end in one minimum count once (3 standard deviations).
std::optional<PosePair> BestPoses(const KnownLens& lens, const std::vector<CornerSet>& sets,
                                  const std::vector<Pose>& starts);

/// Both poses of a single tag. Nothing where its corners do not run clockwise round a square.
std::optional<PosePair> PosesOfTag(const KnownLens& lens, const Corners& pixels,
                                   const CornersCovariance& covariance, double side_m);

/// Angle of the rotation between two poses [rad].
double AngleBetween(const Pose& a, const Pose& b);

/// Derivative of a pixel with respect to the lens [px per unit], in the order of LensCovariance.
Eigen::Matrix<double, 2, 9> PixelByLens(const Lens& lens, const Vec2& normalised);

}  // namespace plumbline
