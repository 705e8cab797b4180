// The lens by bundle adjustment over all views of the board.
#pragma once

#include <array>
#include <span>

#include "app/lens/lens_model.h"
#include "firmware-like/result.h"

namespace plumbline {

/// What is known before any view: standard deviations so wide that they matter only where the views
/// say nothing. Distortion is told by how far it moves the image's corner, as a share of its
/// distance from the middle.
struct LensPrior {
  double centre = 0.03;                 ///< of the principal point, share of the image's width
  double aspect = 0.01;                 ///< of fx / fy - 1
  double radial[3] = {0.3, 0.1, 0.03};  ///< of k1, k2, k3
  double tangential = 0.01;             ///< of p1 and p2
  double bow = 0.005;  ///< of the board's corner out of its plane, share of its diagonal
};

/// What one view tells of the shared parameters, its own pose left free: its J^T J / sigma^2 after
/// the pose is eliminated, and where its residuals pull them. All pulls and that of the prior sum
/// up to nothing.
struct ToldByView {
  SharedMatrix information = SharedMatrix::Zero();
  SharedVector pull = SharedVector::Zero();
};

/// The fitted calibration and what it rests on.
struct LensFit {
  SharedVector shared = SharedVector::Zero();
  SharedMatrix covariance = SharedMatrix::Zero();  ///< posterior, of `shared`
  std::array<bool, kSharedCount> dropped{};        ///< held at zero: the views cannot tell it
  std::vector<Pose> X_CK;                          ///< board in the camera, of each view
  std::vector<ToldByView> told;                    ///< by each view
  std::vector<double> view_rms_px;                 ///< a coordinate, of each view
  std::vector<std::vector<Vec2>> residuals_px;     ///< seen minus predicted; zero where not seen
  std::vector<std::vector<bool>> used;             ///< corners of each view that took part
  double sigma_px = 0;                             ///< standard deviation of a corner's coordinate
  /// Variance of what each view would change in `shared`, over what independent corners of sigma_px
  /// would make it: 1 where errors are independent, more where neighbours err alike.
  double dispersion = 1;
  double rms_px = 0;  ///< of the corners used, a point (as OpenCV reports it)
  int iterations = 0;
};

/// Least squares over all corners with Ceres (Levenberg-Marquardt, Schur complement), corners
/// farther than 4.5 robust standard deviations left out, terms dropped that the views do not hold,
/// poses of a flat board that flipped set right, discs placed where a tilted one is seen (after
/// each round anew; the offsets hardly depend on what they change). The covariance is that of the
/// posterior: the inverse of J^T J / sigma^2 + prior after the poses are eliminated, sigma from the
/// residuals.
/// @param views  at least 3
/// @return       or why it has no answer
Result<LensFit> FitLens(const Board& board, std::span<const BoardView> views, ImageSize size,
                        const LensPrior& prior = {});

}  // namespace plumbline
