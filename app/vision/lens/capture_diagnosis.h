// Diagnosis of a capture that one lens and one board do not explain.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/base/target/declared_facts.h"
#include "app/vision/lens/board_view.h"
#include "app/vision/lens/lens_fit.h"
#include "app/vision/lens/rival_fit.h"
#include "app/vision/lens/usable_region.h"
#include "app/vision/lens/view_consistency.h"

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

struct CaptureDiagnosis {
  /// The best explanation, and others that the residuals do not exclude; empty if the plain model
  /// is the best.
  struct Finding {
    CaptureCause cause = CaptureCause::kNone;
    std::string words;  ///< "the focal length changed by 0.21 % between view 4 and view 5"
    std::string remedy;
    double evidence = 0;  ///< decrease of the Bayesian information criterion it brings
    /// Largest difference between its lens and the plain one within each candidate radius.
    RadiusErrors error_px{};
  };
  std::vector<Finding> findings;
  /// The lens according to an explanation that leaves one lens: the board's shape, the print or
  /// further distortion are then estimated together with the lens.
  struct Adopted {
    lens::Lens lens;
    RivalPrecision precision;
    Vec3 board_bow = Vec3::Zero();  ///< kBowX, kBowY, kBowXY
    double rms_px = 0;              ///< per point
    LensFit linearized;             ///< see RivalProblem::Linearized()
    /// Largest difference to the lens of the other findings within each candidate radius.
    RadiusErrors error_px{};
    std::vector<UnprovedEffect> unproved;
  };
  /// In the order of preference; empty unless the best explanation leaves one lens. If it is the
  /// board, all its points are free, in the second entry with a bend of its own in each view.
  std::vector<Adopted> adopted;
  /// Effects in addition to the plain lens that the residuals neither show nor exclude, if there
  /// are no findings.
  std::vector<UnprovedEffect> unproved;
  /// Largest difference between the plain lens and that of explanations that contain one of the
  /// findings, within each candidate radius.
  RadiusErrors contained_px{};
  /// Even the best explanation leaves several times the corners' noise.
  bool incomplete = false;
  /// The best explanation leaves smooth displacements beyond the noise that are larger than those
  /// it explains.
  bool explains_little = false;
  /// Whether the findings name one cause, though perhaps in several ways.
  bool clear() const;
};

/// Fits the rivals that a score test finds significant, each to the same corners of all views, and
/// ranks them by
///   BIC = N / d ln(S / N) + chi^2 of the priors + p ln(N / d)
/// with S the sum of squares, N the observations and d >= 1 the ratio of the best fit's variance to
/// the corners' noise: unexplained smooth patterns are counted as correlated noise. [G. Schwarz,
/// Ann. Stat. 6 (1978) 461] A declaration removes an effect only where the residuals do not show
/// it: from the unproved ones, and from what remains credible although a board explains them
/// better.
/// @param force  fit all rivals, because something else already refuses the capture
CaptureDiagnosis DiagnoseCapture(const target::Board& board, std::span<const BoardView> views,
                                 image::ImageSize size, const LensFit& fit,
                                 const ViewConsistency& consistency,
                                 const target::DeclaredFacts& declared, bool force);

}  // namespace plumbline::vision
