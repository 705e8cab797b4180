// Effects as cells carry them in their files, and as the model adds them.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// An effect that acts: its term and the values of its parameters.
struct ActiveEffect {
  EffectTerm term;
  std::vector<double> values;  ///< of term.parameters, in SI
  /// Of the values, in SI; from the deviations where no covariance was written, and empty where not
  /// every number has one.
  Eigen::MatrixXd covariance;
  std::optional<Interval> seen_t_s{};  ///< see WrittenEffect
};

/// True where the effect changes as time goes on (a warm-up, a curve over t_s).
bool FollowsTime(const EffectTerm& term);
/// True where it reads the time at all: likewise, or from a moment on.
bool ReadsTime(const EffectTerm& term);

/// The time that an effect sees: held at the ends of what it was fitted to.
std::optional<double> TimeSeen(const ActiveEffect& effect, std::optional<double> t_s);

/// The effect that a cell's file holds. A covariance goes before the deviations.
/// @param written  as the configuration reader has checked it: known id, names and words
/// @param cell     whose arm it belongs to
ActiveEffect ActiveFromWritten(const WrittenEffect& written, const CellModel& cell);

/// All effects of a cell, in its order.
std::vector<ActiveEffect> ActiveEffectsOf(const CellModel& cell);

/// The effect as a file holds it: names, units, values, deviations and covariance in file units;
/// numbers first, then the word, if the effect has one. The scope names the joints of its
/// parameters. Where it came from is left to the caller.
/// @param covariance_SI  of active.values; empty: not known. For an inverse parameter (kappa) by
///                       the delta method, sd(1/v) = sd(v) / v^2.
WrittenEffect WrittenFromActive(const ActiveEffect& active, const Eigen::MatrixXd& covariance_SI);

/// Adds all effects in these conditions. Allocates nothing.
void AddEffects(std::span<const ActiveEffect> effects, const Conditions& conditions,
                Influence<double>& influence);

}  // namespace plumbline
