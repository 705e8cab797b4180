#include "app/vision/lens/lens_verdict.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/vision/lens/calibration_reasons.h"
#include "app/vision/lens/capture_change.h"
#include "app/vision/lens/projection_uncertainty.h"
#include "app/vision/lens/unproved_effects.h"
#include "app/vision/lens/view_dependence.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::vision {
namespace {

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
                adopted.precision.noise_px, options.declared, verdict);
  verdict.displaced = AnyDisplaced(adopted.precision.view_rms_px, fitted.consistency.noise_px);
  ChooseRegion(adopted.error_px, adopted.unproved, options, verdict);
  return verdict;
}

}  // namespace

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
                   std::span<const BoardView> views, double widening, double unit_px,
                   const target::DeclaredFacts& declared, LensVerdict& verdict) {
  const target::Board& board = verdict.result.board;
  const image::ImageSize size = verdict.result.size;
  const lens::Lens& lens = verdict.result.lens;
  lens::LensCovariance& covariance = verdict.result.covariance;
  verdict.parts = PartsOf(fit, consistency, views, size);
  verdict.shown_px = verdict.parts.field_px;
  const double by_image = WideningByImage(verdict.parts, fit.sigma_px, unit_px);
  if (by_image > widening) {
    covariance *= by_image / widening;
    widening = by_image;
  }
  const CaptureChangeTest test = TestForCaptureChanges(fit, views, widening);
  const RadiusErrors change_px = EffectOfChanges(test, lens, size);
  const bool changed = change_px[0] > 0;
  // What a change that is found does is counted once.
  if (!changed) covariance += FullCovariance(test.undetected_covariance);
  const auto dependence = DependenceOnViews(fit, views, lens, board, size, widening);
  if (dependence && !(changed && IsOfTime(dependence->trait)))
    covariance += FullCovariance(dependence->covariance);
  RadiusErrors oblong_px{};
  const auto square = declared.oblong_pixels ? std::nullopt : WithSquarePixels(lens, covariance);
  if (square) oblong_px = DifferencesWithin(lens, *square, size);
  verdict.oblong_px = oblong_px[0];
  for (std::size_t k = 0; k < kCandidateRadii; ++k)
    verdict.shown_px[k] = std::hypot(verdict.shown_px[k], change_px[k], oblong_px[k]);
  verdict.head_on = test.last_view_focal_sd >
                    std::max(kMaxLastViewFocalSd, kMaxLastViewRatio * test.typical_view_focal_sd);
  for (const CaptureChange& change : test.changes)
    verdict.change_p_value = std::min(verdict.change_p_value, change.p_value);
  verdict.change = ChangeReason(test, fit, views, board, declared);
}

void StatePlainUncertainty(const CaptureDiagnosis& diagnosis, const CalibrationOptions& options,
                           LensVerdict& verdict) {
  ChooseRegion(ErrorsOf(diagnosis), diagnosis.unproved, options, verdict);
}

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

}  // namespace plumbline::vision
