// Whether the cell's fixed tags stand where a lens says they should, and what moved where they do
// not.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "app/tracking/bodies.h"

namespace plumbline {

/// The marks as they stood when a lens was last in order: the camera's pose, and by tag what was
/// left between seen and projected corners. What is left then is left later: errors of the lens and
/// of the marks' declared places fall out of the comparison, and the corners' noise remains.
struct MarksMemory {
  struct Tag {
    Corners residual_px;           ///< seen minus projected
    CornersCovariance covariance;  ///< of that [px^2]
  };
  Pose X_CK;  ///< the cell's body K in the camera
  std::map<int, Tag> tags;
};

struct MarkSettings {
  double place_sd_m = 2e-4;  ///< of a mark's declared place, an axis; where there is no memory
  /// What the corners' own covariance does not hold (light, print, focus), a coordinate.
  double corner_floor_px = 0.03;
};

enum class MarksVerdict {
  kNotVisible,   ///< fewer than two marks, or than one that is remembered
  kGood,         ///< noise explains every corner
  kCameraMoved,  ///< they shifted as one rigid body: `pose` is new, the lens stays
  kZoomDrifted,  ///< the focal length alone explains them: `log_focal`
  kBad,          ///< neither does
};

struct MarksJudged {
  MarksVerdict verdict = MarksVerdict::kNotVisible;
  double chi2 = 0;  ///< of what the verdict rests on; of kBad: of the best that was tried
  int freedom = 0;
  double rms_px = 0;  ///< of the corners against what was expected of them, a coordinate
  Pose X_CK;          ///< the camera's pose by it
  double log_focal = 0, log_focal_sd = 0;  ///< of kZoomDrifted: ln(f now / f of the lens)
  double moved_m = 0, turned_rad = 0;      ///< of kCameraMoved: of the camera, in its own frame
  std::vector<int> left_out;               ///< marks that stand elsewhere while the others agree
};

/// Four hypotheses about the corners, each fitted by least squares in their own deviations and kept
/// where chi^2 stays below its quantile of kChance:
///   nothing moved; the focal length changed (ln f free); the camera moved (its pose free); one
///   mark moved (the others as in the first, three or more in all).
/// The first that holds is the verdict. A moved camera is believed only where a focal length left
/// free besides does not improve chi^2 by kTellsFocal: a drift of the zoom that a step along the
/// axis imitates is kBad, and the board decides.
///
/// Without memory the pose is always free, and the deviations hold the marks' places and the lens'
/// covariance as well.
/// @param memory  null where the lens was never verified
MarksJudged JudgeMarks(const KnownLens& lens, const Body& cell, const std::vector<SeenTag>& seen,
                       const MarksMemory* memory, const MarkSettings& settings = {});

inline constexpr double kChance = 1e-5, kTellsFocal = 16;

/// What is to be remembered of marks that were found good at that pose.
MarksMemory Remember(const KnownLens& lens, const Body& cell, const std::vector<SeenTag>& seen,
                     const Pose& X_CK);

/// The lens with the focal length that fits the marks best: drift of a calibrated lens, or the
/// error of an interpolated one. The shift is what the marks say of ln f, weighed against
/// `prior_sd` of it; the lens' covariance becomes that of the posterior:
///   s = s_marks / (1 + var_marks / prior^2),  1 / var = 1 / var_marks + 1 / prior^2
/// rows and columns of fx and fy scaled by sqrt(var) / prior.
/// @return  nothing where fewer than two marks are seen or the fit does not converge
std::optional<KnownLens> RefineFocal(const KnownLens& lens, double prior_sd, const Body& cell,
                                     const std::vector<SeenTag>& seen,
                                     const MarkSettings& settings = {});

/// A calibrated lens that drifted by exp(log_focal), what is not known of that added to it.
KnownLens Drifted(const KnownLens& lens, double log_focal, double log_focal_sd);

}  // namespace plumbline
