// A box of a mesh's tree.
#pragma once

#include "firmware-like/geometry/pose.h"
#include "firmware-like/scene/triangle_mesh.h"

namespace plumbline {

/// In the carrier's frame [m], in single precision and as much larger: one line of the processor's
/// cache. A node's halves stand one behind the other, and both behind it.
struct BoxNode {
  Eigen::Matrix3f axes;  ///< its columns
  Vec3f centre;
  Vec3f half;      ///< of its edges
  int first_half;  ///< the node's first half; below 0: -1 - the number of its one triangle
};
static_assert(sizeof(BoxNode) == 64);

}  // namespace plumbline
