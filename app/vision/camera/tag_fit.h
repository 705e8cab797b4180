// Weighted least-squares fit of the reference tags' corners; camera pose and focal length can each
// be free or fixed.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "app/vision/camera/reference_tags.h"

namespace plumbline::vision {

/// One reference tag as observed in an image.
struct TagObservation {
  int id = 0;
  std::array<Vec3, 4> p_K;       ///< its corners on the cell's body [m]
  Corners pixels;                ///< minus the baseline's residuals, if there is a baseline
  CornersCovariance covariance;  ///< [px^2]
};

/// The reference tags that were detected exactly once, in the order of the body.
std::vector<TagObservation> ObservedReferenceTags(const target::Body& cell,
                                                  const std::vector<SeenTag>& seen);

struct TagFitProblem {
  std::vector<TagObservation> observations;
  Pose start;                  ///< X_CK
  Eigen::MatrixXd covariance;  ///< of all corners, (8 n, 8 n) [px^2]

  /// The problem without one observation.
  TagFitProblem Without(std::size_t index) const;
};

/// Tags that are both observed and in the baseline; the covariance is the sum of both
/// observations'.
TagFitProblem ProblemAgainstBaseline(const target::Body& cell, const std::vector<SeenTag>& seen,
                                     const TagBaseline& baseline, const TagCheckSettings& settings);

/// The observed tags alone; the covariance includes corner noise and the errors of the tags'
/// positions and of the lens.
/// @return  nullopt if no starting pose is found
std::optional<TagFitProblem> ProblemWithoutBaseline(const lens::KnownLens& lens,
                                                    const lens::LensCovariance& lens_covariance,
                                                    const target::Body& cell,
                                                    const std::vector<SeenTag>& seen,
                                                    const TagCheckSettings& settings);

struct FreeParameters {
  bool pose = false, focal = false;
};

struct TagFit {
  Pose X_CK;
  double log_focal = 0, log_focal_sd = 0;  ///< 0 if fixed
  double chi2 = 0;
  int degrees_of_freedom = 0;
  double rms_px = 0;  ///< per coordinate
};

/// Gauss-Newton from the problem's start.
/// @return  nullopt if it does not converge or a tag ends up behind the camera
std::optional<TagFit> FitTags(const lens::Lens& lens, const TagFitProblem& problem,
                              const FreeParameters& free);

}  // namespace plumbline::vision
