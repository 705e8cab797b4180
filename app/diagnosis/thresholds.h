// What decides a claim: every limit of the diagnosis, with the statistic that it is a quantile of,
// the source or evaluation that set it, or the word that it is a judgement. Sizes of searches and
// tolerances of solvers, which decide how long and how finely one looks, stand where they are used.
#pragma once

#include <cstddef>

namespace plumbline {

// --- Scores: chi2 + cost, that is -2 ln(evidence) up to a constant.

/// Four sigma: a rival that is worse by 16 fits as well by noise once in 16,000 tries.
inline constexpr double kRivalGap = 16;

/// 2 ln(odds) of 10 is "very strong" evidence [Kass & Raftery, J. Am. Stat. Assoc. 90 (1995) 777]:
/// asked of what explains less than physics does, an empirical term and a discrepancy model, of
/// an explanation that is taken because it rejects fewer rows, and of a mistake in cell or file.
inline constexpr double kUnknownMargin = 10;
inline constexpr double kDiscrepancyMargin = 10;
inline constexpr double kRejectingMargin = 10;
inline constexpr double kMistakeMargin = 10;

/// Explanations up to this far behind the best are refitted without linearisation, or compared over
/// rejected rows. A judgement: odds of 1e13, which neither is expected to reverse. Their number is
/// limited as well; a note gives the count of those left out.
inline constexpr double kWorthRefitting = 60;

/// An explanation grows by one more effect for a gain of 2 ln(e): any that pays its own cost.
inline constexpr double kGainToGrow = 2;

// --- Chances: of an error that noise alone makes.

/// To keep any joint that has no effect, all joints of the effect together.
inline constexpr double kJointFamilyError = 0.01;
/// Of an effect's own p-value: as the search's chance of any false joint.
inline constexpr double kLargestPValue = 0.01;
/// Of a held-out error that refuses a sound explanation: once in a thousand answers.
inline constexpr double kHeldOutChance = 1e-3;
/// That what the named effects leave is no more than the noise: above it no discrepancy model.
inline constexpr double kWithinNoiseChance = 0.01;
/// That the residual follows any recorded signal, by sign flips of whole clusters, the best signal
/// of each flip: with 199 flips at most one may reach what was observed.
inline constexpr int kSignFlips = 199;
inline constexpr double kFollowsChance = 0.01;
/// That a residual exceeds the scatter of repeats so far (Fisher's F).
inline constexpr double kRepeatsChance = 0.01;
/// Standard deviations of a correlation from row to row that independent noise reaches once in a
/// thousand data sets.
inline constexpr double kCorrelatedSigmas = 3.09;
/// Share of rows that a 95 % radius may leave out, and the chance that the true radius leaves out
/// as many of the held-out rows as were seen. The latter is a judgement: between the median count
/// (0.5), which half of all true radii fail, and 0.05, which few wrong ones do.
inline constexpr double kOutsideRadius = 0.05;
inline constexpr double kUnrefutedChance = 0.2;

// --- Rows.

/// Rows whose weight is below this count as outliers. Hampel's weight falls from one, at a size
/// that one clean row in 2000 exceeds: at 0.4 the row is about 1.6 times that size away.
inline constexpr double kOutlierWeight = 0.4;
/// More than one row in ten is an effect, not outliers. A judgement; "noise: 15 % outliers" of the
/// evaluation counts what it costs.
inline constexpr double kMostOutliers = 0.1;
/// A residual of this many declared sigmas is more than noise. A judgement: data sheets state
/// repeatability at their own distance and temperature, so that half as much again is no cause.
/// "noise: declared sigma a third of the true" counts what it costs.
inline constexpr double kRough = 1.5;

// --- Explanations.

/// Share of the folds that select a named effect: four of five. Stability selection takes 0.6 to
/// 0.9 [Meinshausen & Buehlmann, J. R. Stat. Soc. B 72 (2010) 417].
inline constexpr double kLeastFrequency = 0.8;
/// Times what a sound machine shows from which a value is doubted. A judgement: worn and damaged
/// machines show more than sound ones, and nobody has published by how much.
inline constexpr double kLeastDoubtful = 5;
/// Times what a sound machine shows from which a value is none: a direction that the rows hardly
/// hold, filled with noise. A judgement, wide enough to leave every doubtful value its name.
inline constexpr double kAbsurd = 10;
/// Lines of a periodic gear error that one joint may have: two of them draw, near enough, any curve
/// of its angle, whatever causes it.
inline constexpr int kMostLinesOfAJoint = 1;
/// An empirical curve that goes this many times as far between the rows as at them is bent by the
/// gaps. A judgement; a sine through its own samples, eight a period, goes 1.08 times as far.
inline constexpr double kMostSwing = 1.6;

}  // namespace plumbline
