// Verdict on one lens of a capture: its usable region, its stated uncertainty, and what changed
// between the views.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "app/vision/lens/board_view.h"
#include "app/vision/lens/calibration.h"
#include "app/vision/lens/capture_diagnosis.h"
#include "app/vision/lens/usable_region.h"
#include "app/vision/lens/view_selection.h"

namespace plumbline::vision {

/// A lens with what the capture says about it.
struct LensVerdict {
  LensCalibration result;
  RegionChoice region;
  /// Because of these it is not certain enough; see DecisiveEffects().
  std::vector<UnprovedEffect> decisive;
  std::string change;      ///< see ChangeReason()
  bool head_on = false;    ///< the last view would not show a zoom before it, unlike the others
  bool displaced = false;  ///< some views do not fit
  /// Least uncertainty in half of the image or more, of all lenses that a larger limit would accept
  /// [px]; infinite if there is none.
  double least_px = std::numeric_limits<double>::infinity();

  bool acceptable() const { return region.acceptable && change.empty() && !displaced; }
};

/// Chooses the usable region and states the uncertainty there, including that errors of this size
/// are possible: the lens of a finding is as credible as the plain one.
RegionChoice StateUncertainty(const RadiusErrors& errors_px, const CalibrationOptions& options,
                              LensCalibration& result);

/// Tests for changes, and widens the covariance for those that are too small to be detected.
/// @param widening  of the fit's covariance
void TestChanges(const LensFit& fit, std::span<const BoardView> views, double widening,
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
