#include "app/vision/lens/capture_cause.h"

#include <algorithm>

namespace plumbline::vision {

bool LeavesOneLens(CaptureCause cause) {
  switch (cause) {
    case CaptureCause::kPixelAspect:
    case CaptureCause::kStretchedPrint:
    case CaptureCause::kUnevenPrint:
    case CaptureCause::kBoardNotFlat:
    case CaptureCause::kBoardGlass:
    case CaptureCause::kOtherLensModel:
      return true;
    case CaptureCause::kNone:
    case CaptureCause::kFocalLength:
    case CaptureCause::kPrincipalPoint:
    case CaptureCause::kCameraVaries:
    case CaptureCause::kBoardBends:
    case CaptureCause::kRollingShutter:
    case CaptureCause::kWindowPane:
      break;
  }
  return false;
}

bool DeclaredAbsent(const target::DeclaredFacts& declared, CaptureCause cause) {
  if (cause == CaptureCause::kWindowPane) return declared.no_window;
  return declared.fixed_focus &&
         (cause == CaptureCause::kFocalLength || cause == CaptureCause::kCameraVaries);
}

void IncludeErrors(CaptureCause cause, const RadiusErrors& errors_px, RadiusErrors& largest) {
  for (std::size_t k = 0; k < largest.size(); ++k)
    largest[k] = std::max(largest[k], errors_px[LeavesOneLens(cause) ? k : 0]);
}

}  // namespace plumbline::vision
