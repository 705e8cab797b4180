// Columns of errors of declarations.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "app/measure/diagnosis/linear/linear_problem.h"

namespace plumbline::measure {

/// Components of a shift or of a rotation vector.
inline constexpr int kErrorAxes = 3;

/// One wrong declaration.
struct DeclaredErrorKind {
  enum class What { kTip, kTurn, kMove, kItemMass };
  What what = What::kTip;
  int tool = 0;              ///< of kTip: its index in the cell
  int item = 0;              ///< of kItemMass: its index in the cell
  ArtefactIndex artefact{};  ///< of kMove
  RowIndex from{};           ///< of kMove: the first row after it
  int choices = 1;           ///< number of alternatives that were tried
};

/// Whitened and projected columns of an error with three components, or with one if it is a mass,
/// scaled to unit length.
struct DeclaredErrorColumns {
  DeclaredErrorKind kind;
  Eigen::MatrixXd columns;
  Eigen::VectorXd length;
  double deviation = 0;  ///< of the prior of each component, [m], [rad] or [kg]
};

/// True if the rows can show a wrong tip or a turned orientation: the tip is declared as known, and
/// they hold several tools, or orientations.
bool TestsTips(const Dataset& data);
/// True if the row touches an artefact at an unknown position, or measures the distance from one.
bool IsAtUnknownPlace(const Dataset& data, RowIndex row);
/// True if some artefact at an unknown position was touched at least four times.
bool TestsMoves(const Dataset& data);

/// The columns of every tool's tip and of a rotation of all orientations, as far as the rows can
/// show them and the nuisances do not absorb them.
std::vector<DeclaredErrorColumns> TipErrors(const LinearProblem& problem);

/// True if the rows can show the wrong mass of a payload item: some carry one, and not all the
/// same.
bool TestsItems(const Dataset& data);
/// The columns of the mass of every payload item, as far as the rows can show it: changes of the
/// prediction of a model.
std::vector<DeclaredErrorColumns> ItemErrors(const LinearProblem& problem, const Model& model,
                                             int threads);

/// The columns of the move of one artefact at one moment that explains most of a residual; nullopt
/// if the rows cannot show any.
/// @param residual  whitened and projected
std::optional<DeclaredErrorColumns> LikeliestMove(const LinearProblem& problem,
                                                  const Eigen::VectorXd& residual);

}  // namespace plumbline::measure
