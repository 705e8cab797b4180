// Blocks: catalogue effects and empirical terms as columns of a linear model.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/measure/diagnosis/linear/linearisation.h"

namespace plumbline::measure {

/// One column of a block. For an effect: d prediction / d parameter at `values`. For an empirical
/// term: the gradient of its carrier times a Legendre polynomial of a signal.
struct BlockColumn {
  int unit = 0;                ///< columns of one unit are kept or dropped together
  int parameter = 0;           ///< index into the parameters of the term
  std::vector<double> values;  ///< linearisation point: sizes 0, shapes set
  int entry = -1;              ///< carrier of an empirical term: entry of the influence
  std::optional<SignalIndex> signal = std::nullopt;  ///< driver of an empirical term
  int degree = 0;
  /// Second driver of an empirical surface, with its degree.
  std::optional<SignalIndex> second_signal = std::nullopt;
  int second_degree = 0;
  model::Interval plausible{-1e300, 1e300};  ///< plausible values of a healthy machine, SI

  /// Largest absolute value of `plausible`.
  double Largest() const;
};

/// A candidate effect with fixed shapes.
struct Block {
  std::string id;
  effects::EffectTerm term;
  Indexed<BlockColumnIndex, BlockColumn> columns;
  int units = 1;
  double trials = 1;  ///< number of independent shapes searched for this one
  /// Factor of the columns at each row of the data: 0 where the effect does not act. Null: it acts
  /// everywhere.
  std::shared_ptr<const PerRow<double>> factors{};

  bool empirical() const { return term.effect->traits().empirical; }
};

/// True if two blocks have the same columns, apart from their row factors.
bool SameColumns(const Block& a, const Block& b);

/// Block with one column for each size of an effect; for per-joint effects, of every joint that
/// moved or is loaded.
Block WholeBlock(const Dataset& data, const effects::Effect& effect, std::string_view word);

/// Whether the cell already contains an effect with this id, which a value found in addition may
/// reduce.
bool IsDeclared(const model::CellModel& cell, std::string_view id);

/// Plausible values of a parameter on a healthy machine, SI.
/// @param word  of the effect; empty if a negative value may reduce a declared one
/// @param spec  index into the effect's parameters
/// @param prismatic, joint  used if the unit depends on the joint type; see EffectTerm
model::Interval PlausibleSizes(const effects::EffectTraits& traits, int spec,
                               std::string_view word = {}, std::uint32_t prismatic = 0,
                               int joint = -1);

/// True if a refit adjusts a shape of the block: a time constant, or non-integer cycles per turn.
bool HasContinuousShape(const Block& block);
/// True for a term that acts from an event time on; that time is its first value.
bool ActsFromEventTime(const effects::EffectTerm& term);
/// True if the prediction is linear in all parameters of the term.
bool IsLinear(const effects::EffectTerm& term);
/// True for an effect that is periodic in a joint angle, with any number of cycles per turn.
bool RepeatsWithAngle(const effects::Effect& effect);

/// A line of the spectrum along a joint angle.
struct PeriodicLine {
  int joint = 0;
  double cycles_per_turn = 0;
  double gain = 0;  ///< reduction of chi2
  double amplitude_rad = 0;
};
/// Joint and cycles of a block that is periodic in a joint angle; nullopt for other blocks.
std::optional<PeriodicLine> LineOf(const Block& block);

/// Empirical curve: carriers (entries of the influence) times polynomials of a signal up to
/// `degree`.
/// @param with_constant  false if a free frame already represents the constant
/// @param trials         number of terms searched for this one
Block EmpiricalBlock(const Dataset& data, SignalIndex signal, const std::vector<int>& entries,
                     int degree, bool with_constant, double trials);

/// Empirical surface over two signals: carriers times P_a(first) P_b(second).
Block EmpiricalSurface(const Dataset& data, SignalIndex first, SignalIndex second,
                       const std::vector<int>& entries, int degree, bool with_constant,
                       double trials);

/// The pairs of degrees (a, b) of a surface; degree 1 is bilinear.
std::vector<std::pair<int, int>> SurfaceDegrees(int degree, bool with_constant);

/// Factor of an empirical column on its carrier at a row.
double FactorOf(const Dataset& data, const BlockColumn& column, RowIndex row);

/// Computes the columns of a block at one row.
/// @param out  shape (residuals of the row, columns)
void ColumnsAt(const Dataset& data, const Linearisation& linear, const Block& block, RowIndex row,
               Eigen::Ref<Eigen::MatrixXd> out);

// Cache of block columns at one linearisation, shared by all passes and folds.

/// Columns over all rows for blocks without a searched shape. Every fold, and every pass that does
/// not change the frames, uses the same ones. Thread-safe; a mutex is locked during the
/// computation.
class BlockColumns {
 public:
  /// The columns of a block, shape (residuals of all rows, columns); computed on first use.
  std::shared_ptr<const Eigen::MatrixXd> Of(const Dataset& data, const Linearisation& linear,
                                            const Block& block, int threads);

 private:
  struct Entry {
    Block block;
    std::shared_ptr<const Eigen::MatrixXd> columns;
  };
  std::mutex mutex_;
  std::vector<Entry> entries_;
};

// Conversion of fitted blocks to effects.

/// Fitted values of columns of several blocks, SI.
using Coefficients = std::map<std::pair<BlockIndex, BlockColumnIndex>, double>;
/// Fitted values of columns of one block, SI.
using ColumnSizes = std::map<BlockColumnIndex, double>;

/// The effects represented by fitted columns. Blocks of one effect that form one entry of a file
/// (harmonics, for example) are joined. Effects without a coefficient are omitted.
std::vector<effects::ActiveEffect> EffectsFrom(const Dataset& data,
                                               const Indexed<BlockIndex, Block>& blocks,
                                               const Coefficients& coefficients);

/// Identifies columns of a block that are kept or dropped together.
struct BlockUnit {
  BlockIndex block;
  int number = 0;                                      ///< within the block
  auto operator<=>(const BlockUnit&) const = default;  // NOLINT(modernize-use-nullptr)
};

/// Effects, and for each value of each effect the unit that it comes from; empty for empirical
/// ones.
struct EffectsOfUnits {
  std::vector<effects::ActiveEffect> effects;
  std::vector<std::vector<BlockUnit>> units;
};
EffectsOfUnits EffectsAndUnits(const Dataset& data, const Indexed<BlockIndex, Block>& blocks,
                               const Coefficients& coefficients);

/// The effect of one catalogue block: with the fitted sizes and all shapes of the block.
effects::ActiveEffect EffectFromSizes(const Block& block, const ColumnSizes& values);

}  // namespace plumbline::measure
