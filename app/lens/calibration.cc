#include "app/lens/calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/lens/calibration_reasons.h"
#include "app/lens/capture_change.h"
#include "app/lens/capture_diagnosis.h"
#include "app/lens/usable_region.h"
#include "app/lens/view_consistency.h"
#include "app/lens/view_selection.h"
#include "firmware-like/statistics/median.h"

namespace plumbline::lens {
namespace {

// A zoom by 1 % before the last view must exceed five standard deviations ..
constexpr double kMaxLastViewFocalSd = 2e-3;
constexpr double kMaxLastViewRatio = 2;  // .. unless no view of this capture would show it
constexpr double kMinCoverage = 0.35;
constexpr double kMaxSharedVariance = 0.4;  // share of a view's variance common to all views
// A view is displaced if its RMS exceeds this many times the median, and its noise.
constexpr double kDisplacedRatio = 3, kDisplacedNoise = 1.5;
constexpr double kMostlyNoise = 0.7;      // noise in the residuals
constexpr double kMinShareOfNoise = 0.5;  // of the uncertainty; below, other causes dominate

/// Share of the corners' noise in the residuals: 1 if nothing else is in them.
double NoiseShare(const LensFit& fit, const ViewConsistency& consistency) {
  return std::min(1.0, consistency.noise_px / fit.sigma_px);
}

/// Numbers of the result; the covariance is widened for errors that all views share.
/// @return  share of the corners' error variance that is the same in all views
double FillResult(const LensFit& fit, std::span<const BoardView> kept, LensCalibration& result,
                  double& widening) {
  result.lens = LensFromShared(fit.shared);
  result.rms_px = fit.rms_px;
  result.sigma_px = fit.sigma_px;
  result.board_bow = fit.shared.segment<3>(kBowX);
  result.board_bow_m = LargestBow(result.board_bow, result.board);
  result.coverage = Coverage(kept, result.size);
  result.frames_used.clear();
  for (const BoardView& view : kept) result.frames_used.push_back(view.name);
  const double shared = SharedVariance(fit) / (fit.sigma_px * fit.sigma_px);
  widening = std::max({1.0, fit.dispersion, 1 + static_cast<double>(kept.size()) * shared});
  result.covariance =
      FullCovariance(widening * fit.covariance.topLeftCorner<kLensCount, kLensCount>());
  return shared;
}

/// Largest error of the plain lens within each candidate radius, if one of the findings is true,
/// or an effect that is not excluded [px].
RadiusErrors ErrorsOf(const CaptureDiagnosis& diagnosis) {
  RadiusErrors largest = diagnosis.unproved_px;
  for (const CaptureDiagnosis::Finding& finding : diagnosis.findings)
    IncludeErrors(finding.cause, finding.error_px, largest);
  return largest;
}

/// Chooses the usable region and states the uncertainty there, including that a finding of the
/// diagnosis is true: its lens is then as credible as the plain one.
RegionChoice StateUncertainty(const RadiusErrors& errors_px, const CalibrationOptions& options,
                              LensCalibration& result) {
  const RegionChoice region = LargestRegion(result.lens, result.covariance, errors_px, result.size,
                                            options.distance_m, options.acceptable_px);
  result.usable_radius_px = region.radius_px;
  const double more = region.error_px / std::max(1e-6, region.plain_px);
  if (std::isfinite(more)) result.covariance *= 1 + more * more;
  result.uncertainty = ProjectionUncertaintyOf(result.lens, result.covariance, result.size,
                                               options.distance_m, region.radius_px);
  if (!std::isfinite(more)) result.uncertainty.max_px = INFINITY;
  result.everywhere_px = region.everywhere_px;
  return region;
}

/// Covariance of the lens if the corners had nothing but their noise.
LensCovariance CovarianceByNoise(const ConsistentFit& fitted) {
  return FullCovariance(std::pow(NoiseShare(fitted.fit, fitted.consistency), 2) *
                        fitted.fit.covariance.topLeftCorner<kLensCount, kLensCount>());
}

/// What would make the lens certain where it is not.
struct Advice {
  std::string words;
  bool more_views = false;  ///< further views help
};

Advice AdviceOn(const ConsistentFit& fitted, std::span<const BoardView> kept,
                const CaptureDiagnosis& diagnosis, const CalibrationOptions& options,
                const LensCalibration& result) {
  // More views help only if the noise alone makes the lens uncertain.
  const auto& [fit, consistency] = fitted;
  const double by_noise_px = ProjectionUncertaintyOf(result.lens, CovarianceByNoise(fitted),
                                                     result.size, options.distance_m)
                                 .max_px;
  if (kMinShareOfNoise * result.everywhere_px < by_noise_px ||
      !(by_noise_px <= options.acceptable_px) || NoiseShare(fit, consistency) > kMostlyNoise)
    return {AdviceOnViews(fit, kept, result.size), true};
  if (!diagnosis.findings.empty()) return {ReasonOf(diagnosis), false};
  return {fmt::format("one lens and one flat board explain the corners to {:.2f} px, but "
                      "their noise is {:.2f} px, and the cause is not clear; use a stiff "
                      "board printed true to size, avoid heat haze and vibration",
                      fit.sigma_px, consistency.noise_px),
          true};
}

/// What is wrong with the views as such: too few at the end, too similar, too far from the corners.
void JudgeViews(std::span<const BoardView> kept, std::span<const BoardView> views,
                const Advice& advice, const CalibrationOptions& options, LensCalibration& result) {
  if (const auto unused = UnusedAtTheEnd(views, kept); !unused.empty()) {
    result.reasons.push_back(fmt::format(
        "the last {} (from {}) cannot be used, so nothing shows that the lens is still the same; "
        "add frames with the board held still",
        unused.size() == 1 ? "frame" : fmt::format("{} frames", unused.size()), unused.front()));
  }
  if (!(result.uncertainty.max_px <= options.acceptable_px)) {
    result.reasons.push_back(
        UncertaintyReason(result.uncertainty.max_px, options.acceptable_px, advice.words));
  }
  if (result.coverage < kMinCoverage) {
    result.reasons.push_back(
        fmt::format("the corners cover only {:.0f} % of the image; hold the board closer, and into "
                    "the corners of the image",
                    100 * result.coverage));
  }
}

/// A lens with what the capture says about it.
struct Verdict {
  LensCalibration result;
  RegionChoice region;
  std::string change;      ///< see ChangeReason()
  bool head_on = false;    ///< the last view would not show a zoom before it, unlike the others
  bool displaced = false;  ///< some views do not fit

