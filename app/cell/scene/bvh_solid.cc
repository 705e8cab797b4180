#include "app/cell/scene/bvh_solid.h"

#include <fcl/geometry/bvh/BVH_model.h>

#include <algorithm>

namespace plumbline::cell {
namespace {

/// Bounding box of the displacements of some vertices.
struct Shifts {
  Vec3f low, high;
};

/// Relative rounding error of single precision, with a margin.
constexpr float kRounded = 1e-6F;

/// Whether a ray from p hits the triangle: 1 from behind, -1 from the front, 0 not at all.
/// [Moeller & Trumbore 1997]
int RayMeets(const Vec3& p, const Vec3& ray, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, normal_part = ray.cross(ac);
  const double det = ab.dot(normal_part);
  if (det == 0) return 0;
  const Vec3 ap = p - a;
  const double u = ap.dot(normal_part) / det;
  if (u < 0 || u > 1) return 0;
  const Vec3 q = ap.cross(ab);
  const double v = ray.dot(q) / det;
  if (v < 0 || u + v > 1 || ac.dot(q) / det <= 0) return 0;
  return det < 0 ? 1 : -1;
}

}  // namespace

BvhSolid::BvhSolid(const scene::CheckedMesh& mesh, const Pose& X_KO, double scale)
    : X_KO_(X_KO),
      scale_(scale),
      closed_(mesh.facts.closed()),
      consistently_oriented_(mesh.facts.opposed_edges == 0),
      ends_(mesh.facts.ends),
      triangles_(mesh.mesh.triangles) {
  straight_K_.reserve(mesh.mesh.vertices_O.size());
  for (const Vec3f& p : mesh.mesh.vertices_O) {
    straight_K_.push_back(X_KO * Vec3(scale * p.cast<double>()));
  }
  BuildTree();
  FindBox();
}

void BvhSolid::BuildTree() {
  std::vector<fcl::Triangle> triangles;
  triangles.reserve(triangles_.size());
  for (const scene::Triangle& t : triangles_) triangles.emplace_back(t[0], t[1], t[2]);
  fcl::BVHModel<fcl::OBBd> built;
  built.beginModel(static_cast<int>(triangles.size()), static_cast<int>(straight_K_.size()));
  built.addSubModel(straight_K_, triangles);
  built.endModel();
  straight_nodes_.reserve(static_cast<std::size_t>(built.getNumBVs()));
  for (int i = 0; i < built.getNumBVs(); ++i) {
    const auto& node = built.getBV(i);
    const Vec3 half = node.bv.extent.array() +
                      kRounded * (node.bv.extent.maxCoeff() + node.bv.To.cwiseAbs().maxCoeff());
    straight_nodes_.push_back({node.bv.axis.cast<float>(), node.bv.To.cast<float>(),
                               half.cast<float>(),
                               node.isLeaf() ? -1 - node.primitiveId() : node.leftChild()});
  }
}

void BvhSolid::Bend(const scene::BendField& field) {
  if (nodes_.empty()) {
    vertices_K_ = straight_K_;
    nodes_ = straight_nodes_;
  }
  for (std::size_t i = 0; i < straight_K_.size(); ++i) {
    vertices_K_[i] = scene::BentPoint(field, straight_K_[i]);
  }
  // Children come after their parent, so iterating backwards processes them first.
  std::vector<Shifts> shifts(nodes_.size());
  for (std::size_t i = nodes_.size(); i-- > 0;) {
    const BoxNode& straight = straight_nodes_[i];
    Shifts& of_node = shifts[i];
    if (straight.first_child < 0) {
      const scene::Triangle& triangle =
          triangles_[static_cast<std::size_t>(-1 - straight.first_child)];
      const auto shift = [&](std::uint32_t k) {
        return Vec3f((vertices_K_[k] - straight_K_[k]).cast<float>());
      };
      const Vec3f a = shift(triangle[0]), b = shift(triangle[1]), c = shift(triangle[2]);
      of_node = {a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)};
    } else {
      const auto first = static_cast<std::size_t>(straight.first_child);
      const Shifts &one = shifts[first], &other = shifts[first + 1];
      of_node = {one.low.cwiseMin(other.low), one.high.cwiseMax(other.high)};
    }
    const Vec3f middle = 0.5F * (of_node.low + of_node.high);
    const float apart = 0.5F * (of_node.high - of_node.low).norm() +
                        kRounded * straight.centre.cwiseAbs().maxCoeff();
    nodes_[i].centre = straight.centre + middle;
    nodes_[i].half = straight.half.array() + apart;
  }
  FindBox();
}

void BvhSolid::FindBox() {
  low_K_ = high_K_ = vertices_K()[0];
  for (const Vec3& p_K : vertices_K()) {
    low_K_ = low_K_.cwiseMin(p_K);
    high_K_ = high_K_.cwiseMax(p_K);
  }
}

bool BvhSolid::InBox(const Vec3& p_K) const {
  return (p_K.array() >= low_K_.array()).all() && (p_K.array() <= high_K_.array()).all();
}

bool BvhSolid::Encloses(const Vec3& p_K) const {
  const Vec3 ray(0.5671, 0.3313, 0.7541);  // unlikely to be parallel to an edge or face
  int winding = 0;
  bool odd = false;
  const std::vector<Vec3>& at = vertices_K();
  for (const scene::Triangle& t : triangles_) {
    const int meets = RayMeets(p_K, ray, at[t[0]], at[t[1]], at[t[2]]);
    winding += meets;
    odd ^= meets != 0;
  }
  return consistently_oriented_ ? winding != 0 : odd;
}

bool BvhSolid::EnclosesPartOf(const BvhSolid& other, const Pose& X_KL) const {
  if (!closed_) return false;
  return std::any_of(other.ends_.begin(), other.ends_.end(), [&](const auto& ends) {
    const auto at = [&](std::uint32_t i) { return Vec3(X_KL * other.vertices_K()[i]); };
    const auto in_box = [&](std::uint32_t i) { return InBox(at(i)); };
    return std::all_of(ends.begin(), ends.end(), in_box) && Encloses(at(ends[0]));
  });
}

}  // namespace plumbline::cell
