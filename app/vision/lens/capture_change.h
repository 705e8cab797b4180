// Score test for changes of the lens or the board during a capture.
#pragma once

#include <array>
#include <span>

#include "app/vision/lens/board_view.h"
#include "app/vision/lens/lens_fit.h"

namespace plumbline::vision {

/// The most likely change of one kind between the first and the last view:
///   shared_j = shared + w_j d
/// with w_j rising steadily from -1/2 to 1/2, or jumping from -1/2 to 1/2 before one of the views.
/// With H_j and g_j the information and score (ViewInformation) of view j, C the covariance of the
/// unchanged parameters, and A = sum w_j H_j:
///   S = sum w_j g_j,   V = sum w_j^2 H_j - A C A,   d = V^-1 S,   chi^2 = S^T V^-1 S
/// [score test of C. R. Rao; maximum over change points: D. W. K. Andrews, Econometrica 61 (1993)
/// 821]. No further fit is needed. The estimate d is valid for changes that hardly show in the
/// residuals; larger changes are detected all the more reliably.
struct CaptureChange {
  enum class Kind { kFocalLength, kCentre, kBoard };
  Kind kind = Kind::kFocalLength;
  bool steady = false;
  std::size_t first_view_after = 0;           ///< of a jump
  double chi2 = 0;                            ///< maximum over all profiles
  double p_value = 1;                         ///< upper bound if nothing changed
  SharedVector delta = SharedVector::Zero();  ///< d
  /// +-d/2 - C A d: difference between the fitted lens and that of the last view, or the first one
  /// if its focal length differs more.
  LensVector error = LensVector::Zero();
};

struct CaptureChangeTest {
  std::array<CaptureChange, 3> changes;  ///< one of each kind
  /// Addition to the covariance of the lens for a focal length change too small to be detected:
  /// e e^T, with e its error, scaled by the share of d^2 that exceeds what noise alone produces.
  LensMatrix undetected_covariance = LensMatrix::Zero();
  /// Standard deviation of a change of the focal length in one view only (1): in the last view, and
  /// the median of all. Large if the view shows the board head-on, where a zoom looks like another
  /// distance.
  double last_view_focal_sd = 0, typical_view_focal_sd = 0;
};

/// @param views     the views of `fit`, in order of time
/// @param widening  factor on the covariance for correlated corner errors
CaptureChangeTest TestForCaptureChanges(const LensFit& fit, std::span<const BoardView> views,
                                        double widening);

/// Covariance of the shared parameters with the dropped ones fixed.
SharedMatrix CovarianceWithDroppedFixed(const LensFit& fit);

/// Probability that the maximum of chi^2 over all change points from `first` to 1 - first reaches
/// `chi2` if nothing changed:
///   (chi2/2)^(p/2) e^(-chi2/2) / Gamma(p/2) (2 ln((1 - first) / first) (1 - p/chi2) + 4/chi2)
/// [M. Csorgo and L. Horvath, Limit Theorems in Change-Point Analysis, 1997, sec. 1.3]. An upper
/// bound for few views; below 1e-2 it was accurate for 20 simulated views, including the steady
/// change.
/// @param degrees_of_freedom  p, of the change
/// @param first               share of the views before the earliest change point, below 1/2
double ScanPValue(double chi2, int degrees_of_freedom, double first);

}  // namespace plumbline::vision
