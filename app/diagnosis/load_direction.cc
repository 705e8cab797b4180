#include "app/diagnosis/load_direction.h"

#include <Eigen/Dense>
#include <cmath>
#include <map>
#include <set>

#include "app/diagnosis/thresholds.h"
#include "firmware-like/statistics/student.h"

namespace plumbline::diagnosis {
namespace {

using I = effects::Influence<double>;

constexpr double kCollinear = 1e-3;  // share of the term that the other columns must leave

/// The problem of all rows with equal weights.
LinearProblem ProblemOfAllRows(const Identified& found) {
  FitProblem fit = UnitWeightFit(found.fit.data, found.fit.threads);
  fit.sigma_m = found.fit.sigma_m;
  fit.row_correlation = found.fit.row_correlation;
  return {std::move(fit), found.linear, found.model};
}

/// Columns of the named effects, whitened and projected.
Eigen::MatrixXd NamedColumns(const Identified& found, const LinearProblem& problem) {
  const CandidateSet& candidates = *found.candidate_set;
  Eigen::MatrixXd columns(problem.response().size(),
                          static_cast<Eigen::Index>(found.best.columns.size()));
  std::map<BlockIndex, Eigen::MatrixXd> of_block;
  Eigen::Index at = 0;
  for (const ColumnIndex column : found.best.columns) {
    const BlockIndex block = candidates.BlockOfColumn(column);
    if (!of_block.contains(block))
      of_block[block] = problem.Columns(candidates.blocks()[block], true);
    columns.col(at++) = of_block[block].col(candidates.WithinBlock(column).value());
  }
  return columns;
}

/// A column of a named compliance.
struct Compliance {
  std::string effect;
  Eigen::Index column = 0;
};

/// Revolute joints with a named compliance.
std::map<int, Compliance> CompliantJoints(const Identified& found) {
  const CandidateSet& candidates = *found.candidate_set;
  std::map<int, Compliance> joints;
  Eigen::Index at = 0;
  for (const ColumnIndex column : found.best.columns) {
    const Block& block = candidates.blocks()[candidates.BlockOfColumn(column)];
    const int joint = candidates.JointOfColumn(column);
    if (block.term.effect->traits().adds_compliance && joint >= 0 &&
        found.fit.data.cell.robot.joints[static_cast<std::size_t>(joint)].type ==
            model::JointType::kRevolute) {
      joints.emplace(joint, Compliance{block.id, at});
    }
    ++at;
  }
  return joints;
}

/// Sums of one pose: of products of the term with the residual, of its squares, and of the squared
/// residuals after it is fitted.
struct Sums {
  double product = 0, square = 0, left = 0;
};

/// |t| of a term beside other columns, the least of those without each pose.
/// @param term      less what the other columns explain
/// @param residual  likewise
double LeastT(const LinearProblem& problem, const Eigen::VectorXd& term,
              const Eigen::VectorXd& residual, double freedom) {
  const Sums all{term.dot(residual), term.squaredNorm(),
                 residual.squaredNorm() - std::pow(term.dot(residual), 2) / term.squaredNorm()};
  const Eigen::VectorXd left = residual - all.product / all.square * term;
  std::map<ClusterIndex, Sums> poses;
  for (const FitRowIndex j : problem.rows().indices()) {
    const Eigen::VectorXd x = problem.layout().PartOf(term, j);
    Sums& pose = poses[problem.data().cluster_of[problem.rows()[j]]];
    pose.product += x.dot(problem.layout().PartOf(residual, j));
    pose.square += x.squaredNorm();
    pose.left += problem.layout().PartOf(left, j).squaredNorm();
  }
  double least = HUGE_VAL;
  for (const auto& [index, pose] : poses) {
    const double square = all.square - pose.square;
    if (!(square > kCollinear * all.square)) return 0;  // only this pose shows the term
    const double product = (all.product - pose.product) * (all.product > 0 ? 1 : -1);
    const double variance = (all.left - pose.left) / freedom;
    least = std::min(least, std::max(0.0, product) / std::sqrt(square * variance));
  }
  return least;
}

}  // namespace

std::optional<LoadDirection> LargestLoadDirection(const Identified& found) {
  const std::map<int, Compliance> joints = CompliantJoints(found);
  if (joints.empty()) return std::nullopt;
  const LinearProblem problem = ProblemOfAllRows(found);
  const Eigen::MatrixXd named = NamedColumns(found, problem);
  const Eigen::VectorXd lengths = named.colwise().norm().cwiseMax(1e-300);
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(named * lengths.cwiseInverse().asDiagonal());
  const Eigen::VectorXd values = qr.solve(problem.response());
  const Eigen::VectorXd residual =
      problem.response() - named * lengths.cwiseInverse().cwiseProduct(values);
  const double freedom = problem.freedom() - static_cast<double>(named.cols()) - 1;
  if (freedom < 1) return std::nullopt;
  std::optional<LoadDirection> largest;
  for (const auto& [joint, compliance] : joints) {
    const Eigen::Index at = compliance.column;
    Eigen::MatrixXd term = problem.Carried({I::kLoadShare * model::kMaxJoints + joint},
                                           Eigen::MatrixXd::Ones(problem.rows().count(), 1));
    problem.Project(term);
    const double length = term.norm();
    const Eigen::VectorXd parts = qr.solve(term);
    term -= named * lengths.cwiseInverse().cwiseProduct(parts);
    if (!(term.norm() > kCollinear * length)) continue;  // the torque has one direction
    LoadDirection one;
    one.effect = compliance.effect;
    one.joint = joint;
    one.t = LeastT(problem, term, residual, freedom);
    one.limit = statistics::StudentCoverageFactor(
        1 - kLoadDirectionSignificance / static_cast<double>(joints.size()), freedom);
    const double a = term.col(0).dot(residual) / term.squaredNorm();
    const double c = (values[at] - a * parts[at]) / lengths[at] +
                     found.fit.data.cell.robot.joints[static_cast<std::size_t>(joint)]
                         .compliance_rad_per_Nm.value_or(0);
    one.positive = c + a;
    one.negative = c - a;
    if (!largest || one.t > largest->t) largest = one;
  }
  return largest;
}

}  // namespace plumbline::diagnosis
