// How far one mesh must be moved until it touches the other one no more.
#pragma once

#include <vector>

#include "app/scene/mesh_pair.h"

namespace plumbline {

/// Whether some part of one lies in the other. Only where their surfaces do not cross.
bool OneInOther(const BvhSolid& a, const BvhSolid& b, const Pose& X_AB);

/// As Separation tells it (interference.h).
struct WayOut {
  double depth_m = 0;
  Vec3 way_A = Vec3::Zero();
};

/// Looks along the guess and against it at places that lie farther and farther, and halves what is
/// between the last that touches and the first that is free. Where triangles cross, how far they go
/// on crossing along that way is known (ExitOf), and nothing on the way to there is looked at.
/// @param crossing  the triangles that cross, empty where one lies in the other
/// @param guess_A   a unit vector
/// @param step_m    resolution of the depth
WayOut WayOutOf(const BvhSolid& a, const BvhSolid& b, const Pose& X_AB,
                const std::vector<TrianglePair>& crossing, const Vec3& guess_A, double step_m);

}  // namespace plumbline
