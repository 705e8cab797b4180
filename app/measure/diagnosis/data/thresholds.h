// Decision thresholds of the diagnosis. Each states the statistic that it is a quantile of, its
// source or evaluation, or that it is a judgement. Search sizes and solver tolerances are defined
// where they are used.
#pragma once

#include <cstddef>

namespace plumbline::measure {

// --- Differences of score. Score = chi2 + prior + cost = -2 ln(evidence) up to a constant.

/// A rival worse by this is ruled out. Four sigma: noise makes up the difference once in 16,000
/// cases.
inline constexpr double kRivalGap = 16;

/// 2 ln(odds) = 10 is "very strong" evidence [Kass & Raftery, J. Am. Stat. Assoc. 90 (1995) 777].
/// Required of terms without a physical cause (empirical terms, the discrepancy model), of an
/// explanation preferred because it rejects fewer rows, and of a mistake in cell or file.
inline constexpr double kUnknownMargin = 10;
inline constexpr double kDiscrepancyMargin = 10;
inline constexpr double kRejectionMargin = 10;
inline constexpr double kMistakeMargin = 10;

/// Explanations within this score of the best are refitted without linearisation, or compared over
/// the rejected rows. A judgement: neither is expected to reverse odds of 1e13. Their number is
/// limited as well; a note states how many were skipped.
inline constexpr double kRefitScoreRange = 60;

/// Minimum gain in score for one more effect, after its own cost: 2 ln(e).
inline constexpr double kMinGainToGrow = 2;

// --- Significance levels: probabilities of a wrong decision under noise alone.

/// Of keeping at least one joint without effect among all joints of an effect (family-wise).
inline constexpr double kJointFamilyError = 0.01;
/// Largest accepted p-value of an effect; equal to the family-wise level of its joints.
inline constexpr double kMaxPValue = 0.01;
/// Of rejecting a correct explanation because of its held-out error: once in a thousand answers.
inline constexpr double kHeldOutSignificance = 1e-3;
/// If the residual of the named effects has a larger p-value under noise, no discrepancy model is
/// fitted.
inline constexpr double kWithinNoiseSignificance = 0.01;
/// Of reporting any recorded signal that the residual does not follow, by sign flips of whole
/// clusters and the best signal of each flip: with 199 flips, at most one may reach the observed
/// statistic.
inline constexpr int kSignFlips = 199;
inline constexpr double kSignalSignificance = 0.01;
/// Of rejected rows that share a condition by chance, of larger residuals under one, and of a
/// stretch of larger residuals: each over all limits or stretches tried.
inline constexpr double kConditionSignificance = 1e-3;
/// Of taking gross errors for another regime. The answer is only weaker then.
inline constexpr double kRegimeSignificance = 0.01;
/// Of doubting a correct explanation because its residual exceeds the noise (chi-square).
inline constexpr double kResidualSignificance = 1e-3;
/// Of rejecting a correct explanation because poses differ by more than replicates scatter
/// (Fisher's F): once in a thousand answers.
inline constexpr double kLackOfFitSignificance = 1e-3;
/// Correlation of successive rows, in standard deviations, that independent noise exceeds once in a
/// thousand data sets.
inline constexpr double kCorrelatedSigmas = 3.09;
/// Share of rows outside a 95 % radius, and one minus the confidence with which held-out rows must
/// show that no more lie outside. The confidence is a judgement: between 50 %, at which half of all
/// radii hold too few rows, and 95 %, at which a few hundred rows make every radius that of the
/// largest error.
inline constexpr double kOutsideRadius = 0.05;
inline constexpr double kRadiusSignificance = 0.2;

// --- Rows.

/// Rows with a smaller robust weight are outliers. Hampel's weight falls below one at a residual
/// that one clean row in 2000 exceeds; it is 0.4 at about 1.6 times that residual.
inline constexpr double kOutlierWeight = 0.4;
/// Largest share of outliers; a larger share is treated as an effect. A judgement; its cost is
/// measured by "noise: 15 % outliers" in the evaluation.
inline constexpr double kMaxOutliers = 0.1;
/// A residual above this many declared sigmas is more than noise. A judgement: data sheets state
/// repeatability at one distance and temperature, so an excess of one half needs no other cause.
/// Its cost is measured by "noise: declared sigma a third of the true" in the evaluation.
inline constexpr double kExcessNoiseRatio = 1.5;
/// A residual above this many sigmas, declared or of repeated points, is not explained. A
/// judgement: a larger excess over what a data sheet states needs repeated points to pass for
/// noise.
inline constexpr double kUnexplainedNoiseRatio = 2;

// --- Explanations.

/// Smallest lack of fit, in standard deviations of the noise of one row, that leaves a part of the
/// residual unexplained. A judgement: it increases the residual by an eighth.
inline constexpr double kNotableLackOfFit = 0.5;

/// Minimum share of the folds that select a named effect: four of five. Stability selection uses
/// 0.6 to 0.9 [Meinshausen & Buehlmann, J. R. Stat. Soc. B 72 (2010) 417].
inline constexpr double kMinSelectionFrequency = 0.8;
/// A value this many times the plausible limit of a healthy machine is doubtful. A judgement: worn
/// and damaged machines exceed the limit, by amounts that are not published.
inline constexpr double kDoubtfulRatio = 5;
/// A value this many times the plausible limit is discarded: noise along a direction that the rows
/// hardly determine. A judgement, wide enough to keep every doubtful value.
inline constexpr double kDiscardRatio = 10;
/// Largest number of periodic gear error lines on one joint: two of them fit almost any function of
/// its angle, whatever the cause.
inline constexpr int kMaxLinesPerJoint = 1;
/// Largest ratio of an empirical curve between the rows to that at the rows; a larger one is an
/// artefact of gaps. A judgement; a sine sampled eight times a period has 1.08.
inline constexpr double kMaxOvershoot = 1.6;

}  // namespace plumbline::measure
