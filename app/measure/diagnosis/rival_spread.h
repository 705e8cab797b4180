// Difference between an answer and its rivals at new points, where no row decides between them.
#pragma once

#include <vector>

#include "app/measure/diagnosis/diagnosis.h"
#include "firmware-like/kinematics/pose_distance.h"

namespace plumbline::measure {

/// Variance of one axis between the answer and the rival with the largest tip displacement [m^2].
/// Used for ranges, which do not test this difference: explanations that agree along the wire may
/// differ across it.
double VarianceBetweenRivals(const Diagnosis& diagnosis);

/// Standard deviation on one axis of the difference between the answer and its rivals at a distance
/// d from the measured poses: sqrt(near_m^2 + (distant_m d)^2).
struct RivalSpread {
  double near_m = 0, distant_m = 0;
};

/// Least squares fit of the squared differences, both terms at least 0. On the rows the
/// explanations agree, so held-out rows do not show how they differ elsewhere; between the points
/// of a grid they may differ however near these are.
/// @param from  distance from the measured poses
/// @param axes  measured lengths per row: 3, or 1 for ranges
RivalSpread SpreadOfRivals(const std::vector<RivalSeparation>& separations,
                           const kinematics::PoseDistance& from, double axes);

}  // namespace plumbline::measure
