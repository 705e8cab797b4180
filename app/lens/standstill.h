// Whether the lens and the board stood still while the views were taken.
#pragma once

#include <array>
#include <span>

#include "app/lens/lens_fit.h"

namespace plumbline {

/// The likeliest change of one kind, from the first view to the last:
///   shared_j = shared + w_j d
/// with w_j rising steadily from -1/2 to 1/2, or jumping before any of the views. With H_j and g_j
/// what view j tells (information, pull), C the covariance of what does not change, A = sum w_j
/// H_j:
///   S = sum w_j g_j,   V = sum w_j^2 H_j - A C A,   d = V^-1 S,   chi^2 = S^T V^-1 S
/// [score test of C. R. Rao; its largest value over change points: D. W. K. Andrews, Econometrica
/// 61 (1993) 821]. No further fit is needed.
/// Valid for changes that the residuals hardly show; larger ones are found all the more.
struct Change {
  enum class Of { kFocalLength, kCentre, kBoard };
  Of of = Of::kFocalLength;
  bool steady = false;
  std::size_t at = 0;                      ///< of a jump: the first view after it
  double chi2 = 0;                         ///< largest over all courses
  double chance = 1;                       ///< that views without any change reach it, at most
  SharedVector by = SharedVector::Zero();  ///< d
};

struct Standstill {
  std::array<Change, 3> changes;  ///< one of each kind
  /// What the focal length may have changed by adds this to the covariance of the lens: e e^T, with
  ///   e = +-d/2 - C A d
  /// from the fitted lens to that of the first or of the last view, whichever is farther, times
  /// what is left of d^2 without the share of chance. A change too small to be told from chance is
  /// thereby no hidden error.
  LensMatrix doubt = LensMatrix::Zero();
};

/// @param views     those that `fit` is of, in order of time
/// @param widening  of the covariance, for errors that corners share
Standstill StandstillOf(const LensFit& fit, std::span<const BoardView> views, double widening);

/// Chance that the largest chi^2 over all change points from `first` to 1 - first reaches `chi2`
/// where nothing changed:
///   (chi2/2)^(p/2) e^(-chi2/2) / Gamma(p/2) (2 ln((1 - first) / first) (1 - p/chi2) + 4/chi2)
/// [M. Csorgo and L. Horvath, Limit Theorems in Change-Point Analysis, 1997, sec. 1.3]. An upper
/// bound where the views are few; below 1e-2 it held for 20 simulated views, the steady change
/// included.
/// @param freedom  p, degrees of freedom of the change
/// @param first    share of the views before the earliest change point, below 1/2
double ChanceOfScan(double chi2, int freedom, double first);

}  // namespace plumbline
