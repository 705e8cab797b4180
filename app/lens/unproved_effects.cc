#include "app/lens/unproved_effects.h"

#include <algorithm>
#include <cmath>

#include "app/lens/capture_diagnosis.h"
#include "app/lens/projection_uncertainty.h"
#include "app/lens/rival_difference.h"

namespace plumbline::lens {
namespace {

constexpr double kPriorOdds = 1;         // of an effect: even, as nothing is known of it
constexpr double kNegligible = 0.0027;   // probability beyond three standard deviations
constexpr double kMostUneven = 2;        // variance of the residuals, to its median over the views
constexpr double kVariationOdds = 0.02;  // of a camera that refocuses from view to view
constexpr double kLeastVariation = 1e-4, kMostVariation = 1e-2;  // of the focal length

/// Excess of the projection's standard deviation with these parameters over that without them,
/// within each candidate radius.
RadiusErrors ExcessOf(const Lens& lens, const LensCovariance& with, const LensCovariance& without,
                      image::ImageSize size) {
  RadiusErrors excess{};
  for (std::size_t k = 0; k < excess.size(); ++k) {
    const auto deviation = [&](const LensCovariance& covariance) {
      return ProjectionUncertaintyOf(lens, covariance, size, std::nullopt, CandidateRadius(k, size))
          .max_px;
    };
    const double more = deviation(with), less = deviation(without);
    excess[k] =
        std::isfinite(more) ? std::sqrt(std::max(0.0, more * more - less * less)) : INFINITY;
  }
  return excess;
}

/// Root mean square of a change of the focal length (1) that differs from view to view, with
/// standard deviation t, and that the residuals neither show nor exclude. With s the standard
/// deviation of one view's estimate and c the mean square of n estimates in units of that,
///   L(t) = exp((n - 1) / 2 (c t^2 / (s^2 + t^2) - ln(1 + t^2 / s^2)))
/// is the likelihood in units of that without a change; ln t is equally likely from 0.01 to
/// 1 per cent: an assumption, like the odds.
double UnprovedVariation(const ScoreTest& test, std::size_t views) {
  constexpr int kSteps = 24;
  const double dispersion = std::max(1.0, test.view_dispersion);
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
  return std::sqrt(kVariationOdds * square_sum / (1 + kVariationOdds * sum));
}

}  // namespace

ScoredCandidates ScoreTestsOf(const RivalProblem& problem, const Rival& base, const RivalResult& at,
                              const std::vector<Candidate>& candidates) {
  ScoredCandidates scored{{CaptureCause::kNone}, {}};
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

RadiusErrors UnprovedErrors(const ScoredCandidates& scored, const Rival& base,
                            const RivalResult& at, double noise_px, image::ImageSize size) {
  RadiusErrors largest{};
  const Lens lens = LensOfRival(base.fisheye, at.shared, at.extra);
  const double variance = at.square_sum_px2 / std::max(1, at.observations);
  const double dispersion = std::max(1.0, variance / (noise_px * noise_px));
  for (std::size_t k = 1; k < scored.tests.size(); ++k) {
    const CaptureCause cause = scored.causes[k];
    const ScoreTest& test = scored.tests[k];
    if (test.rival.local.size() > base.local.size()) {
      // Where a few views do not fit at all, the estimates of the others are worth little.
      const bool only_zoom =
          test.rival.local.size() == base.local.size() + 1 && test.rival.local.back() == kZoom;
      if (!only_zoom || dispersion > kMostUneven * std::max(1.0, test.view_dispersion)) continue;
      RivalResult zoomed = at;
      zoomed.local.clear();
      zoomed.extra[kZoom] = UnprovedVariation(test, at.X_CK.size());
      Rival zoom = base;
      zoom.global.push_back(kZoom);
      IncludeErrors(cause, LensDifferences(lens, zoom, zoomed, size), largest);
      continue;
    }
    if (test.rival.global.size() == base.global.size()) continue;  // contained in the fit
    const double odds =
        kPriorOdds * std::exp(std::min(50.0, 0.5 * test.decrease / dispersion - test.occam));
    const double probability = odds / (1 + odds);
    if (probability < kNegligible) continue;
    const double weight = std::max(std::sqrt(probability), 1.0 / 3);
    const RadiusErrors difference = LensDifferences(lens, test.rival, test.result, size);
    RadiusErrors errors =
        ExcessOf(lens, dispersion * test.covariance, dispersion * scored.tests[0].covariance, size);
    for (std::size_t r = 0; r < errors.size(); ++r)
      errors[r] = weight * std::hypot(difference[r], errors[r]);
    IncludeErrors(cause, errors, largest);
  }
  return largest;
}

}  // namespace plumbline::lens
