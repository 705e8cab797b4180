#include "app/measure/diagnosis/prior_sizes.h"

#include <algorithm>
#include <cmath>

namespace plumbline::measure {
namespace {

constexpr double kMaxSize = 1e3;  // SI; a larger plausible size means that none is given
constexpr double kMinLever =
    1e-3;  // [m/rad]; with a smaller lever arm, the rotation of a joint is not observable

/// The joint of a block's column; -1 if it belongs to none.
int JointOf(const Block& block, BlockColumnIndex column) {
  const int parameter = block.columns[column].parameter;
  return block.term.parameters[parameter].joint;
}

/// Largest rotation of its joint [rad] by one SI unit of each column, over the problem's rows: the
/// displacement of the tip divided by the lever arm of the joint.
Indexed<BlockColumnIndex, double> LargestRotations(const LinearProblem& problem,
                                                   const Block& block) {
  Eigen::MatrixXd columns;
  Indexed<BlockColumnIndex, double> largest(block.columns.size(), 0.0);
  for (const RowIndex row : problem.rows()) {
    const Gradient& gradient = problem.linear().gradients[row];
    columns.resize(gradient.rows(), block.columns.count());
    ColumnsAt(problem.data(), problem.linear(), block, row, columns);
    for (const BlockColumnIndex k : largest.indices()) {
      const int joint = JointOf(block, k);
      if (joint < 0) continue;
      const double lever =
          LengthsOf(gradient.col(effects::Influence<double>::kTurn * model::kMaxJoints + joint))
              .norm();
      if (lever < kMinLever) continue;
      largest[k] = std::max(largest[k], LengthsOf(columns.col(k.value())).norm() / lever);
    }
  }
  return largest;
}

}  // namespace

Indexed<BlockColumnIndex, double> PriorSizes(const LinearProblem& problem, const Block& block) {
  Indexed<BlockColumnIndex, double> sizes;
  sizes.reserve(block.columns.size());
  for (const BlockColumn& column : block.columns) {
    sizes.push_back(std::min(kMaxSize, column.Largest()));
  }
  const double seen_rad = block.term.effect->traits().largest_observed_rotation_rad;
  if (seen_rad == 0) return sizes;
  const Indexed<BlockColumnIndex, double> rotations_rad = LargestRotations(problem, block);
  for (const BlockColumnIndex k : sizes.indices()) {
    const int joint = JointOf(block, k);
    if (joint < 0 || !(rotations_rad[k] > 0)) continue;
    const model::Joint& link = problem.data().cell.robot.joints[joint];
    if (link.type == model::JointType::kPrismatic) continue;
    sizes[k] = std::min(sizes[k], seen_rad / rotations_rad[k]);
  }
  return sizes;
}

}  // namespace plumbline::measure
