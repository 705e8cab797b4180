#include "app/vision/lens/calibration_reasons.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "app/vision/lens/projection_uncertainty.h"
#include "app/vision/lens/view_selection.h"

namespace plumbline::vision {
namespace {

/// After half a turn a board without a mark looks the same, so that its errors would count in the
/// wrong place.
constexpr const char* kTurnBoard =
    "turn the board by 90 degrees, always to the same side, for some of the views";

// Nominal false alarm rate for each of three kinds of change. In simulation one faultless capture
// in a hundred is refused at this level.
constexpr double kChangeSignificance = 1e-2;
constexpr double kAlternativeChi2Share = 1.0 / 3;  // of the largest chi^2: named as an alternative
constexpr double kDominates = 0.75;                // of the variance, a part that is stated alone
constexpr double kMinTilt_rad = 0.15;              // range of the board's normals
constexpr double kSufficientReach = 0.9;  // of the way to the image's corner; selects the advice

double TiltSpread(const LensFit& fit) {
  double widest = 0;
  for (const Pose& a : fit.X_CK) {
    for (const Pose& b : fit.X_CK)
      widest = std::max(widest, std::acos(std::clamp(a.R.col(2).dot(b.R.col(2)), -1.0, 1.0)));
  }
  return widest;
}

/// Distance from the image centre to the farthest used corner, as a share of that to the image's
/// corner.
double ReachOf(const LensFit& fit, std::span<const BoardView> views, image::ImageSize size) {
  const lens::Vec2 middle(0.5 * (size.width - 1), 0.5 * (size.height - 1));
  double farthest = 0;
  for (std::size_t j = 0; j < views.size(); ++j) {
    for (std::size_t k = 0; k < views[j].corners_px.size(); ++k) {
      if (fit.used[j][k]) farthest = std::max(farthest, (views[j].corners_px[k] - middle).norm());
    }
  }
  return farthest / middle.norm();
}

/// Empty if the cause is not declared to be absent.
std::string Contradiction(CaptureCause cause, const target::DeclaredFacts& declared) {
  if (!DeclaredAbsent(declared, cause)) return {};
  return fmt::format(", contrary to the declaration ({})",
                     cause == CaptureCause::kWindowPane ? "no_window" : "fixed_focus");
}

/// "the focal length changed by 0.21 % between view 4 and view 5"
std::string Describe(const CaptureChange& change, const LensFit& fit,
                     std::span<const BoardView> views, const target::Board& board,
                     const target::DeclaredFacts& declared) {
  const std::string when =
      change.steady ? "from the first to the last"
                    : fmt::format("between {} and {}", views[change.first_view_after - 1].name,
                                  views[change.first_view_after].name);
  switch (change.kind) {
    case CaptureChange::Kind::kFocalLength:
      return fmt::format("the focal length changed by {:.2f} % {}{}",
                         100 * change.delta[kFx] / fit.shared[kFx], when,
                         Contradiction(CaptureCause::kFocalLength, declared));
    case CaptureChange::Kind::kCentre:
      return fmt::format("the principal point moved by {:.1f} px {}",
                         std::hypot(change.delta[kCx], change.delta[kCy]), when);
    case CaptureChange::Kind::kBoard:
      break;
  }
  return fmt::format("the board bent by {:.2f} mm {}",
                     1e3 * LargestBow(change.delta.segment<3>(kBowX), board), when);
}

/// An effect and what would exclude it.
struct Exclusion {
  std::string effect, remedy;
  std::string declare{};  ///< before the remedy, unless it is declared already
};

Exclusion ExclusionOf(const UnprovedEffect& effect) {
  switch (effect.cause) {
    case CaptureCause::kWindowPane:
      return {"a pane of glass in front of the lens", "take views at different distances",
              "if there is none, declare it (--no-window, or no_window in [camera]); otherwise "};
    case CaptureCause::kCameraVaries:
      return {fmt::format("a focal length that varies from frame to frame by {:.1g} %",
                          100 * effect.variation / std::sqrt(effect.probability)),
              "switch autofocus and zoom drive off and take more views, close and tilted",
              "if the camera has neither autofocus nor a zoom drive that moves by itself, declare "
              "it (--fixed-focus, or fixed_focus in [camera]); otherwise "};
    case CaptureCause::kRollingShutter:
      return {"motion of the board while the rows of the image are read out (rolling shutter)",
              "rest the board for each frame, and turn it by 90 degrees for some"};
    case CaptureCause::kStretchedPrint:
      return {"a print that is stretched or skewed", kTurnBoard};
    case CaptureCause::kUnevenPrint:
      return {"an uneven print", kTurnBoard};
    case CaptureCause::kBoardNotFlat:
      return {"a board that is not flat", kTurnBoard};
    case CaptureCause::kBoardGlass:
      return {"glass on the board", "take views with the board tilted by up to 50 degrees"};
    default:
      return {"distortion that five coefficients do not describe",
              "take more views close to the corners of the image"};
  }
}

/// "0.53 px", rounded up.
std::string LimitWords(double value_px) {
  return fmt::format("{:.2g} px", RoundedUp(value_px));
}

}  // namespace

/// Peak-to-valley deviation of the board from its plane [m].
/// @param bow  kBowX, kBowY, kBowXY
double LargestBow(const Vec3& bow, const target::Board& board) {
  double lowest = 0, highest = 0;
  for (int k = 0; k < board.corners(); ++k) {
    const lens::Vec2 at = board.Corner(k) - board.Centre();
    const double z =
        bow.x() * at.x() * at.x() + bow.y() * at.y() * at.y() + bow.z() * at.x() * at.y();
    lowest = std::min(lowest, z);
    highest = std::max(highest, z);
  }
  return highest - lowest;
}

double RoundedUp(double value_px) {
  if (!(value_px > 0) || !std::isfinite(value_px)) return value_px;
  const double step = std::pow(10.0, std::floor(std::log10(value_px)) - 1);
  return step * std::ceil(value_px / step * (1 - 1e-9));
}

std::string ChangeReason(const CaptureChangeTest& test, const LensFit& fit,
                         std::span<const BoardView> views, const target::Board& board,
                         const target::DeclaredFacts& declared) {
  auto changes = test.changes;
  std::ranges::sort(changes,
                    [](const CaptureChange& a, const CaptureChange& b) { return a.chi2 > b.chi2; });
  std::string words;
  bool lens_moved = false;
  for (const CaptureChange& change : changes) {
    if (change.p_value > kChangeSignificance ||
        change.chi2 < kAlternativeChi2Share * changes[0].chi2)
      continue;
    if (!words.empty()) words += ", or ";
    words += Describe(change, fit, views, board, declared);
    lens_moved |= change.kind != CaptureChange::Kind::kBoard;
  }
  if (words.empty()) return words;
  return fmt::format(
      "the {} moved while the frames were taken: {}; let the zoom come to rest, "
      "fasten camera, lens and board, and repeat the capture",
      lens_moved ? "lens" : "board", words);
}

RadiusErrors EffectOfChanges(const CaptureChangeTest& test, const lens::Lens& lens,
                             image::ImageSize size) {
  RadiusErrors largest_px{};
  for (const CaptureChange& change : test.changes) {
    if (change.p_value > kChangeSignificance) continue;
    lens::LensVector other = lens::VectorOfLens(lens);
    other.head<kLensCount>() += change.error;
    const RadiusErrors error_px =
        CountedEverywhere(DifferencesWithin(lens, lens::LensOfVector(other, lens.fisheye), size));
    for (std::size_t k = 0; k < largest_px.size(); ++k)
      largest_px[k] = std::max(largest_px[k], error_px[k]);
  }
  return largest_px;
}

std::string WordsOf(const CaptureDiagnosis::Finding& finding,
                    const target::DeclaredFacts& declared) {
  return finding.words + Contradiction(finding.cause, declared);
}

/// One reason for a capture that one lens and one board do not explain.
std::string ReasonOf(const CaptureDiagnosis& diagnosis, const target::DeclaredFacts& declared) {
  const auto& findings = diagnosis.findings;
  if (findings.empty()) {
    return "one lens and one flat board do not explain the frames, and the cause is not clear; "
           "fasten camera and lens, use a flat board that is printed true to size, hold it still, "
           "and repeat the capture";
  }
  const bool moved = findings[0].cause == CaptureCause::kFocalLength ||
                     findings[0].cause == CaptureCause::kPrincipalPoint ||
                     findings[0].cause == CaptureCause::kCameraVaries;
  std::string reason = moved ? "the lens moved while the frames were taken: " : "";
  if (!diagnosis.clear())
    reason = "one lens and one flat board do not explain the frames, and the cause is not clear: ";
  if (!diagnosis.clear() && findings.size() == 1) reason += "most likely ";
  for (std::size_t k = 0; k < findings.size(); ++k)
    reason += (k > 0 ? ", or " : "") + WordsOf(findings[k], declared);
  return reason + "; " + findings[0].remedy;
}

std::string UnexplainedWords(const ResidualParts& parts) {
  struct Part {
    double px;
    const char *words, *remedy;
  };
  std::array all{
      Part{parts.image_px,
           "are fixed in the image, as by a drop on the glass, a windscreen, or distortion that no "
           "lens model describes",
           "clean the glass, remove a window in front of the lens, and repeat the capture"},
      Part{parts.board_px, "are fixed on the board, as by its print or shape",
           "use a stiff board that is printed true to size, and repeat the capture"},
      Part{parts.view_px, "differ from frame to frame, as by motion, hot air or glare",
           "hold the board still, keep heat, glare and vibration away, and repeat the capture"}};
  std::ranges::sort(all, [](const Part& a, const Part& b) { return a.px > b.px; });
  const double smooth_px = std::hypot(all[0].px, all[1].px, all[2].px);
  std::string words = fmt::format("residuals of {:.2g} px (RMS), beyond the corners' noise, {}",
                                  all[0].px, all[0].words);
  // Where no part dominates, the largest two are stated, and no cause.
  if (std::pow(all[0].px, 2) < kDominates * std::pow(smooth_px, 2)) {
    words = fmt::format(
        "one lens and one flat board do not explain the frames, and the cause is not clear: {}, "
        "and of {:.2g} px {}",
        words, all[1].px, all[1].words);
  }
  return words + "; " + all[0].remedy;
}

std::string FieldAdvice(double field_px) {
  return fmt::format(
      "displacements of up to {:.2g} px are fixed in the image, as by a drop or a scratch on the "
      "glass, a windscreen, or distortion that no lens model describes; clean the glass, remove a "
      "window, and repeat the capture",
      field_px);
}

std::string AspectAdvice(const lens::Lens& lens) {
  return fmt::format(
      "fy / fx is {:.4f}, as if the pixels were not square; if they are, the board moved while the "
      "rows of the image were read out (rolling shutter), or its print is stretched: rest "
      "the board for each frame, and turn it by 90 degrees for some; if they are not, declare it "
      "(--oblong-pixels, or oblong_pixels in [camera])",
      lens.fy / lens.fx);
}

std::string UnprovedAdvice(const std::vector<UnprovedEffect>& effects,
                           const target::DeclaredFacts& declared) {
  constexpr double kMostCertain = 0.99;  // of what is not shown
  std::string advice;
  for (const UnprovedEffect& effect : effects) {
    const auto [words, remedy, declare] = ExclusionOf(effect);
    const std::string probability =
        fmt::format("(probability {:.2g})", std::min(effect.probability, kMostCertain));
    if (!advice.empty()) advice += "; and ";
    if (DeclaredAbsent(declared, effect.cause)) {
      advice += fmt::format("{} is likely {}{}: {}", words, probability,
                            Contradiction(effect.cause, declared), remedy);
    } else {
      advice += fmt::format("{} is not excluded {}: {}{}", words, probability, declare, remedy);
    }
  }
  return advice;
}

std::string AdviceOnViews(const LensFit& fit, std::span<const BoardView> views,
                          image::ImageSize size) {
  const double reach = ReachOf(fit, views, size);
  if (TiltSpread(fit) < kMinTilt_rad) {
    return "the views are too similar; tilt the board by 20 to 40 degrees to the left, to the "
           "right, up and down";
  }
  if (reach < kSufficientReach) {
    return fmt::format(
        "the board was seen only up to {:.0f} % of the way from the centre to the corners of the "
        "image, and the lens is unknown beyond; hold the board into the corners",
        100 * reach);
  }
  return "take more views, tilted and close to the corners of the image";
}

std::string UncertaintyReason(double uncertain_px, double acceptable_px,
                              const std::string& advice) {
  if (!std::isfinite(uncertain_px))
    return fmt::format("in a part of the image the projection is unknown: {}", advice);
  return fmt::format(
      "the projection is uncertain by {} at the worst place of the image, but at most {:.2g} px is "
      "acceptable: {}",
      LimitWords(uncertain_px), acceptable_px, advice);
}

std::string LeastUncertaintyReason(double least_px, double acceptable_px) {
  return fmt::format(
      "even so, the projection would be uncertain by {} in the best half of the image or more, but "
      "at most {:.2g} px is acceptable; as far as that decides, --acceptable-px {:.2g} accepts it "
      "(acceptable_px in [board])",
      LimitWords(least_px), acceptable_px, RoundedUp(least_px));
}

std::string RegionNote(const lens::KnownLens& lens, double beyond_px, const std::string& advice) {
  // Only the outermost corners: 99.6 % would be printed as all of the image.
  const double share = std::min(100 * lens::UsableShare(lens), 99.0);
  const std::string rest = std::isfinite(beyond_px)
                               ? fmt::format("uncertain by up to {:.2g} px", beyond_px)
                               : std::string("unknown");
  return fmt::format(
      "usable up to {:.0f} px from the middle of the image, which is {:.0f} % of its area; in the "
      "rest the projection is {}: {}",
      std::floor(lens.usable_radius_px), share, rest, advice);
}

}  // namespace plumbline::vision
