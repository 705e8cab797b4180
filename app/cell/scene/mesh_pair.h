// Intersection and distance queries between two meshes.
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "firmware-like/geometry/pose.h"
#include "firmware-like/scene/bend_field.h"
#include "firmware-like/scene/mesh_facts.h"
#include "firmware-like/scene/triangle_mesh.h"

namespace plumbline::cell {

// Mesh with a bounding volume tree that is updated as the mesh bends. Internal to this folder.

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

// Intersection tests of two triangles.

using Corners = std::array<Vec3, 3>;

/// Whether two triangles intersect, by the separating axis theorem. Axes: both normals, the cross
/// products of the edges of one with those of the other and, for coplanar triangles, of each edge
/// with its normal.                                                      [Gottschalk et al. 1996]
bool TrianglesCross(const Corners& a, const Corners& b);

/// Position along its path at which a moving triangle a separates from triangle b.
struct TriangleExit {
  double way_m = 0;            ///< the triangles intersect up to here and not beyond
  Vec3 normal = Vec3::Zero();  ///< separating axis at the exit, not normalised
};

/// Travel of a along a unit vector until it leaves b: the smallest one at which an axis separates
/// them. Only for triangles that intersect.
TriangleExit ExitOf(const Corners& a, const Corners& b, const Vec3& along);

/// Centre of the intersection segment of two triangles; nullopt if they are coplanar.
std::optional<Vec3> MiddleOfCrossing(const Corners& a, const Corners& b);

/// Triangle indices, -1 for none.
struct TrianglePair {
  int a = -1, b = -1;
};

/// Nearest points of two meshes, in the first one's frame [m].
struct NearestPoints {
  double distance_m = std::numeric_limits<double>::infinity();
  Vec3 p_a_A = Vec3::Zero(), p_b_A = Vec3::Zero();
  TrianglePair triangles;
};

/// Simultaneous traversal of both trees. Boxes are compared in single precision with a margin for
/// rounding, triangles in double precision.
class MeshPair {
 public:
  /// @param X_AB  pose of b's frame in a's; both meshes must outlive this object
  MeshPair(const BvhSolid& a, const BvhSolid& b, const Pose& X_AB);

  /// Pairs of intersecting triangles, at most the first `most` found.
  std::vector<TrianglePair> Crossing(std::size_t most) const;
  bool Cross() const { return !Crossing(1).empty(); }

  /// Call only if no triangles intersect.
  /// @param near  initial guess, whose distance bounds the search; halves the search time if
  ///              objects move little between calls
  NearestPoints Nearest(const TrianglePair& near) const;

  /// Corners of a triangle of the first or the second mesh, in the first one's frame.
  Corners CornersOfA(int triangle) const;
  Corners CornersOfB(int triangle) const;

 private:
  float Gap(const BoxNode& a, const BoxNode& b, float enough_m) const;
  void CrossingBelow(int a, int b, std::size_t most, std::vector<TrianglePair>& found) const;
  void NearestBelow(int a, int b, NearestPoints& found) const;
  void NearestOf(const TrianglePair& pair, NearestPoints& found) const;

  const BvhSolid& a_;
  const BvhSolid& b_;
  const Pose X_AB_;
  Eigen::Matrix3f R_AB_;
  Vec3f p_AB_;
  float margin_m_;
};

}  // namespace plumbline::cell
