// The corners of the cell's marks as one problem of least squares: pose and focal length, each free
// or held.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "app/camera/fixed_marks.h"

namespace plumbline {

/// A mark of the cell as it is seen.
struct MarkSight {
  int id = 0;
  std::array<Vec3, 4> p_K;       ///< its corners on the cell's body [m]
  Corners pixels;                ///< less what the memory says is left of them
  CornersCovariance covariance;  ///< [px^2]
};

/// The marks that are seen once, in the order of the body.
std::vector<MarkSight> SightsOfMarks(const Body& cell, const std::vector<SeenTag>& seen);

struct MarksProblem {
  std::vector<MarkSight> sights;
  Pose start;                  ///< X_CK
  Eigen::MatrixXd covariance;  ///< of all corners, (8 n, 8 n) [px^2]

  MarksProblem Without(std::size_t sight) const;
};

/// Against the memory: what is remembered and seen, its deviations those of the two looks.
MarksProblem ComparedMarks(const Body& cell, const std::vector<SeenTag>& seen,
                           const MarksMemory& memory, const MarkSettings& settings);

/// By themselves: deviations of corners, of the marks' places and of the lens.
/// @return  nothing where no pose is found to start from
std::optional<MarksProblem> MarksAlone(const KnownLens& lens, const LensCovariance& lens_covariance,
                                       const Body& cell, const std::vector<SeenTag>& seen,
                                       const MarkSettings& settings);

struct FitFreedom {
  bool pose = false, focal = false;
};

struct MarksFit {
  Pose X_CK;
  double log_focal = 0, log_focal_sd = 0;  ///< 0 where held
  double chi2 = 0;
  int freedom = 0;
  double rms_px = 0;  ///< a coordinate
};

/// Gauss-Newton from the problem's start.
/// @return  nothing where it does not converge, or a mark comes behind the camera
std::optional<MarksFit> FitMarks(const Lens& lens, const MarksProblem& problem,
                                 const FitFreedom& free);

}  // namespace plumbline