  bool acceptable() const { return region.acceptable && change.empty() && !displaced; }
};

/// Tests for changes, and widens the covariance for those that are too small to be detected.
void TestChanges(const LensFit& fit, std::span<const BoardView> views, double widening,
                 Verdict& verdict) {
  const CaptureChangeTest test = TestForCaptureChanges(fit, views, widening);
  verdict.result.covariance += FullCovariance(test.undetected_covariance);
  verdict.head_on = test.last_view_focal_sd >
                    std::max(kMaxLastViewFocalSd, kMaxLastViewRatio * test.typical_view_focal_sd);
  verdict.change = ChangeReason(test, fit, views, verdict.result.board);
}

/// Whether a view fits much worse than the others and than its noise.
bool AnyDisplaced(const std::vector<double>& view_rms_px, double noise_px) {
  std::vector<double> sizes = view_rms_px;
  const double usual_px = statistics::MedianOf(sizes);
  return std::any_of(view_rms_px.begin(), view_rms_px.end(), [&](double rms_px) {
    return rms_px > kDisplacedRatio * usual_px && rms_px > kDisplacedNoise * noise_px;
  });
}

/// The lens by the best explanation.
Verdict AdoptedVerdict(const CaptureDiagnosis::Adopted& adopted, const ConsistentFit& fitted,
                       std::span<const BoardView> kept, const CalibrationOptions& options,
                       const LensCalibration& plain) {
  Verdict verdict;
  verdict.result = plain;
  verdict.result.lens = adopted.lens;
  verdict.result.rms_px = adopted.rms_px;
  verdict.result.board_bow = adopted.board_bow;
  verdict.result.board_bow_m = LargestBow(adopted.board_bow, plain.board);
  verdict.result.covariance = adopted.precision.dispersion * adopted.precision.covariance;
  TestChanges(adopted.linearized, kept, adopted.precision.dispersion, verdict);
  verdict.displaced = AnyDisplaced(adopted.precision.view_rms_px, fitted.consistency.noise_px);
  verdict.region = StateUncertainty(adopted.error_px, options, verdict.result);
  return verdict;
}

/// Reasons to refuse a capture that one lens and one board do not explain.
std::vector<std::string> ReasonsOf(const Verdict& verdict, const CaptureDiagnosis& diagnosis,
                                   double shared) {
  const bool found = !diagnosis.findings.empty();
  if (verdict.displaced || (found && (!verdict.region.acceptable || !verdict.change.empty())))
    return {ReasonOf(diagnosis)};
  if (!verdict.change.empty()) return {verdict.change};
  if (verdict.region.acceptable || !(shared > kMaxSharedVariance)) return {};
  return {fmt::format(
      "the board does not match its declaration: {:.0f} % of the corners' error variance is the "
      "same in all views; use a flat board that is printed true to size",
      100 * shared)};
}

/// Fills in the result and the reasons to refuse it.
/// @return  false: a few views fit no explanation and should be left out
bool Judge(const ConsistentFit& fitted, std::span<const BoardView> kept,
           std::span<const BoardView> views, const CalibrationOptions& options,
           LensCalibration& result) {
  const auto& [fit, consistency] = fitted;
  double widening = 1;
  const double shared = FillResult(fit, kept, result, widening);
  Verdict verdict;
  verdict.result = result;
  TestChanges(fit, kept, widening, verdict);
  verdict.displaced = !consistency.displaced.empty();
  const CaptureDiagnosis diagnosis =
      DiagnoseCapture(result.board, kept, result.size, fit, consistency,
                      verdict.displaced || !verdict.change.empty());
  if (verdict.displaced && diagnosis.findings.empty() &&
      4 * consistency.displaced.size() <= kept.size())
    return false;
  verdict.region = StateUncertainty(ErrorsOf(diagnosis), options, verdict.result);
  for (const CaptureDiagnosis::Adopted& adopted : diagnosis.adopted) {
    if (verdict.acceptable() && UsableEverywhere(verdict.result)) break;
    Verdict other = AdoptedVerdict(adopted, fitted, kept, options, result);
    if (!other.acceptable() ||
        (verdict.acceptable() && other.region.radius_px <= verdict.region.radius_px))
      continue;
    verdict = std::move(other);
    verdict.result.notes.push_back(diagnosis.findings.front().words +
                                   "; this was estimated together with the lens");
    break;
  }
  result = verdict.result;
  result.reasons = ReasonsOf(verdict, diagnosis, shared);
  if (!result.reasons.empty()) {
    // Advice on views only if better views are needed as well.
    LensCalibration ideal = result;
    ideal.covariance = CovarianceByNoise(fitted);
    if (!StateUncertainty({}, options, ideal).acceptable)
      result.reasons.push_back(
          UncertaintyReason(ideal.uncertainty.max_px, options.acceptable_px,
                            "apart from this, " + AdviceOnViews(fit, kept, result.size)));
    return true;
  }
  if (verdict.head_on) {
    result.reasons.push_back(fmt::format(
        "{} is the last one and shows the board head-on, so that a zoom before it would look like "
        "another distance; end with a frame that shows the board close and tilted",
        kept.back().name));
  }
  const Advice advice = AdviceOn(fitted, kept, diagnosis, options, result);
  JudgeViews(kept, views, advice, options, result);
  result.further_views_help = !result.reasons.empty();
  if (result.reasons.empty() && !UsableEverywhere(result)) {
    result.notes.insert(result.notes.begin(),
                        RegionNote(result, result.everywhere_px, advice.words));
    result.further_views_help = advice.more_views;
  }
  return true;
}

}  // namespace

LensCalibration CalibrateLens(const Board& board, std::span<const BoardView> views,
                              image::ImageSize size, const CalibrationOptions& options) {
  LensCalibration result;
  result.size = size;
  result.board = board;
  // The lens after the last view is the one that stays: the times decide which view that is.
  std::vector<BoardView> distinct(views.begin(), views.end());
  std::stable_sort(distinct.begin(), distinct.end(),
                   [](const BoardView& a, const BoardView& b) { return a.time_s < b.time_s; });
  RemoveViews(RepeatedViews(distinct), "repeats an earlier frame", distinct, result.frames_refused);
  const std::size_t repeated = views.size() - distinct.size();
  std::vector<BoardView> kept = RemoveBlurred(distinct, result.frames_refused);
  for (bool judged = false; !judged;) {
    const Result<ConsistentFit> fitted =
        FitConsistentViews(board, size, kept, result.frames_refused);
    if (!fitted) {
      LensCalibration none;  // without the lens of an earlier round
      none.size = size;
      none.board = board;
      none.frames_refused = std::move(result.frames_refused);
      result = std::move(none);
      result.reasons.push_back(fitted.error());
      result.further_views_help = true;
      break;
    }
    judged = Judge(*fitted, kept, distinct, options, result);
    if (!judged)
      RemoveViews(fitted->consistency.displaced, kDoesNotFit, kept, result.frames_refused);
  }
  if (!result.reasons.empty() && 2 * repeated > views.size()) {
    result.reasons.push_back(fmt::format(
        "{} of {} frames repeat an earlier one and add nothing: the camera or its driver delivers "
        "frames more than once",
        repeated, views.size()));
  }
  result.accepted = result.reasons.empty();
  if (!result.accepted) result.usable_radius_px = std::numeric_limits<double>::infinity();
  return result;
}

}  // namespace plumbline::lens
