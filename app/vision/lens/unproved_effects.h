// Effects of a whole capture that the residuals neither show nor exclude, and what they add to the
// uncertainty of the lens.
#pragma once

#include <optional>
#include <vector>

#include "app/vision/lens/capture_candidates.h"
#include "app/vision/lens/rival_fit.h"
#include "app/vision/lens/usable_region.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::vision {

/// The candidates that the score tests cover, with one linear step each. The first one has no
/// parameters beyond those of the fit.
struct ScoredCandidates {
  std::vector<CaptureCause> causes;
  std::vector<ScoreTest> tests;
  double seen_radius_px = 0;  ///< see RivalProblem::SeenRadius()
};

/// @param at  the fit of `base`, from which each step starts
ScoredCandidates ScoreTestsOf(const RivalProblem& problem, const Rival& base, const RivalResult& at,
                              const std::vector<Candidate>& candidates);

/// Effects of the whole capture that the residuals neither show nor exclude. With P the probability
/// of one,
///   P / (1 - P) = o exp(decrease / (2 d) - occam) (d / d_0)^(p / 2)
/// o the odds before the capture, d_0 the variance of the residuals in units of the corners' noise,
/// d the same or, if that is larger, that of the scores over the views
/// (ScoreTest::score_dispersion), p the number of added parameters, D the difference of its lens,
/// and E the excess of its lens's standard deviation, it adds
///   P (D^2 + E^2)
/// to the variance [J. Hoeting et al., Stat. Sci. 14 (1999) 382]. The distribution has long tails:
/// an effect of a probability above 1 - 0.9973 also lies within three standard deviations. A focal
/// length that differs from view to view counts as well, integrated over its amount; other effects
/// that differ from view to view do not. The error of an effect with which there is no one lens
/// counts over the whole image, or as far as corners were seen if the lens has no direction for
/// some pixel beyond.
/// @param scored    tests from the fit of `base`
/// @param declared  effects that are declared to be absent are left out, unless they are more
///                  probable than three standard deviations
std::vector<UnprovedEffect> UnprovedEffects(const ScoredCandidates& scored, const Rival& base,
                                            const RivalResult& at, double noise_px,
                                            image::ImageSize size,
                                            const target::DeclaredFacts& declared);

/// For each candidate radius, the largest error of the lens within it: the maximum over the effects
/// and `other_px`.
RadiusErrors ErrorsWith(const std::vector<UnprovedEffect>& effects, RadiusErrors other_px);

/// A lens whose uncertainty the effects widen, and the criterion for it.
struct WidenedLens {
  const lens::Lens& lens;
  const lens::LensCovariance& covariance;  ///< without the effects
  RadiusErrors other_px{};                 ///< errors that are not in the covariance
  image::ImageSize size;
  std::optional<double> distance_m;
  double acceptable_px = 0;
};

/// The effects that prevent the acceptance of a lens: without them it would be accepted or, if it
/// is accepted for a part of the image already, would be accepted for all of it. Sorted by size,
/// the largest first, with at most one of each cause; empty if it would not be accepted even
/// without them.
std::vector<UnprovedEffect> DecisiveEffects(const WidenedLens& widened,
                                            std::vector<UnprovedEffect> effects);

}  // namespace plumbline::vision
