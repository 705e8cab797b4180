// Effects of the catalogue, and empirical terms, as blocks of columns.
#pragma once

#include <string>
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

/// Every size of an effect, one column each; of per-joint effects for every joint that moved or
/// is loaded.
Block WholeBlock(const Dataset& data, const Effect& effect, std::string_view word);

/// A block of counterbalance: amplitude sin(q + phase) as a sine and a cosine.
Block CounterbalanceBlock(const Effect& effect, int joint);

/// A block of gear_periodic for one joint and number of cycles a turn.
Block PeriodicBlock(int joint, double cycles, double trials);
Block DriftBlock(double time_constant_s, double trials);
/// @param moment  t_s where recorded, else the row
Block StepBlock(const Dataset& data, double moment, std::string_view frame, double trials);

/// A block of camera_zoom from a moment on, as of StepBlock.
Block ZoomBlock(const Dataset& data, double moment, double trials);
/// True of a term that acts from a moment on; the moment is its first value.
bool BeginsAtAMoment(const EffectTerm& term);

/// Empirical block: carriers (influence entries) times polynomials of a signal up to `degree`.
/// @param with_constant  false where a constant would repeat a frame that is free anyway
Block EmpiricalBlock(const Dataset& data, int signal, const std::vector<int>& entries, int degree,
                     bool with_constant, double trials);

/// Shape (3, columns): the block's columns at one row.
void ColumnsAt(const Dataset& data, const Linearisation& linear, const Block& block, int row,
               Eigen::Ref<Eigen::MatrixXd> out);

}  // namespace plumbline
