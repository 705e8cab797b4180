// Causes of a spoilt capture, and which of them a declaration excludes.
#pragma once

#include "app/base/target/declared_facts.h"
#include "app/vision/lens/usable_region.h"

namespace plumbline::vision {

/// What spoilt a capture.
enum class CaptureCause {
  kNone,
  kFocalLength,     ///< changed at some view, or steadily
  kPrincipalPoint,  ///< likewise
  kCameraVaries,    ///< focal length, or also the principal point, differ from view to view
  kBoardBends,      ///< at some view, or in every view
  kRollingShutter,
  kPixelAspect,
  kStretchedPrint,
  kUnevenPrint,
  kBoardNotFlat,
  kWindowPane,
  kBoardGlass,
  kOtherLensModel,  ///< fisheye, rational or thin prism
};

/// Whether an explanation holds for the whole capture and leaves a lens that is the same in all
/// views and at all distances.
bool LeavesOneLens(CaptureCause cause);

/// Whether a declaration says that there is no such cause.
bool DeclaredAbsent(const target::DeclaredFacts& declared, CaptureCause cause);

/// Largest of the errors within each candidate radius. A lens that changes with time is no lens
/// anywhere: its error counts over the whole image.
void IncludeErrors(CaptureCause cause, const RadiusErrors& errors_px, RadiusErrors& largest);

/// An effect that the residuals neither show nor exclude.
struct UnprovedEffect {
  CaptureCause cause = CaptureCause::kNone;
  double probability = 0;
  double variation = 0;     ///< RMS of the focal length (1), if it differs from view to view
  RadiusErrors error_px{};  ///< error of the lens within each candidate radius
};

}  // namespace plumbline::vision
