// Conversion between effects as stored in cell files and active effects of the model.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// An active effect of the model: its term and the values of its parameters.
struct ActiveEffect {
  EffectTerm term;
  std::vector<double> values;  ///< of term.parameters, in SI units
  /// Covariance of the values, in SI units; built from the standard deviations if the file has no
  /// covariance; empty if not every number has a standard deviation.
  Eigen::MatrixXd covariance;
  std::optional<model::Interval> seen_t_s{};  ///< see WrittenEffect
};

/// True if the effect varies continuously with time (a warm-up, a curve over t_s).
bool FollowsTime(const EffectTerm& term);
/// True if the effect depends on time at all: continuously, or because it starts at an event time.
bool ReadsTime(const EffectTerm& term);

/// The time passed to an effect: clamped to the time span that it was fitted to.
std::optional<double> ClampedToFittedTime(const ActiveEffect& effect, std::optional<double> t_s);

/// Converts a stored effect. A covariance takes precedence over standard deviations.
/// @param written  validated by the configuration reader: known id, names and words
/// @param cell     the cell that the effect belongs to
ActiveEffect ActiveFromWritten(const model::WrittenEffect& written, const model::CellModel& cell);

/// All effects of a cell, in file order.
std::vector<ActiveEffect> ActiveEffectsOf(const model::CellModel& cell);

/// Converts an active effect for storage: names, units, values, standard deviations and covariance
/// in file units. Numeric parameters come first, then the word, if the effect has one. The scope
/// lists the joints of its parameters. The caller fills in the origin (from_file, from_date,
/// from_rows).
/// @param covariance_SI  of active.values; empty if unknown. For an inverse parameter (kappa) it is
///                       converted by the delta method, sd(1/v) = sd(v) / v^2.
model::WrittenEffect WrittenFromActive(const ActiveEffect& active,
                                       const Eigen::MatrixXd& covariance_SI);

/// Adds the contributions of all effects under these conditions. Does not allocate.
void AddEffects(std::span<const ActiveEffect> effects, const Conditions& conditions,
                Influence<double>& influence);

}  // namespace plumbline::effects
