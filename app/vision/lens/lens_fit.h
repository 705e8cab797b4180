// Bundle adjustment of the lens, the board's shape and the board's pose in each view.
#pragma once

#include <array>
#include <span>

#include "app/base/target/board.h"
#include "app/vision/lens/board_view.h"
#include "app/vision/lens/lens_model.h"
#include "firmware-like/geometry/pose.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/result.h"

namespace plumbline::vision {

// Initial guesses for the lens fit: focal lengths and board poses.

/// Candidate focal lengths [px], best first: the one for which the columns of all homographies are
/// equally long and perpendicular [Z. Zhang, PAMI 22 (2000) 1330, with the principal point at the
/// image centre and square pixels], if the views determine one, then a few that cover common
/// lenses.
std::vector<double> FocalGuesses(const target::Board& board, std::span<const BoardView> views,
                                 image::ImageSize size);

/// The two poses of a flat board that are consistent with a view, the better one first [T. Collins
/// and A. Bartoli, Infinitesimal plane-based pose estimation, IJCV 109 (2014)].
std::vector<Pose> BoardPoses(const target::Board& board, const BoardView& view,
                             const lens::Lens& lens);

/// Weak priors, as standard deviations: they matter only for parameters that the views do not
/// determine. For distortion, the displacement at the image's corner as a share of its distance
/// from the centre.
struct LensPrior {
  double centre = 0.03;                 ///< principal point, share of the image width
  double aspect = 0.01;                 ///< fx / fy - 1
  double radial[3] = {0.3, 0.1, 0.03};  ///< k1, k2, k3
  double tangential = 0.01;             ///< p1 and p2
  double bow = 0.005;  ///< height of the board's corner over its plane, share of the diagonal
};

/// The prior's contribution to the normal equations, for a lens of focal length f [px].
SharedMatrix PriorInformation(const LensPrior& prior, const target::Board& board,
                              image::ImageSize size, double f);

/// Contribution of one view to the normal equations of the shared parameters, after its own pose is
/// eliminated. The score vectors (`pull`) of all views and of the prior sum to zero at the
/// solution.
struct ViewInformation {
  SharedMatrix information = SharedMatrix::Zero();  ///< J^T J / sigma^2
  SharedVector pull = SharedVector::Zero();         ///< -J^T r / sigma^2
};

/// Result of the fit.
struct LensFit {
  SharedVector shared = SharedVector::Zero();
  SharedMatrix covariance = SharedMatrix::Zero();  ///< posterior, of `shared`
  std::array<bool, kSharedCount> dropped{};        ///< fixed at zero: not identifiable
  std::vector<Pose> X_CK;                          ///< board in the camera, per view
  std::vector<ViewInformation> view_information;   ///< per view
  std::vector<double> view_rms_px;                 ///< per coordinate, per view
  std::vector<std::vector<lens::Vec2>>
      residuals_px;                     ///< measured minus predicted; zero if not seen
  std::vector<std::vector<bool>> used;  ///< corners of each view that were used in the fit
  double sigma_px = 0;                  ///< standard deviation of a corner's coordinate
  /// Overdispersion: variance of the change that each view would make in `shared`, relative to
  /// independent corner errors of sigma_px. 1 if errors are independent, larger if the errors of
  /// neighbouring corners are correlated.
  double dispersion = 1;
  double rms_px = 0;  ///< per used corner (as OpenCV reports it)
  int iterations = 0;
};

/// Least squares over all corners with Ceres (Levenberg-Marquardt, Schur complement). Corners
/// beyond 4.5 robust standard deviations are excluded, parameters that are not identifiable are
/// dropped, and poses of a flat board that converged to the mirrored solution are corrected. Disc
/// offsets are updated after each round; they hardly depend on the parameters. The covariance is
/// that of the posterior: the inverse of J^T J / sigma^2 + prior after elimination of the poses,
/// with sigma from the residuals.
/// @param views  at least 3
/// @return       an error if there is no solution
Result<LensFit> FitLens(const target::Board& board, std::span<const BoardView> views,
                        image::ImageSize size, const LensPrior& prior = {});

}  // namespace plumbline::vision
