// One mesh with FCL's tree over it. Included by sources that measure, and by nothing else.
#pragma once

#include <fcl/geometry/bvh/BVH_model.h>

#include <array>
#include <vector>

#include "firmware-like/scene/bend_field.h"
#include "firmware-like/scene/mesh_facts.h"

namespace plumbline {

using BvhModel = fcl::BVHModel<fcl::OBBRSSd>;

class BvhSolid {
 public:
  BvhSolid(const CheckedMesh& mesh, const Pose& X_KO, double scale);

  /// Moves every vertex to where the bent tool has it, and the tree after them: a volume is
  /// shifted by the middle of its vertices' displacements and grown by half the diagonal of the
  /// box that holds them, so that it still contains them all.
  void Bend(const BendField& field);

  /// Whether some part of `other`, at X_KL, is enclosed; false where this surface is open. Only
  /// where the surfaces do not cross. A part that reaches out of the box around this cannot be; of
  /// any other a vertex decides, by the parity of the triangles that a ray from it meets.
  bool EnclosesPartOf(const BvhSolid& other, const Pose& X_KL) const;

  const BvhModel& model() const { return model_; }
  const Pose& X_KO() const { return X_KO_; }
  double scale() const { return scale_; }

 private:
  void FindBox();
  bool InBox(const Vec3& p_K) const;
  bool Encloses(const Vec3& p_K) const;

  Pose X_KO_;
  double scale_;
  bool closed_;
  std::vector<std::array<std::uint32_t, 6>> ends_;  ///< of its parts (MeshFacts)
  std::vector<Vec3> straight_K_;                    ///< vertices before bending
  std::vector<fcl::OBBRSSd> straight_bvs_;          ///< their volumes
  BvhModel model_;
  Vec3 low_K_, high_K_;
};

/// What FCL makes of a pose.
inline fcl::Transform3d FclOf(const Pose& X) {
  fcl::Transform3d transform = fcl::Transform3d::Identity();
  transform.linear() = X.R;
  transform.translation() = X.p;
  return transform;
}

}  // namespace plumbline
