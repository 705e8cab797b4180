// Poses spread as far as possible over those that were measured.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "app/diagnosis/dataset.h"
#include "firmware-like/kinematics/pose_distance.h"

namespace plumbline::diagnosis {

/// Most poses that a written model keeps: enough that the nearest of several hundred measured poses
/// in six joints is hardly farther than the nearest of all, and half a microsecond in the cycle.
inline constexpr int kMostPosesKept = 48;

/// Columns as far apart as possible, the first the one nearest to their mean, each further one the
/// farthest from those before it; at most `most`, and no two that are the same
/// [Gonzalez, Theor. Comput. Sci. 38 (1985) 293].
std::vector<Eigen::Index> FarthestColumns(const Eigen::MatrixXd& points, int most);

/// The poses of `rows` that a model fitted to them keeps to count distances from.
/// @param cell  with the frames of that model
std::vector<model::JointVector> KeptPoses(const model::CellModel& cell, const Dataset& data,
                                          const FitRows& rows);

/// Distances of the tip of `cell` from poses; see pose_distance.h.
kinematics::PoseDistance DistanceFrom(const model::CellModel& cell,
                                      const std::vector<model::JointVector>& poses);

/// Distance from the kept poses within which all of `rows` lie [rad].
double ReachOf(const kinematics::PoseDistance& kept, const Dataset& data, const FitRows& rows);

}  // namespace plumbline::diagnosis
