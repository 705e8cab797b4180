// Two meshes somewhere: which of their triangles cross, and which points are nearest.
#pragma once

#include <limits>
#include <vector>

#include "app/scene/bvh_solid.h"
#include "app/scene/triangle_pair.h"

namespace plumbline {

/// Numbers of triangles; -1: none.
struct TrianglePair {
  int a = -1, b = -1;
};

/// In the first mesh's frame [m].
struct NearestPoints {
  double distance_m = std::numeric_limits<double>::infinity();
  Vec3 p_a_A = Vec3::Zero(), p_b_A = Vec3::Zero();
  TrianglePair triangles;
};

/// Goes down both trees at once. Boxes are compared in single precision, with a margin for its
/// rounding; triangles in double precision.
class MeshPair {
 public:
  /// @param X_AB  of b's frame in a's; both meshes must outlive this
  MeshPair(const BvhSolid& a, const BvhSolid& b, const Pose& X_AB);

  /// Triangles that cross, the first `most` that are found.
  std::vector<TrianglePair> Crossing(std::size_t most) const;
  bool Cross() const { return !Crossing(1).empty(); }

  /// Only where nothing crosses.
  /// @param near  triangles that may be near: what they are apart bounds the search from its start,
  ///              and halves it where things move little from one look to the next
  NearestPoints Nearest(const TrianglePair& near) const;

  /// Of a triangle of the first mesh, of the second one; both in the first one's frame.
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

}  // namespace plumbline
