#include "app/vision/lens/calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "app/vision/lens/board_view.h"
#include "app/vision/lens/calibration_reasons.h"
#include "app/vision/lens/capture_change.h"
#include "app/vision/lens/capture_diagnosis.h"
#include "app/vision/lens/residual_parts.h"
#include "app/vision/lens/unproved_effects.h"
#include "app/vision/lens/usable_region.h"
#include "app/vision/lens/view_dependence.h"
#include "app/vision/lens/view_selection.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::vision {
namespace {

// Verdict on one lens of a capture: its usable region, its stated uncertainty, and what changed
// between the views.

/// A lens with what the capture says about it.
struct LensVerdict {
  LensCalibration result;
  RegionChoice region;
  /// Because of these it is not certain enough; see DecisiveEffects().
  std::vector<UnprovedEffect> decisive;
  std::string change;  ///< see ChangeReason()
  ResidualParts parts;
  /// Errors that the capture shows and that neither the covariance nor a finding contains: the
  /// field fixed in the image and the effect of a change [px].
  RadiusErrors shown_px{};
  double oblong_px = 0;    ///< of it, see EffectOfAspect()
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
void TestResiduals(const LensFit& fit, const ViewConsistency& consistency,
                   std::span<const BoardView> views, double widening,
                   const target::DeclaredFacts& declared, LensVerdict& verdict);

// A zoom by 1 % before the last view must exceed five standard deviations ..
constexpr double kMaxLastViewFocalSd = 2e-3;
constexpr double kMaxLastViewRatio = 2;  // .. unless no view of this capture would show it
// A view is displaced if its RMS exceeds this many times the median, and its noise.
constexpr double kDisplacedRatio = 3, kDisplacedNoise = 1.5;

/// Largest error of the plain lens within each candidate radius if one of the findings is true
/// [px].
RadiusErrors ErrorsOf(const CaptureDiagnosis& diagnosis) {
  RadiusErrors largest = diagnosis.contained_px;
  for (const CaptureDiagnosis::Finding& finding : diagnosis.findings)
    IncludeErrors(finding.cause, finding.error_px, largest);
  return largest;
}

/// StateUncertainty() with the effects that are not excluded.
void ChooseRegion(RadiusErrors errors_px, const std::vector<UnprovedEffect>& unproved,
                  const CalibrationOptions& options, LensVerdict& verdict) {
  for (std::size_t k = 0; k < errors_px.size(); ++k)
    errors_px[k] = std::hypot(errors_px[k], verdict.shown_px[k]);
  const lens::LensCovariance covariance = verdict.result.covariance;
  verdict.region = StateUncertainty(ErrorsWith(unproved, errors_px), options, verdict.result);
  verdict.decisive =
      DecisiveEffects({verdict.result.lens, covariance, errors_px, verdict.result.size,
                       options.distance_m, options.acceptable_px},
                      unproved);
}

/// Least uncertainty of a lens that can be accepted at all [px].
double LeastOf(const LensVerdict& verdict) {
  return verdict.displaced ? std::numeric_limits<double>::infinity() : verdict.region.least_px;
}

/// Whether a view fits much worse than the others and than its noise.
bool AnyDisplaced(const std::vector<double>& view_rms_px, double noise_px) {
  std::vector<double> sizes = view_rms_px;
  const double usual_px = statistics::MedianOf(sizes);
  return std::ranges::any_of(view_rms_px, [&](double rms_px) {
    return rms_px > kDisplacedRatio * usual_px && rms_px > kDisplacedNoise * noise_px;
  });
}

/// The lens by the best explanation.
LensVerdict AdoptedVerdict(const CaptureDiagnosis::Adopted& adopted, const ConsistentFit& fitted,
                           std::span<const BoardView> kept, const CalibrationOptions& options,
                           const LensCalibration& plain) {
  LensVerdict verdict;
  verdict.result = plain;
  verdict.result.lens = adopted.lens;
  verdict.result.rms_px = adopted.rms_px;
  verdict.result.board_bow = adopted.board_bow;
  verdict.result.board_bow_m = LargestBow(adopted.board_bow, plain.board);
  verdict.result.covariance = adopted.precision.dispersion * adopted.precision.covariance;
  TestResiduals(adopted.linearized, fitted.consistency, kept, adopted.precision.dispersion,
                options.declared, verdict);
  verdict.displaced = AnyDisplaced(adopted.precision.view_rms_px, fitted.consistency.noise_px);
  ChooseRegion(adopted.error_px, adopted.unproved, options, verdict);
  return verdict;
}

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

void TestResiduals(const LensFit& fit, const ViewConsistency& consistency,
                   std::span<const BoardView> views, double widening,
                   const target::DeclaredFacts& declared, LensVerdict& verdict) {
  const target::Board& board = verdict.result.board;
  const image::ImageSize size = verdict.result.size;
  verdict.parts = PartsOf(fit, consistency, views, size);
  verdict.shown_px = verdict.parts.field_px;
  const double by_image = WideningByImage(verdict.parts, fit.sigma_px);
  if (by_image > widening) {
    verdict.result.covariance *= by_image / widening;
    widening = by_image;
  }
  const CaptureChangeTest test = TestForCaptureChanges(fit, views, widening);
  verdict.result.covariance += FullCovariance(test.undetected_covariance);
  if (const auto dependence = DependenceOnViews(fit, views, board, size, widening))
    verdict.result.covariance += FullCovariance(dependence->covariance);
  const double change_px = EffectOfChanges(test, fit, size);
  verdict.oblong_px = declared.oblong_pixels
                          ? 0
                          : EffectOfAspect(verdict.result.lens, verdict.result.covariance, size);
  for (double& px : verdict.shown_px) px = std::hypot(px, change_px, verdict.oblong_px);
  verdict.head_on = test.last_view_focal_sd >
                    std::max(kMaxLastViewFocalSd, kMaxLastViewRatio * test.typical_view_focal_sd);
  verdict.change = ChangeReason(test, fit, views, board, declared);
}

/// States the uncertainty of the plain lens, with what the diagnosis finds or does not exclude.
void StatePlainUncertainty(const CaptureDiagnosis& diagnosis, const CalibrationOptions& options,
                           LensVerdict& verdict) {
  ChooseRegion(ErrorsOf(diagnosis), diagnosis.unproved, options, verdict);
}

/// Replaces the verdict by that of an adopted lens if that is acceptable in a larger region.
/// @param plain  the calibration with the plain lens
/// @return       if no lens is acceptable, the effects without which an adopted lens would be
std::vector<UnprovedEffect> AdoptBest(const CaptureDiagnosis& diagnosis,
                                      const ConsistentFit& fitted, std::span<const BoardView> kept,
                                      const CalibrationOptions& options,
                                      const LensCalibration& plain, LensVerdict& verdict) {
  std::vector<UnprovedEffect> decisive;
  verdict.least_px = LeastOf(verdict);
  for (const CaptureDiagnosis::Adopted& adopted : diagnosis.adopted) {
    if (verdict.acceptable() && lens::UsableEverywhere(verdict.result)) break;
    LensVerdict other = AdoptedVerdict(adopted, fitted, kept, options, plain);
    other.least_px = verdict.least_px = std::min(verdict.least_px, LeastOf(other));
    if (!other.displaced && decisive.empty()) decisive = other.decisive;
    if (!other.acceptable() ||
        (verdict.acceptable() && other.region.radius_px <= verdict.region.radius_px))
      continue;
    verdict = std::move(other);
    verdict.result.notes.push_back(diagnosis.findings.front().words +
                                   "; this was estimated together with the lens");
    break;
  }
  return verdict.acceptable() ? std::vector<UnprovedEffect>{} : decisive;
}

constexpr double kMostUseful = 1.0 / 400;  // largest uncertainty, share of the image's width
constexpr double kMinCoverage = 0.35;
constexpr double kMaxSharedVariance = 0.4;  // share of a view's variance common to all views
constexpr double kMostlyNoise = 0.7;        // noise in the residuals
constexpr double kMinShareOfNoise = 0.5;    // of the uncertainty; below, other causes dominate

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

/// Covariance of the lens if the corners had nothing but their noise.
lens::LensCovariance CovarianceByNoise(const ConsistentFit& fitted) {
  return FullCovariance(std::pow(NoiseShare(fitted.fit, fitted.consistency), 2) *
                        fitted.fit.covariance.topLeftCorner<kLensCount, kLensCount>());
}

/// The findings, or what they leave if that is more than they explain.
std::string FindingsReason(const CaptureDiagnosis& diagnosis, const ResidualParts& parts,
                           const target::DeclaredFacts& declared) {
  return diagnosis.explains_little ? UnexplainedWords(parts) : ReasonOf(diagnosis, declared);
}

/// What would make the lens certain where it is not.
struct Advice {
  std::string words;
  bool more_views = false;  ///< further views help
};

Advice AdviceOn(const ConsistentFit& fitted, std::span<const BoardView> kept,
                const CaptureDiagnosis& diagnosis, const CalibrationOptions& options,
                const LensVerdict& verdict) {
  if (!verdict.decisive.empty()) return {UnprovedAdvice(verdict.decisive, options.declared), true};
  const LensCalibration& result = verdict.result;
  if (verdict.parts.field_px[0] > kMinShareOfNoise * result.everywhere_px)
    return {FieldAdvice(verdict.parts.field_px[0]), false};
  if (verdict.oblong_px > kMinShareOfNoise * result.everywhere_px)
    return {AspectAdvice(result.lens), false};
  // More views help only if the noise alone makes the lens uncertain.
  const auto& [fit, consistency] = fitted;
  const double by_noise_px = ProjectionUncertaintyOf(result.lens, CovarianceByNoise(fitted),
                                                     result.size, options.distance_m)
                                 .max_px;
  if (kMinShareOfNoise * result.everywhere_px < by_noise_px ||
      !(by_noise_px <= options.acceptable_px) || NoiseShare(fit, consistency) > kMostlyNoise)
    return {AdviceOnViews(fit, kept, result.size), true};
  if (!diagnosis.findings.empty())
    return {FindingsReason(diagnosis, verdict.parts, options.declared), false};
  return {UnexplainedWords(verdict.parts), true};
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

/// Reasons to refuse a capture that one lens and one board do not explain.
std::vector<std::string> ReasonsOf(const LensVerdict& verdict, const CaptureDiagnosis& diagnosis,
                                   const ConsistentFit& fitted,
                                   const target::DeclaredFacts& declared, double shared) {
  if (verdict.acceptable()) return {};
  if (verdict.displaced || !diagnosis.findings.empty())
    return {FindingsReason(diagnosis, verdict.parts, declared)};
  // A change that explains little of the residuals is not their cause.
  if (!verdict.change.empty() && NoiseShare(fitted.fit, fitted.consistency) <= kMostlyNoise)
    return {UnexplainedWords(verdict.parts)};
  if (!verdict.change.empty()) return {verdict.change};
  if (!(shared > kMaxSharedVariance)) return {};
  return {fmt::format(
      "the board does not match its declaration: {:.0f} % of the corners' error variance is the "
      "same in all views; use a flat board that is printed true to size",
      100 * shared)};
}

/// Further reasons to refuse a capture that one lens and one board do not explain.
/// @param decisive  see AdoptBest()
void AddReasonsBeside(const ConsistentFit& fitted, std::span<const BoardView> kept,
                      const std::vector<UnprovedEffect>& decisive,
                      const CalibrationOptions& options, const LensVerdict& verdict,
                      LensCalibration& result) {
  if (std::isfinite(verdict.least_px) && verdict.least_px > options.acceptable_px)
    result.reasons.push_back(LeastUncertaintyReason(verdict.least_px, options.acceptable_px));
  if (!decisive.empty()) {
    result.reasons.push_back("estimated together with the lens, this would be acceptable, but " +
                             UnprovedAdvice(decisive, options.declared));
  }
  // Advice on views only if better views are needed as well.
  LensCalibration ideal = result;
  ideal.covariance = CovarianceByNoise(fitted);
  if (StateUncertainty({}, options, ideal).acceptable) return;
  result.reasons.push_back(
      UncertaintyReason(ideal.uncertainty.max_px, options.acceptable_px,
                        "apart from this, " + AdviceOnViews(fitted.fit, kept, result.size)));
}

/// Notes and reasons if nothing shows that the lens or the board are other than assumed.
void JudgeCertainty(const ConsistentFit& fitted, std::span<const BoardView> kept,
                    std::span<const BoardView> views, const CaptureDiagnosis& diagnosis,
                    const CalibrationOptions& options, const LensVerdict& verdict,
                    LensCalibration& result) {
  if (verdict.head_on) {
    result.reasons.push_back(fmt::format(
        "{} is the last one and shows the board head-on, so that a zoom before it would look like "
        "another distance; end with a frame that shows the board close and tilted",
        kept.back().name));
  }
  const Advice advice = AdviceOn(fitted, kept, diagnosis, options, verdict);
  JudgeViews(kept, views, advice, options, result);
  result.further_views_help = !result.reasons.empty();
  if (result.reasons.empty() && !lens::UsableEverywhere(result)) {
    result.notes.insert(result.notes.begin(),
                        RegionNote(result, result.everywhere_px, advice.words));
    result.further_views_help = advice.more_views;
  }
  for (const CaptureDiagnosis::Finding& finding : diagnosis.findings) {
    if (DeclaredAbsent(options.declared, finding.cause))
      result.notes.push_back(WordsOf(finding, options.declared) +
                             "; its effect is within the stated uncertainty");
  }
}

/// Fills in the result and the reasons to refuse it.
/// @return  false: a few views fit no explanation and should be left out
bool Judge(const ConsistentFit& fitted, std::span<const BoardView> kept,
           std::span<const BoardView> views, const CalibrationOptions& options,
           LensCalibration& result) {
  const auto& [fit, consistency] = fitted;
  double widening = 1;
  const double shared = FillResult(fit, kept, result, widening);
  LensVerdict verdict;
  verdict.result = result;
  TestResiduals(fit, consistency, kept, widening, options.declared, verdict);
  verdict.displaced = !consistency.displaced.empty();
  const CaptureDiagnosis diagnosis =
      DiagnoseCapture(result.board, kept, result.size, fit, consistency, options.declared,
                      verdict.displaced || !verdict.change.empty());
  if (verdict.displaced && diagnosis.findings.empty() &&
      4 * consistency.displaced.size() <= kept.size())
    return false;
  StatePlainUncertainty(diagnosis, options, verdict);
  const std::vector<UnprovedEffect> decisive =
      AdoptBest(diagnosis, fitted, kept, options, result, verdict);
  result = verdict.result;
  result.least_px = verdict.least_px;
  result.reasons = ReasonsOf(verdict, diagnosis, fitted, options.declared, shared);
  if (result.reasons.empty()) {
    JudgeCertainty(fitted, kept, views, diagnosis, options, verdict, result);
  } else {
    AddReasonsBeside(fitted, kept, decisive, options, verdict, result);
  }
  return true;
}

/// CalibrateLens() within the limit.
LensCalibration CalibrateWithin(const target::Board& board, std::span<const BoardView> views,
                                image::ImageSize size, const CalibrationOptions& options) {
  LensCalibration result;
  result.size = size;
  result.board = board;
  result.declared = options.declared;
  // The lens after the last view is the one that stays: the times decide which view that is.
  std::vector<BoardView> distinct(views.begin(), views.end());
  std::ranges::stable_sort(
      distinct, [](const BoardView& a, const BoardView& b) { return a.time_s < b.time_s; });
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
      none.declared = options.declared;
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

}  // namespace

LensCalibration CalibrateLens(const target::Board& board, std::span<const BoardView> views,
                              image::ImageSize size, const CalibrationOptions& options) {
  LensCalibration within = CalibrateWithin(board, views, size, options);
  if (within.accepted || !options.accept_least || !(within.least_px <= kMostUseful * size.width))
    return within;
  CalibrationOptions wider = options;
  wider.acceptable_px = RoundedUp(within.least_px);
  LensCalibration least = CalibrateWithin(board, views, size, wider);
  if (!least.accepted) return within;
  least.notes.insert(least.notes.begin(),
                     fmt::format("certain to {:.2g} px, not to {:.2g} px: {}", wider.acceptable_px,
                                 options.acceptable_px, within.reasons.front()));
  return least;
}

}  // namespace plumbline::vision
