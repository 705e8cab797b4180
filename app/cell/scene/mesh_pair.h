// Intersection and distance queries between two meshes.
#pragma once

#include <limits>
#include <vector>

#include "app/cell/scene/bvh_solid.h"
#include "app/cell/scene/triangle_pair.h"

namespace plumbline::cell {

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
