// Effects of the catalogue, and empirical terms, as blocks of columns.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/diagnosis/linearisation.h"

namespace plumbline {

/// One column of a block. Of an effect: d prediction / d parameter at `values`. Of an empirical
/// term: the carrier's influence times the Legendre polynomial of a signal.
struct BlockColumn {
  int unit = 0;                ///< columns of one unit are kept or dropped together
  int parameter = 0;           ///< of the term
  std::vector<double> values;  ///< where the term is differentiated: sizes 0, shapes set
  int entry = -1;              ///< of an empirical term: the influence that carries it
  std::optional<SignalIndex> signal = std::nullopt;  ///< of an empirical term: its driver
  int degree = 0;
  /// Of an empirical surface: its other driver, with its own degree.
  std::optional<SignalIndex> second_signal = std::nullopt;
  int second_degree = 0;
  Interval plausible{-1e300, 1e300};  ///< sizes that a sound machine shows, SI

  /// The larger end of `plausible`, without its sign.
  double Largest() const;
};

/// An effect, with its shapes chosen, that may explain the residual.
struct Block {
  std::string id;
  EffectTerm term;
  Indexed<BlockColumnIndex, BlockColumn> columns;
  int units = 1;
  double trials = 1;  ///< independent shapes among which this one was searched

  bool empirical() const { return term.effect->traits().empirical; }
};

/// True where two blocks have the same columns.
bool SameColumns(const Block& a, const Block& b);

/// Every size of an effect, one column each; of per-joint effects for every joint that moved or
/// is loaded.
Block WholeBlock(const Dataset& data, const Effect& effect, std::string_view word);

/// Sizes of a parameter that a sound machine shows, SI.
/// @param spec  index into the effect's parameters
/// @param prismatic, joint  where its unit depends on the joint's type; see EffectTerm
Interval PlausibleSizes(const EffectTraits& traits, int spec, std::uint32_t prismatic = 0,
                        int joint = -1);

/// True of a block with a shape that a refit adjusts: a time constant, cycles that are not whole.
bool HasContinuousShape(const Block& block);
/// True of a term that acts from a moment on; the moment is its first value.
bool BeginsAtAMoment(const EffectTerm& term);
/// True where the term has no shapes, and its sizes act as their columns say.
bool IsLinear(const EffectTerm& term);
/// True of a parameter whose file value is the inverse of what acts, a positive number.
bool IsInverse(const EffectTerm& term, int parameter);
/// True of an effect that repeats with a joint's angle, any number of cycles a turn.
bool RepeatsWithAngle(const Effect& effect);

/// A line of the spectrum along a joint's angle.
struct PeriodicLine {
  int joint = 0;
  double cycles_per_turn = 0;
  double gain = 0;  ///< drop of chi2
  double amplitude_rad = 0;
};
/// Joint and cycles of a block that repeats with a joint's angle; nothing of other blocks.
std::optional<PeriodicLine> LineOf(const Block& block);

/// Empirical block: carriers (influence entries) times polynomials of a signal up to `degree`.
/// @param with_constant  false where a constant would repeat a frame that is free anyway
Block EmpiricalBlock(const Dataset& data, SignalIndex signal, const std::vector<int>& entries,
                     int degree, bool with_constant, double trials);

/// Empirical block along two signals: carriers times P_a(first) P_b(second).
Block EmpiricalSurface(const Dataset& data, SignalIndex first, SignalIndex second,
                       const std::vector<int>& entries, int degree, bool with_constant,
                       double trials);

/// The degrees (a, b) of a surface's columns; "1" is bilinear.
std::vector<std::pair<int, int>> SurfaceDegrees(int degree, bool with_constant);

/// What an empirical column multiplies its carrier with at a row.
double FactorOf(const Dataset& data, const BlockColumn& column, RowIndex row);

/// Shape (residuals of the row, columns): the block's columns at one row.
void ColumnsAt(const Dataset& data, const Linearisation& linear, const Block& block, RowIndex row,
               Eigen::Ref<Eigen::MatrixXd> out);

}  // namespace plumbline
