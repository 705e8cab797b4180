#include "app/vision/lens/calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "app/vision/lens/board_view.h"
#include "app/vision/lens/calibration_reasons.h"
#include "app/vision/lens/capture_diagnosis.h"
#include "app/vision/lens/lens_verdict.h"
#include "app/vision/lens/residual_parts.h"
#include "app/vision/lens/unproved_effects.h"
#include "app/vision/lens/view_selection.h"

namespace plumbline::vision {
namespace {

constexpr double kMostUseful = 1.0 / 400;  // largest uncertainty, share of the image's width
constexpr double kCertainChange = 1e-4;    // probability that it is chance
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

/// What the images themselves show to make the lens uncertain, if it is most of that: a field that
/// is fixed in them, or pixels that are not square.
std::optional<Advice> ShownAdvice(const LensVerdict& verdict) {
  const double most_px = kMinShareOfNoise * verdict.result.everywhere_px;
  if (verdict.parts.field_px[0] > most_px) return Advice{FieldAdvice(verdict.parts.field_px[0])};
  if (verdict.oblong_px > most_px) return Advice{AspectAdvice(verdict.result.lens)};
  return std::nullopt;
}

Advice AdviceOn(const ConsistentFit& fitted, std::span<const BoardView> kept,
                const CaptureDiagnosis& diagnosis, const CalibrationOptions& options,
                const LensVerdict& verdict) {
  if (!verdict.decisive.empty()) return {UnprovedAdvice(verdict.decisive, options.declared), true};
  if (const auto shown = ShownAdvice(verdict)) return *shown;
  const LensCalibration& result = verdict.result;
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
  // Where no finding explains most, what the images themselves show goes first.
  const bool explained = !diagnosis.findings.empty() && !diagnosis.explains_little;
  if (!verdict.displaced && !explained && ShownAdvice(verdict)) return {};
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
  if (verdict.least_px > options.acceptable_px &&
      verdict.least_px <= kMostUseful * result.size.width)
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
  // A change that is small enough is within the stated uncertainty, but not hidden.
  if (verdict.change_p_value < kCertainChange && diagnosis.findings.empty())
    result.notes.push_back(verdict.change);
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
  TestResiduals(fit, consistency, kept, widening, fit.sigma_px, options.declared, verdict);
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
