#include "app/measure/diagnosis/critics/load_direction.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
namespace {

using I = effects::Influence<double>;

constexpr double kCollinear = 1e-3;  // share of the term that the other columns must leave

/// The problem of all rows with equal weights.
LinearProblem ProblemOfAllRows(const Identified& found) {
  FitProblem fit = UnitWeightFit(found.fit.data, found.fit.threads);
  fit.sigma_m = found.fit.sigma_m;
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
        found.fit.data.cell.robot.joints[joint].type == model::JointType::kRevolute) {
      joints.emplace(joint, Compliance{block.id, at});
    }
    ++at;
  }
  return joints;
}

/// Sums of one pose: of products of the term with the residual, of its squares, of the squared
/// residuals after it is fitted, and their number.
struct Sums {
  double product = 0, square = 0, left = 0;
  int count = 0;
};

/// Sums of each pose.
/// @param term      less what the other columns explain
/// @param residual  likewise
std::vector<Sums> SumsOfPoses(const LinearProblem& problem, const Eigen::VectorXd& term,
                              const Eigen::VectorXd& residual) {
  const Eigen::VectorXd left = residual - term.dot(residual) / term.squaredNorm() * term;
  std::map<ClusterIndex, Sums> poses;
  for (const FitRowIndex j : problem.rows().indices()) {
    const Eigen::VectorXd x = problem.layout().PartOf(term, j);
    Sums& pose = poses[problem.data().cluster_of[problem.rows()[j]]];
    pose.product += x.dot(problem.layout().PartOf(residual, j));
    pose.square += x.squaredNorm();
    pose.left += problem.layout().PartOf(left, j).squaredNorm();
    pose.count += problem.layout().count(j);
  }
  std::vector<Sums> sums;
  sums.reserve(poses.size());
  for (const auto& [index, pose] : poses) sums.push_back(pose);
  return sums;
}

/// |t|, the least of those with one pose left out.
double LeastT(const std::vector<Sums>& poses, double freedom) {
  Sums all;
  for (const Sums& pose : poses) {
    all.product += pose.product;
    all.square += pose.square;
    all.left += pose.left;
  }
  const double sign = all.product > 0 ? 1 : -1;
  double least = HUGE_VAL;
  for (const Sums& out : poses) {
    const double square = all.square - out.square, remaining = freedom - out.count;
    if (!(square > kCollinear * all.square) || remaining < 1) return 0;  // only this pose shows it
    const double product = all.product - out.product;
    double by_poses = 0;
    for (const Sums& pose : poses) {
      if (&pose != &out) by_poses += std::pow(pose.product - product / square * pose.square, 2);
    }
    const auto n = static_cast<double>(poses.size() - 1);
    by_poses *= n / std::max(1.0, n - 1);
    const double by_rows = square * (all.left - out.left) / remaining;
    least = std::min(least, std::max(0.0, sign * product) / std::sqrt(std::max(by_rows, by_poses)));
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
  std::vector<int> tested;
  for (const auto& [joint, compliance] : joints) {
    const Eigen::Index at = compliance.column;
    Eigen::MatrixXd term = problem.Carried({I::kLoadShare * model::kMaxJoints + joint},
                                           Eigen::MatrixXd::Ones(problem.rows().count(), 1));
    problem.Project(term);
    const double length = term.norm();
    const Eigen::VectorXd parts = qr.solve(term);
    term -= named * lengths.cwiseInverse().cwiseProduct(parts);
    if (!(term.norm() > kCollinear * length)) continue;  // the torque has one direction
    tested.push_back(joint);
    LoadDirection one;
    one.effect = compliance.effect;
    one.joint = joint;
    const std::vector<Sums> poses = SumsOfPoses(problem, term, residual);
    one.t = LeastT(poses, freedom);
    // Replicates count once.
    const double of_poses = freedom * static_cast<double>(poses.size()) / problem.rows().count();
    one.limit = statistics::StudentCoverageFactor(
        1 - kLoadDirectionSignificance / static_cast<double>(joints.size()),
        std::max(1.0, of_poses));
    const double a = term.col(0).dot(residual) / term.squaredNorm();
    const double c = (values[at] - a * parts[at]) / lengths[at] +
                     found.fit.data.cell.robot.joints[joint].compliance_rad_per_Nm.value_or(0);
    one.positive = c + a;
    one.negative = c - a;
    if (!largest || one.t > largest->t) largest = one;
  }
  if (largest) largest->tested = std::move(tested);
  return largest;
}

namespace {

ExplanationCheck LoadDirectionCheck(const LoadDirection& found) {
  ExplanationCheck check;
  check.name = "load_direction";
  check.effect = found.effect;
  check.figure = found.t;
  check.limit = found.limit;
  check.passed = !found.significant();
  std::vector<std::string> axes;
  axes.reserve(found.tested.size());
  for (const int joint : found.tested) axes.push_back(std::to_string(joint + 1));
  check.sentence = fmt::format(
      "the residual does not follow the size of the gravity torque of axis {} (largest t = {:.1f}, "
      "limit {:.1f}); an axis whose torque has one direction in all rows is not tested",
      Listed(axes), found.t, found.limit);
  if (check.passed) return check;
  check.sentence = fmt::format(
      "axis {0}: the residual follows the size of its gravity torque (t = {1:.1f}, at most {2:.1f} "
      "by chance), as if it yielded by {3:.2g} rad/(N m) under a positive torque and by {4:.2g} "
      "under a negative one; a compliance that depends on the direction of the load, or "
      "friction on arrivals from one side, would do this",
      found.joint + 1, found.t, found.limit, found.positive, found.negative);
  return check;
}

}  // namespace

Opinion OpinionOnLoadDirection(const Identified& found) {
  const auto direction = LargestLoadDirection(found);
  if (!direction) return {};
  Opinion opinion;
  opinion.checks.push_back(LoadDirectionCheck(*direction));
  if (!direction->significant()) return opinion;
  opinion.notes.push_back(opinion.checks.back().sentence);
  opinion.drivers = {fmt::format("tau{}_Nm", direction->joint + 1)};
  opinion.permits = Verdict::kUnknown;
  return opinion;
}

}  // namespace plumbline::measure
