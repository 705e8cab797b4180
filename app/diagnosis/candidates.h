// Candidate explanations: effects of the catalogue, and empirical terms, as blocks of columns.
#pragma once

#include <map>

#include "app/diagnosis/linearisation.h"

namespace plumbline {

/// One column of a block. Of an effect: d prediction / d parameter at `values`. Of an empirical
/// term: the carrier's influence times the Legendre polynomial of a signal.
struct BlockColumn {
  int unit = 0;                ///< columns of one unit are kept or dropped together
  int parameter = 0;           ///< of the term
  std::vector<double> values;  ///< where the term is differentiated: sizes 0, shapes set
  int entry = -1;              ///< of an empirical term: the influence that carries it
  int signal = -1;             ///< of an empirical term: index into Dataset::signals
  int degree = 0;
  double largest = 1e300;  ///< size beyond which no sound machine goes, SI
};

/// An effect, with its shapes chosen, that may explain the residual.
struct Block {
  std::string id;
  EffectTerm term;
  std::vector<BlockColumn> columns;
  int units = 1;
  double trials = 1;  ///< independent shapes among which this one was searched

  bool empirical() const { return id == "empirical"; }
};

/// A candidate that these data cannot show, and why.
struct NotOffered {
  std::string id;
  std::string reason;
};

struct Candidates {
  std::vector<Block> blocks;            ///< effects without searched shapes
  std::vector<const Effect*> searched;  ///< effects whose shapes are searched in the residual
  std::vector<NotOffered> not_offered;
};

/// What the data can show of the catalogue.
Candidates CandidatesFor(const Dataset& data);

/// Blocks with the shapes (cycles, time constants, moments) of effects that were refitted, so that
/// a search finds them again as they are.
std::vector<Block> BlocksOf(const Dataset& data, const std::vector<ActiveEffect>& effects);

/// A block of gear_periodic for one joint and number of cycles a turn.
Block PeriodicBlock(int joint, double cycles, double trials);
Block DriftBlock(double time_constant_s, double trials);
/// @param moment  t_s where recorded, else the row
Block StepBlock(const Dataset& data, double moment, std::string_view frame, double trials);

/// A block of camera_zoom from a moment on, as of StepBlock.
Block ZoomBlock(const Dataset& data, double moment, double trials);
/// True of a term that acts from a moment on; the moment is its first value.
bool BeginsAtAMoment(const EffectTerm& term);

/// Whole effects among which an explanation chooses: the catalogue, the effects of a measuring
/// camera only where one measures. Whether other signals were recorded does not matter, so that
/// scores of tables of one cell can be compared.
double EffectsConsidered(const Dataset& data);

/// Empirical block: carriers (influence entries) times polynomials of a signal up to `degree`.
/// @param with_constant  false where a constant would repeat a frame that is free anyway
Block EmpiricalBlock(const Dataset& data, int signal, const std::vector<int>& entries, int degree,
                     bool with_constant, double trials);

/// Shape (3, columns): the block's columns at one row.
void ColumnsAt(const Dataset& data, const Linearisation& linear, const Block& block, int row,
               Eigen::Ref<Eigen::MatrixXd> out);

/// The effects that coefficients of some columns of blocks stand for; harmonics of one effect are
/// joined into one. An effect without a coefficient is left out.
/// @param coefficients  (block, column) -> value in SI
using Coefficients = std::map<std::pair<int, int>, double>;
std::vector<ActiveEffect> EffectsFrom(const Dataset& data, const std::vector<Block>& blocks,
                                      const Coefficients& coefficients);

/// Legendre polynomial P_degree of x in -1..1.
double Legendre(int degree, double x);

/// The signal's value of a row scaled to -1..1 over the rows.
double Scaled(const RecordedSignal& signal, double value);

/// Joint names (q2, q3) of an effect's parameters.
std::vector<std::string> ScopeOf(const EffectTerm& term);

}  // namespace plumbline
