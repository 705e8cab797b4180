// One mesh with a tree of boxes over it. Included by sources that measure, and by nothing else.
#pragma once

#include <array>
#include <vector>

#include "app/scene/box_node.h"
#include "firmware-like/scene/bend_field.h"
#include "firmware-like/scene/mesh_facts.h"

namespace plumbline {

/// FCL builds the tree (oriented boxes, halved along their longest edge); it is kept in a quarter
/// of the memory, which is most of what a search waits for.
class BvhSolid {
 public:
  BvhSolid(const CheckedMesh& mesh, const Pose& X_KO, double scale);

  /// Moves every vertex to where the bent tool has it, and the tree after them: a box is shifted by
  /// the middle of its vertices' displacements and grown by half the diagonal of the box that holds
  /// them, so that it still contains them all.
  void Bend(const BendField& field);

  /// Whether some part of `other`, at X_KL, is enclosed; false where this surface is open. Only
  /// where the surfaces do not cross. A part that reaches out of the box around this cannot be; of
  /// any other a vertex decides: it is enclosed where this surface winds around it, that is, where
  /// a ray from it leaves through more triangles than it enters by. So bodies that overlap in one
  /// file enclose what both hold, and a cavity whose triangles face into it is free. Where
  /// triangles face different ways nothing winds; then the parity of what the ray meets decides.
  bool EnclosesPartOf(const BvhSolid& other, const Pose& X_KL) const;

  const std::vector<Vec3>& vertices_K() const {  ///< bent
    return vertices_K_.empty() ? straight_K_ : vertices_K_;
  }
  const std::vector<Triangle>& triangles() const { return triangles_; }
  const std::vector<BoxNode>& nodes() const {  ///< around the bent ones
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
  bool winds_;  ///< its triangles face one way, from each to its neighbours
  std::vector<std::array<std::uint32_t, 6>> ends_;  ///< of its parts (MeshFacts)
  std::vector<Triangle> triangles_;
  std::vector<Vec3> straight_K_, vertices_K_;    ///< before bending, and after; empty: never bent
  std::vector<BoxNode> straight_nodes_, nodes_;  ///< around them
  Vec3 low_K_, high_K_;
};

}  // namespace plumbline
