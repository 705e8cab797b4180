#include "app/measure/diagnosis/joint_combinations.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <set>

#include "app/measure/diagnosis/diagnosis_text.h"
#include "app/measure/diagnosis/thresholds.h"

namespace plumbline::measure {
namespace {

/// One row per accepted pose, however often it was visited; all joints.
Eigen::MatrixXd AcceptedAngles(const FitProblem& problem) {
  const int joints = problem.data.cell.robot.size();
  Eigen::MatrixXd angles(problem.data.rows(), joints);
  Eigen::Index count = 0;
  std::set<ClusterIndex> visited;
  for (const RowIndex row : problem.data.row_indices()) {
    if (problem.weights[row] < kOutlierWeight) continue;
    if (!visited.insert(problem.data.cluster_of[row]).second) continue;
    angles.row(count++) = problem.data.measured(row).q.transpose();
  }
  return angles.topRows(count);
}

/// Standard deviation [rad]; 0 for a prismatic joint and for one that hardly moved.
Eigen::VectorXd Spreads(const model::Robot& robot, const Eigen::MatrixXd& deviations) {
  constexpr double kMinSpread_rad = 0.02;
  Eigen::VectorXd spreads =
      (deviations.colwise().squaredNorm() / static_cast<double>(deviations.rows())).cwiseSqrt();
  for (int joint = 0; joint < robot.size(); ++joint) {
    const model::JointType type = robot.joints[static_cast<std::size_t>(joint)].type;
    if (type == model::JointType::kPrismatic || spreads[joint] < kMinSpread_rad) spreads[joint] = 0;
  }
  return spreads;
}

model::JointCombination CombinationAlong(const Eigen::VectorXd& weights,
                                         const Eigen::MatrixXd& angles) {
  constexpr double kMargin_rad = 0.02;
  const Eigen::VectorXd sums = angles * weights;
  return {weights, {sums.minCoeff() - kMargin_rad, sums.maxCoeff() + kMargin_rad}};
}

/// The joints that take part in a combination, e.g. "q2 and q3".
std::string JointsText(const model::JointCombination& combination) {
  constexpr double kTakesPart = 0.15;
  std::vector<std::string> joints;
  for (Eigen::Index k = 0; k < combination.weights.size(); ++k) {
    if (std::abs(combination.weights[k]) > kTakesPart) joints.push_back(fmt::format("q{}", k + 1));
  }
  return Listed(joints);
}

}  // namespace

std::vector<model::JointCombination> NearlyConstantCombinations(const FitProblem& problem) {
  constexpr double kNearlyConstant = 0.05;  // eigenvalue
  constexpr int kRowsPerJoint = 3;
  const Eigen::MatrixXd angles = AcceptedAngles(problem);
  const Eigen::Index joints = angles.cols();
  if (angles.rows() < kRowsPerJoint * joints) return {};
  const Eigen::MatrixXd deviations = angles.rowwise() - angles.colwise().mean();
  const Eigen::VectorXd spreads = Spreads(problem.data.cell.robot, deviations);
  // A joint without spread gets the eigenvalue 1 of its own, and takes part in no other.
  const Eigen::VectorXd scales =
      (spreads.array() > 0).select(spreads.array().max(1e-12).inverse(), 0);
  const Eigen::MatrixXd standard = deviations * scales.asDiagonal();
  Eigen::MatrixXd correlations =
      standard.transpose() * standard / static_cast<double>(angles.rows());
  for (Eigen::Index k = 0; k < joints; ++k) correlations(k, k) = 1;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(correlations);
  std::vector<model::JointCombination> combinations;
  for (Eigen::Index k = 0; k < joints && eigen.eigenvalues()[k] < kNearlyConstant; ++k) {
    const Eigen::VectorXd weights = eigen.eigenvectors().col(k).cwiseProduct(scales);
    combinations.push_back(CombinationAlong(weights.normalized(), angles));
  }
  return combinations;
}

std::optional<std::string> MovedTogetherNote(
    const std::vector<model::JointCombination>& combinations) {
  if (combinations.empty()) return std::nullopt;
  std::vector<std::string> joints;
  for (const model::JointCombination& combination : combinations) {
    joints.push_back(JointsText(combination));
  }
  return fmt::format(
      "joints moved together in the measured poses ({}): poses that move them apart are outside "
      "the measured range; if the robot works at such poses, measure some",
      fmt::join(joints, "; "));
}

}  // namespace plumbline::measure
