// Farthest-point selection of the measured poses that a written model stores.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "app/measure/diagnosis/data/dataset.h"
#include "firmware-like/kinematics/pose_distance.h"

namespace plumbline::measure {

/// Maximum number of poses stored in a written model. With several hundred measured poses of six
/// joints, the nearest stored pose is hardly farther away than the nearest measured one; the
/// distance costs half a microsecond in the control cycle.
inline constexpr int kMaxStoredPoses = 48;

/// Indices of at most `most` distinct columns that are far apart: first the column nearest to the
/// mean, then repeatedly the one farthest from those already selected [Gonzalez, Theor. Comput.
/// Sci. 38 (1985) 293].
std::vector<Eigen::Index> FarthestColumns(const Eigen::MatrixXd& points, int most);

/// Selects the poses of `rows` that a model fitted to these rows stores; distances are measured
/// from them.
/// @param cell  with the frames of that model
std::vector<model::JointVector> StoredPoses(const model::CellModel& cell, const Dataset& data,
                                            const FitRows& rows);

/// Distance function from a set of poses for the tip of `cell`; see pose_distance.h.
kinematics::PoseDistance DistanceFrom(const model::CellModel& cell,
                                      const std::vector<model::JointVector>& poses);

/// Largest distance of the `rows` from the stored poses [rad].
double ReachOf(const kinematics::PoseDistance& stored, const Dataset& data, const FitRows& rows);

}  // namespace plumbline::measure
