// Node of a mesh's bounding volume tree: an oriented box.
#pragma once

#include "firmware-like/geometry/pose.h"
#include "firmware-like/scene/triangle_mesh.h"

namespace plumbline::display {

/// Oriented box in the carrier's frame [m]. Stored in single precision, enlarged by the rounding
/// error, so that a node fits one cache line. A node's two children are adjacent and come after it.
struct BoxNode {
  Eigen::Matrix3f axes;  ///< its columns
  Vec3f centre;
  Vec3f half;       ///< half edge lengths
  int first_child;  ///< index of the first child; of a leaf: -1 - index of its triangle
};
static_assert(sizeof(BoxNode) == 64);

}  // namespace plumbline::display
