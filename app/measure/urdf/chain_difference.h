// Comparison of a chain with a Denavit-Hartenberg table over random postures.
#pragma once

#include <vector>

#include "app/measure/urdf/joint_chain.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::measure {

/// Largest distance and angle between two tip poses over a number of postures.
struct ChainDifference {
  double distance_m = 0;
  double angle_rad = 0;
  /// True within 1e-6 mm and 1e-6 degrees: what the digits of a cell file leave.
  bool IsRounding() const { return distance_m <= 1e-9 && angle_rad <= 1e-6 / kDegPerRad; }
  void Add(const Pose& a, const Pose& b);
};

/// Postures drawn uniformly within the limits of the joints; without limits, within +-pi or +-1 m.
/// Deterministic.
std::vector<model::JointVector> RandomPostures(const model::Robot& robot, int count);

/// Difference between the chain's tip and X_WB times the flange of the robot.
/// @param postures  joint values as the controller reports them; the joints of the chain are set to
///                  the positions of the robot's axes there (model::JointCoupling)
ChainDifference DifferenceOf(const JointChain& chain, const model::Robot& robot,
                             const std::vector<model::JointVector>& postures);

}  // namespace plumbline::measure
