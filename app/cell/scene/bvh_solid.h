// Mesh with a bounding volume tree that is updated as the mesh bends. Internal to this folder.
#pragma once

#include <array>
#include <vector>

#include "firmware-like/geometry/pose.h"
#include "firmware-like/scene/bend_field.h"
#include "firmware-like/scene/mesh_facts.h"
#include "firmware-like/scene/triangle_mesh.h"

namespace plumbline::cell {

/// Oriented box in the carrier's frame [m]. Stored in single precision, enlarged by the rounding
/// error, so that a node fits one cache line. A node's two children are adjacent and come after it.
struct BoxNode {
  Eigen::Matrix3f axes;  ///< its columns
  Vec3f centre;
  Vec3f half;       ///< half edge lengths
  int first_child;  ///< index of the first child; of a leaf: -1 - index of its triangle
};
static_assert(sizeof(BoxNode) == 64);

/// FCL builds the tree (oriented boxes, split along their longest edge); it is stored in a quarter
/// of the memory, since memory access dominates the search time.
class BvhSolid {
 public:
  BvhSolid(const scene::CheckedMesh& mesh, const Pose& X_KO, double scale);

  /// Moves all vertices with the bent tool and updates the tree: a box is shifted by the mid-range
  /// of its vertices' displacements and enlarged by half the diagonal of their bounding box, so
  /// that it still contains all of them.
  void Bend(const scene::BendField& field);

  /// Whether some connected part of `other`, at X_KL, is enclosed; false if this surface is open.
  /// The surfaces must not cross. A part that extends beyond the bounding box is not enclosed; for
  /// any other part the winding number at one of its vertices decides, counted along a ray:
  /// triangles left through minus triangles entered through. Overlapping bodies in one file thus
  /// enclose what either encloses, and a cavity whose triangles face into it is free. If the
  /// triangles are not consistently oriented, the parity of the ray's intersections decides.
  bool EnclosesPartOf(const BvhSolid& other, const Pose& X_KL) const;

  const std::vector<Vec3>& vertices_K() const {  ///< as bent
    return vertices_K_.empty() ? straight_K_ : vertices_K_;
  }
  const std::vector<scene::Triangle>& triangles() const { return triangles_; }
  const std::vector<BoxNode>& nodes() const {  ///< tree around the bent vertices
    return nodes_.empty() ? straight_nodes_ : nodes_;
  }
  const Pose& X_KO() const { return X_KO_; }
  double scale() const { return scale_; }

 private:
  void BuildTree();
  void FindBox();
  bool InBox(const Vec3& p_K) const;
  bool Encloses(const Vec3& p_K) const;

  Pose X_KO_;
  double scale_;
  bool closed_;
  bool consistently_oriented_;  ///< neighbouring triangles are consistently oriented
  std::vector<std::array<std::uint32_t, 6>> ends_;  ///< extreme vertices of each part (MeshFacts)
  std::vector<scene::Triangle> triangles_;
  std::vector<Vec3> straight_K_, vertices_K_;    ///< before and after bending; empty if never bent
  std::vector<BoxNode> straight_nodes_, nodes_;  ///< trees around them
  Vec3 low_K_, high_K_;
};

}  // namespace plumbline::cell
