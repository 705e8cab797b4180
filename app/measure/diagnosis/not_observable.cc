#include "app/measure/diagnosis/not_observable.h"

namespace plumbline::measure {
namespace {

using I = effects::Influence<double>;
constexpr double kAbsorbed = 1e-3;  // share of a column that the nuisances must leave

/// Whitened column of a common factor of all lengths of arm and tool.
Eigen::VectorXd ScaleColumn(const LinearProblem& problem) {
  const model::CellModel& cell = problem.data().cell;
  Eigen::VectorXd column = Eigen::VectorXd::Zero(problem.response().size());
  for (int joint = 0; joint < cell.robot.size(); ++joint) {
    const model::Joint& of = cell.robot.joints[static_cast<std::size_t>(joint)];
    column += of.a_m * problem.Carrier(I::kLengthA * model::kMaxJoints + joint);
    column += of.d_m * problem.Carrier(I::kOffsetD * model::kMaxJoints + joint);
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (cell.tools() == 1) {
      column += cell.tool.tcp_F[axis] * problem.Carrier(I::kTip + axis);
      continue;
    }
    Eigen::MatrixXd tips(static_cast<Eigen::Index>(problem.rows().size()), 1);  // by row
    Eigen::Index at = 0;
    for (const RowIndex row : problem.rows()) {
      tips(at++, 0) = cell.ToolAt(problem.data().payloads[row].tool).tcp_F[axis];
    }
    column += problem.Carried({I::kTip + axis}, tips).col(0);
  }
  return column;
}

bool Absorbed(const LinearProblem& problem, Eigen::MatrixXd columns) {
  const double before = columns.norm();
  problem.Project(columns);
  return columns.norm() <= kAbsorbed * before;
}

}  // namespace

void AddFreeOfArtefacts(const LinearProblem& problem, Diagnosis& diagnosis) {
  const Dataset& data = problem.data();
  if (data.instrument_used()) return;
  Eigen::MatrixXd base(problem.response().size(), 3);
  for (int axis = 0; axis < 3; ++axis) base.col(axis) = problem.Carrier(I::kBase + axis);
  if (data.frames_free() && Absorbed(problem, base)) {  // otherwise it is an effect like any other
    diagnosis.not_observable.push_back(
        {"base_frame",
         {},
         {},
         "no row relates the robot's base to the measurement frame: it stays as declared. Give the "
         "place of three artefacts, or measure with an instrument"});
  }
  if (Absorbed(problem, ScaleColumn(problem))) {
    diagnosis.not_observable.push_back(
        {"scale",
         {},
         {},
         "if all lengths of the arm change in proportion, unknown places change with them: give a "
         "[[distance]] between two artefacts, or the places of two"});
  }
}

}  // namespace plumbline::measure
