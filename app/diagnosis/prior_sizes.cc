#include "app/diagnosis/prior_sizes.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "firmware-like/effects/arrival_friction.h"
#include "firmware-like/effects/backlash.h"
#include "firmware-like/effects/joint_compliance.h"
#include "firmware-like/effects/joint_hardening.h"

namespace plumbline {
namespace {

constexpr double kLargestUnit = 1e3;  // SI; more is no plausible size but none given
constexpr double kLeastLever =
    1e-3;  // [m/rad] of the tip: a joint that moves it less shows no turn

/// What an effect of revolute joints turns them by, as real arms show it.
struct TurnOfJoint {
  const Effect& (*effect)();
  double turn_rad;
};

constexpr std::array kTurns = {
    // Wind-up at the largest gravity torque: 2.2 to 3.2 mrad for arms with cycloidal or strain wave
    // gears [Dumas et al. 2011; Klimchik et al. 2013; makers' catalogues], 7 for the softest class,
    // arms with joint torque sensors, twice that the largest seen there.
    TurnOfJoint{JointCompliance, 7e-3},
    // The secant stiffness rises by at most 1.8 from zero to rated torque [K3/K1 of strain wave
    // gears, Harmonic Drive CSF catalogue]: less than half of the wind-up.
    TurnOfJoint{JointHardening, 3.5e-3},
    // Lost motion and hysteresis: below 1 arcmin for cycloidal gears [Nabtesco RV catalogue], 1 to
    // 2
    // for strain wave gears [Harmonic Drive]. 2 arcmin.
    TurnOfJoint{Backlash, 6e-4},
    TurnOfJoint{ArrivalFriction, 6e-4},
};

/// The joint of a block's column, -1 where it belongs to none.
int JointOf(const Block& block, BlockColumnIndex column) {
  const int parameter = block.columns[column].parameter;
  return block.term.parameters[static_cast<std::size_t>(parameter)].joint;
}

/// Largest turn of its joint that one SI unit of each column makes at the problem's rows [rad]:
/// what moves the tip through a joint alone does so as the joint's turn does.
Indexed<BlockColumnIndex, double> LargestTurns(const LinearProblem& problem, const Block& block) {
  Eigen::MatrixXd columns;
  Indexed<BlockColumnIndex, double> largest(block.columns.size(), 0.0);
  for (const RowIndex row : problem.rows()) {
    const Gradient& of = problem.linear().gradients[row];
    columns.resize(of.rows(), block.columns.count());
    ColumnsAt(problem.data(), problem.linear(), block, row, columns);
    for (const BlockColumnIndex k : largest.indices()) {
      const int joint = JointOf(block, k);
      if (joint < 0) continue;
      const double lever = LengthsOf(of.col(Influence<double>::kTurn * kMaxJoints + joint)).norm();
      if (lever < kLeastLever) continue;
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
    sizes.push_back(std::min(kLargestUnit, column.Largest()));
  }
  const auto source = std::find_if(kTurns.begin(), kTurns.end(), [&](const TurnOfJoint& known) {
    return &known.effect() == block.term.effect;
  });
  if (source == kTurns.end()) return sizes;
  const Indexed<BlockColumnIndex, double> turns_rad = LargestTurns(problem, block);
  for (const BlockColumnIndex k : sizes.indices()) {
    const int joint = JointOf(block, k);
    if (joint < 0 || !(turns_rad[k] > 0)) continue;
    const Joint& of = problem.data().cell.robot.joints[static_cast<std::size_t>(joint)];
    if (of.type == JointType::kPrismatic) continue;
    sizes[k] = std::min(sizes[k], source->turn_rad / turns_rad[k]);
  }
  return sizes;
}

}  // namespace plumbline
