// Parameters of a lens calibration and the projection model of a slightly bowed board.
#pragma once

#include <vector>

#include "app/base/target/board.h"
#include "firmware-like/geometry/pose.h"
#include "firmware-like/lens/known_lens.h"

namespace plumbline::vision {

/// Parameters shared by all views, in this order. The first nine are the lens parameters.
enum Shared : int {
  kFx,
  kFy,
  kCx,
  kCy,
  kK1,
  kK2,
  kP1,
  kP2,
  kK3,
  kBowX,
  kBowY,
  kBowXY,  ///< board: z = bow_x x^2 + bow_y y^2 + bow_xy x y about its centre [1/m]
  kSharedCount
};
inline constexpr int kLensCount = lens::kUsualParameters;

using SharedVector = Eigen::Matrix<double, kSharedCount, 1>;
using SharedMatrix = Eigen::Matrix<double, kSharedCount, kSharedCount>;
using LensVector = Eigen::Matrix<double, kLensCount, 1>;
using LensMatrix = Eigen::Matrix<double, kLensCount, kLensCount>;

/// Covariance of all lens parameters from that of the five-coefficient lens.
inline lens::LensCovariance FullCovariance(const LensMatrix& covariance) {
  lens::LensCovariance full = lens::LensCovariance::Zero();
  full.topLeftCorner<kLensCount, kLensCount>() = covariance;
  return full;
}

lens::Lens LensFromShared(const SharedVector& shared);
SharedVector SharedOfLens(const lens::Lens& lens);

/// Pixels of the board's corners in one view:
///   p_K = (x, y, bow_x u^2 + bow_y v^2 + bow_xy u v),  (u, v) = (x, y) - centre
///   pixel = Project(lens, X_CK p_K)
/// with optional derivatives.
/// @param turn      rotation vector w of X_CK.R = R_start exp(w)
/// @param d_shared  shape (2 n, kSharedCount) row-major; null if no derivatives are needed
/// @param d_pose    shape (2 n, 6) row-major, with respect to (w, p_CK); used if d_shared is not
///                  null
/// @return          false if a corner is not in front of the camera
bool BoardPixels(const target::Board& board, const SharedVector& shared, const Mat3& R_start,
                 const Vec3& turn, const Vec3& p_CK, std::vector<lens::Vec2>& pixels,
                 double* d_shared, double* d_pose);

}  // namespace plumbline::vision
