// Statistical check of the cell's reference tags: distinguishes a zoom drift, a moved camera and a
// moved tag.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "app/vision/tracking/bodies.h"

namespace plumbline::vision {

/// The reference tags as observed when a lens was last verified: the camera's pose and each tag's
/// residuals. Later observations are compared with these residuals, so that constant errors of the
/// lens and of the tags' declared positions cancel and only the corners' noise remains.
struct TagBaseline {
  struct Tag {
    Corners residual_px;           ///< observed minus projected
    CornersCovariance covariance;  ///< of the residuals [px^2]
  };
  Pose X_CK;  ///< the cell's body K in the camera frame
  std::map<int, Tag> tags;
};

struct TagCheckSettings {
  double place_sd_m = 2e-4;  ///< of a tag's declared position, per axis; used without a baseline
  /// Standard deviation added to each corner coordinate for errors that its own covariance does not
  /// include (light, print, focus).
  double corner_floor_px = 0.03;
};

enum class TagTestOutcome {
  kNotVisible,   ///< fewer than two tags; with a baseline: none of its tags
  kGood,         ///< noise explains every corner, except those of the tags in `excluded`
  kCameraMoved,  ///< the tags moved as one rigid body: `X_CK` is new, the lens remains valid
  kZoomDrifted,  ///< a change of focal length alone explains the corners: `log_focal`
  kBad,          ///< no hypothesis explains them
};

struct TagTestResult {
  TagTestOutcome verdict = TagTestOutcome::kNotVisible;
  double chi2 = 0;  ///< of the accepted hypothesis; for kBad: of the first one
  int degrees_of_freedom = 0;
  double rms_px = 0;  ///< of the corners about their expected positions, per coordinate
  Pose X_CK;          ///< the camera's pose under that hypothesis
  double log_focal = 0, log_focal_sd = 0;  ///< for kZoomDrifted: ln(f now / f of the lens)
  double moved_m = 0, turned_rad = 0;      ///< for kCameraMoved: motion of the camera
  std::vector<int> excluded;               ///< tags that contradict the majority of the others
  std::vector<int> unresolved;  ///< for kBad: the tags seen, if no majority of them agrees
  /// Clockwise quarter turns about their centres with which excluded tags would agree, by id.
  std::map<int, int> quarter_turns;
  bool all_turned = false;  ///< for kBad: the tags agree if each is turned by half a turn
};

/// Tests four hypotheses about the corners, in this order, and returns the first whose chi^2 is not
/// rejected at kSignificance:
///   1. nothing moved; 2. the focal length changed (ln f free); 3. the camera moved (pose free);
///   4. some tags moved (the others, a majority of at least two, as in 1).
/// Hypothesis 3 is rejected if freeing the focal length as well lowers chi^2 by more than
/// kFocalChi2Gain: a camera step along the optical axis looks like a zoom drift. The verdict may
/// then be kBad.
///
/// Without a baseline the pose is always free, and the covariance also includes the errors of the
/// tags' positions and of the lens. Tags that are not in the baseline are tested against the others
/// in that way, so that a tag that was set aside remains so until it is put right.
///
/// If some tags contradict, all hypotheses are tested again with each tag turned by half a turn:
/// this is how OpenCV draws the AprilTag families.
/// @param baseline  null if the lens was never verified
TagTestResult TestReferenceTags(const lens::KnownLens& lens, const target::Body& cell,
                                const std::vector<SeenTag>& seen, const TagBaseline* baseline,
                                const TagCheckSettings& settings = {});

inline constexpr double kSignificance = 1e-5, kFocalChi2Gain = 16;

/// The baseline for tags that were found good with the camera at X_CK.
TagBaseline BaselineAt(const lens::KnownLens& lens, const target::Body& cell,
                       const std::vector<SeenTag>& seen, const Pose& X_CK);

/// The lens with its focal length re-estimated from the tags: for the drift of a calibrated lens or
/// the error of an interpolated one. The shift of ln f measured by the tags is combined with a
/// prior of standard deviation `prior_sd`:
///   s = s_tags / (1 + var_tags / prior^2),  1 / var = 1 / var_tags + 1 / prior^2
/// The rows and columns of fx and fy in the lens covariance are scaled by sqrt(var) / prior.
/// @return  nullopt if fewer than two tags are visible or the fit does not converge
std::optional<lens::KnownLens> RefineFocalLength(const lens::KnownLens& lens, double prior_sd,
                                                 const target::Body& cell,
                                                 const std::vector<SeenTag>& seen,
                                                 const TagCheckSettings& settings = {});

/// A calibrated lens scaled by exp(log_focal), with that factor's variance added to its covariance.
lens::KnownLens WithFocalDrift(const lens::KnownLens& lens, double log_focal, double log_focal_sd);

}  // namespace plumbline::vision
