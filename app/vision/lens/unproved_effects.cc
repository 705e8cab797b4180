#include "app/vision/lens/unproved_effects.h"

#include <algorithm>
#include <cmath>

#include "app/vision/lens/capture_diagnosis.h"
#include "app/vision/lens/projection_uncertainty.h"
#include "app/vision/lens/rival_difference.h"

namespace plumbline::vision {
namespace {

constexpr double kNegligible = 0.0027;  // probability beyond three standard deviations
constexpr double kMostUneven = 2;       // variance of the residuals, to its median over the views
// Odds of an effect before the capture: assumptions.
constexpr double kPriorOdds = 1;
constexpr double kWindowOdds = 1.0 / 9;  // one camera in ten is behind glass
constexpr double kVariationOdds = 0.02;  // of a camera that refocuses from view to view
constexpr double kLeastVariation = 1e-4, kMostVariation = 1e-2;  // of the focal length

/// Excess of the projection's standard deviation with these parameters over that without them,
/// within each candidate radius.
RadiusErrors ExcessOf(const lens::Lens& lens, const lens::LensCovariance& with,
                      const lens::LensCovariance& without, image::ImageSize size) {
  RadiusErrors excess{};
  for (std::size_t k = 0; k < excess.size(); ++k) {
    const auto deviation = [&](const lens::LensCovariance& covariance) {
      return ProjectionUncertaintyOf(lens, covariance, size, std::nullopt, CandidateRadius(k, size))
          .max_px;
    };
    const double more = deviation(with), less = deviation(without);
    excess[k] =
        std::isfinite(more) ? std::sqrt(std::max(0.0, more * more - less * less)) : INFINITY;
  }
  return excess;
}

/// A change of the focal length that differs from view to view, with standard deviation t, and that
/// the residuals neither show nor exclude: its probability, and its root mean square with that.
/// With s the standard deviation of one view's estimate and c the mean square of n estimates in
/// units of that,
///   L(t) = exp((n - 1) / 2 (c t^2 / (s^2 + t^2) - ln(1 + t^2 / s^2)))
/// is the likelihood in units of that without a change; ln t is equally likely from 0.01 to
/// 1 per cent: an assumption, like the odds.
UnprovedEffect UnprovedVariation(const ScoreTest& test, std::size_t views) {
  constexpr int kSteps = 24;
  const double dispersion = std::max({1.0, test.view_dispersion, test.smooth_dispersion});
  const double deviation = std::sqrt(dispersion) * test.local_deviation;
  double sum = 0, square_sum = 0;
  for (int k = 0; k < kSteps; ++k) {
    const double t =
        kLeastVariation * std::pow(kMostVariation / kLeastVariation, (k + 0.5) / kSteps);
    const double ratio = std::pow(t / deviation, 2);
    const double per_view =
        test.local_square / dispersion * ratio / (1 + ratio) - std::log1p(ratio);
    const double likelihood =
        std::exp(std::min(50.0, 0.5 * (static_cast<double>(views) - 1) * per_view)) / kSteps;
    sum += likelihood;
    square_sum += likelihood * t * t;
  }
  const double odds = kVariationOdds * sum;
  return {CaptureCause::kCameraVaries, odds / (1 + odds),
          std::sqrt(kVariationOdds * square_sum / (1 + odds))};
}

/// Counts the error of an effect with which there is no one lens over the whole image. If that is
/// infinite because the lens itself, extrapolated, has no direction for some pixel, then over the
/// smallest candidate region that contains all corners seen.
void CountEverywhere(double seen_radius_px, image::ImageSize size, UnprovedEffect& effect) {
  if (LeavesOneLens(effect.cause)) return;
  std::size_t whole = 0;
  if (!std::isfinite(effect.error_px[0])) {
    while (whole + 1 < kCandidateRadii && CandidateRadius(whole + 1, size) >= seen_radius_px)
      ++whole;
  }
  const double error_px = effect.error_px[whole];
  effect.error_px.fill(error_px);
}

/// The fit from which the score tests start.
struct TestedFit {
  const ScoredCandidates& scored;
  const Rival& base;
  const RivalResult& at;
  lens::Lens lens;
  double dispersion = 1;  ///< variance of the residuals, in units of the corners' noise
  image::ImageSize size;
};

/// An effect that differs from view to view; only of the focal length.
std::optional<UnprovedEffect> LocalEffect(const TestedFit& fit, std::size_t k) {
  const ScoreTest& test = fit.scored.tests[k];
  // Where a few views do not fit at all, the estimates of the others are worth little.
  const bool only_zoom =
      test.rival.local.size() == fit.base.local.size() + 1 && test.rival.local.back() == kZoom;
  if (!only_zoom || fit.dispersion > kMostUneven * std::max(1.0, test.view_dispersion))
    return std::nullopt;
  UnprovedEffect effect = UnprovedVariation(test, fit.at.X_CK.size());
  RivalResult zoomed = fit.at;
  zoomed.local.clear();
  zoomed.extra[kZoom] = effect.variation;
  Rival zoom = fit.base;
  zoom.global.push_back(kZoom);
  effect.error_px = LensDifferences(fit.lens, zoom, zoomed, fit.size);
  CountEverywhere(fit.scored.seen_radius_px, fit.size, effect);
  return effect;
}

/// An effect that is equal in all views.
std::optional<UnprovedEffect> GlobalEffect(const TestedFit& fit, std::size_t k) {
  const ScoreTest& test = fit.scored.tests[k];
  if (test.rival.global.size() == fit.base.global.size()) return std::nullopt;  // in the fit
  UnprovedEffect effect;
  effect.cause = fit.scored.causes[k];
  const double dispersion = std::max(fit.dispersion, test.score_dispersion);
  const auto added = static_cast<double>(test.rival.global.size() - fit.base.global.size());
  // d_0 stays out: gross errors raise it, and do not widen what is known of the parameters.
  const double occam =
      std::max(0.0, test.occam - 0.5 * added * std::log(dispersion / fit.dispersion));
  const double before = effect.cause == CaptureCause::kWindowPane ? kWindowOdds : kPriorOdds;
  const double odds = before * std::exp(std::min(50.0, 0.5 * test.decrease / dispersion - occam));
  effect.probability = odds / (1 + odds);
  if (effect.probability < kNegligible) return std::nullopt;
  const double weight = std::max(std::sqrt(effect.probability), 1.0 / 3);
  const RadiusErrors difference = LensDifferences(fit.lens, test.rival, test.result, fit.size);
  RadiusErrors& errors = effect.error_px;
  errors = ExcessOf(fit.lens, dispersion * test.covariance,
                    dispersion * fit.scored.tests[0].covariance, fit.size);
  for (std::size_t r = 0; r < errors.size(); ++r)
    errors[r] = weight * std::hypot(difference[r], errors[r]);
  CountEverywhere(fit.scored.seen_radius_px, fit.size, effect);
  return effect;
}

}  // namespace

ScoredCandidates ScoreTestsOf(const RivalProblem& problem, const Rival& base, const RivalResult& at,
                              const std::vector<Candidate>& candidates) {
  ScoredCandidates scored{{CaptureCause::kNone}, {}, problem.SeenRadius()};
  std::vector<Rival> rivals{{}};
  for (const Candidate& candidate : candidates) {
    if (candidate.always) continue;
    scored.causes.push_back(candidate.cause);
    rivals.push_back(candidate.rival);
    // Without thickness, the tilt of a window has no effect.
    if (candidate.cause == CaptureCause::kWindowPane) rivals.back().global = {kPaneZ};
  }
  scored.tests = problem.ScoreTests(rivals, base, at);
  return scored;
}

std::vector<UnprovedEffect> UnprovedEffects(const ScoredCandidates& scored, const Rival& base,
                                            const RivalResult& at, double noise_px,
                                            image::ImageSize size,
                                            const target::DeclaredFacts& declared) {
  const double variance = at.square_sum_px2 / std::max(1, at.observations);
  const TestedFit fit{scored,
                      base,
                      at,
                      LensOfRival(base.fisheye, at.shared, at.extra),
                      std::max(1.0, variance / (noise_px * noise_px)),
                      size};
  std::vector<UnprovedEffect> effects;
  for (std::size_t k = 1; k < scored.tests.size(); ++k) {
    const bool local = scored.tests[k].rival.local.size() > base.local.size();
    const auto effect = local ? LocalEffect(fit, k) : GlobalEffect(fit, k);
    if (!effect) continue;
    const bool shown = effect->probability > 1 - kNegligible;
    if (shown || !DeclaredAbsent(declared, effect->cause)) effects.push_back(*effect);
  }
  return effects;
}

RadiusErrors ErrorsWith(const std::vector<UnprovedEffect>& effects, RadiusErrors other_px) {
  for (const UnprovedEffect& effect : effects) {
    for (std::size_t r = 0; r < other_px.size(); ++r)
      other_px[r] = std::max(other_px[r], effect.error_px[r]);
  }
  return other_px;
}

std::vector<UnprovedEffect> DecisiveEffects(const WidenedLens& widened,
                                            std::vector<UnprovedEffect> effects) {
  const auto region = [&] {
    return LargestRegion(widened.lens, widened.covariance, ErrorsWith(effects, widened.other_px),
                         widened.size, widened.distance_m, widened.acceptable_px);
  };
  const bool accepted = region().acceptable;
  const auto suffices = [&] {
    const RegionChoice choice = region();
    return choice.acceptable && (!accepted || std::isinf(choice.radius_px));
  };
  std::vector<UnprovedEffect> removed;
  while (!effects.empty() && !suffices()) {
    const auto largest = std::ranges::max_element(
        effects, [accepted](const UnprovedEffect& a, const UnprovedEffect& b) {
          return accepted ? a.error_px.front() < b.error_px.front()
                          : a.error_px.back() < b.error_px.back();
        });
    const CaptureCause cause = largest->cause;
    removed.push_back(*largest);
    std::erase_if(effects, [&](const UnprovedEffect& effect) { return effect.cause == cause; });
  }
  return suffices() ? removed : std::vector<UnprovedEffect>{};
}

}  // namespace plumbline::vision
