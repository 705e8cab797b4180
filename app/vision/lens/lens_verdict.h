// Verdict on one lens of a capture: its usable region, its stated uncertainty, and what changed
// between the views.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "app/vision/lens/calibration.h"
#include "app/vision/lens/capture_diagnosis.h"
#include "app/vision/lens/residual_parts.h"
#include "app/vision/lens/usable_region.h"
#include "app/vision/lens/view_selection.h"

namespace plumbline::vision {

/// A lens with what the capture says about it.
struct LensVerdict {
  LensCalibration result;
  RegionChoice region;
  /// Because of these it is not certain enough; see DecisiveEffects().
  std::vector<UnprovedEffect> decisive;
  std::string change;  ///< see ChangeReason()
  double change_p_value = 1;
  ResidualParts parts;
  /// Errors that the capture shows and the covariance does not contain: the field fixed in the
  /// image, the effect of a change, and pixels that are not square [px].
  RadiusErrors shown_px{};
  double oblong_px = 0;    ///< of them, see WithSquarePixels()
  bool head_on = false;    ///< the last view would not show a zoom before it, unlike the others
  bool displaced = false;  ///< some views do not fit
  /// Least uncertainty in half of the image or more, of all lenses that a larger limit would accept
  /// [px]; infinite if there is none.
  double least_px = std::numeric_limits<double>::infinity();

  bool acceptable() const { return region.acceptable && !displaced; }
};

/// Chooses the usable region and states the uncertainty there, including that errors of this size
/// are possible: the lens of a finding is as credible as the plain one.
RegionChoice StateUncertainty(const RadiusErrors& errors_px, const CalibrationOptions& options,
                              LensCalibration& result);

/// What the residuals of the fit show beyond one lens and one board: a field fixed in the image, a
/// change, a lens that depends on how the board was held. Each is an error of the lens, of the size
/// that is found; changes too small to be detected widen the covariance.
/// @param widening  of the fit's covariance
/// @param unit_px   standard deviation of a corner's coordinate for which that is stated
void TestResiduals(const LensFit& fit, const ViewConsistency& consistency,
                   std::span<const BoardView> views, double widening, double unit_px,
                   const target::DeclaredFacts& declared, LensVerdict& verdict);

/// States the uncertainty of the plain lens, with what the diagnosis finds or does not exclude.
void StatePlainUncertainty(const CaptureDiagnosis& diagnosis, const CalibrationOptions& options,
                           LensVerdict& verdict);

/// Replaces the verdict by that of an adopted lens if that is acceptable in a larger region.
/// @param plain  the calibration with the plain lens
/// @return       if no lens is acceptable, the effects without which an adopted lens would be
std::vector<UnprovedEffect> AdoptBest(const CaptureDiagnosis& diagnosis,
                                      const ConsistentFit& fitted, std::span<const BoardView> kept,
                                      const CalibrationOptions& options,
                                      const LensCalibration& plain, LensVerdict& verdict);

}  // namespace plumbline::vision
