#include "app/scene/bvh_solid.h"

#include <algorithm>

namespace plumbline {
namespace {

/// Displacements of some vertices: the box that holds them.
struct Shifts {
  Vec3 low, high;
};

/// Whether a ray from p meets the triangle. [Moeller & Trumbore 1997]
bool RayMeets(const Vec3& p, const Vec3& ray, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, normal_part = ray.cross(ac);
  const double det = ab.dot(normal_part);
  if (det == 0) return false;
  const Vec3 ap = p - a;
  const double u = ap.dot(normal_part) / det;
  if (u < 0 || u > 1) return false;
  const Vec3 q = ap.cross(ab);
  const double v = ray.dot(q) / det;
  return v >= 0 && u + v <= 1 && ac.dot(q) / det > 0;
}

}  // namespace

BvhSolid::BvhSolid(const CheckedMesh& mesh, const Pose& X_KO, double scale)
    : X_KO_(X_KO), scale_(scale), closed_(mesh.facts.closed()), ends_(mesh.facts.ends) {
  straight_K_.reserve(mesh.mesh.vertices_O.size());
  for (const Vec3f& p : mesh.mesh.vertices_O) {
    straight_K_.push_back(X_KO * Vec3(scale * p.cast<double>()));
  }
  std::vector<fcl::Triangle> triangles;
  triangles.reserve(mesh.mesh.triangles.size());
  for (const Triangle& t : mesh.mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  model_.beginModel(static_cast<int>(triangles.size()), static_cast<int>(straight_K_.size()));
  model_.addSubModel(straight_K_, triangles);
  model_.endModel();
  straight_bvs_.reserve(static_cast<std::size_t>(model_.getNumBVs()));
  for (int i = 0; i < model_.getNumBVs(); ++i) straight_bvs_.push_back(model_.getBV(i).bv);
  FindBox();
}

void BvhSolid::Bend(const BendField& field) {
  for (std::size_t i = 0; i < straight_K_.size(); ++i) {
    model_.vertices[i] = BentPoint(field, straight_K_[i]);
  }
  // Children stand behind their parents, so that from the end they are done before them.
  std::vector<Shifts> shifts(straight_bvs_.size());
  for (int i = model_.getNumBVs(); i-- > 0;) {
    auto& node = model_.getBV(i);
    Shifts& of_node = shifts[static_cast<std::size_t>(i)];
    if (node.isLeaf()) {
      const fcl::Triangle& triangle = model_.tri_indices[node.primitiveId()];
      const auto shift = [&](int k) {
        return Vec3(model_.vertices[triangle[k]] - straight_K_[triangle[k]]);
      };
      const Vec3 a = shift(0), b = shift(1), c = shift(2);
      of_node = {a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)};
    } else {
      const Shifts& left = shifts[static_cast<std::size_t>(node.leftChild())];
      const Shifts& right = shifts[static_cast<std::size_t>(node.rightChild())];
      of_node = {left.low.cwiseMin(right.low), left.high.cwiseMax(right.high)};
    }
    const Vec3 middle = 0.5 * (of_node.low + of_node.high);
    const double apart = 0.5 * (of_node.high - of_node.low).norm();
    const fcl::OBBRSSd& straight = straight_bvs_[static_cast<std::size_t>(i)];
    node.bv.obb.To = straight.obb.To + middle;
    node.bv.obb.extent = straight.obb.extent.array() + apart;
    node.bv.rss.To = straight.rss.To + middle;
    node.bv.rss.r = straight.rss.r + apart;
  }
  FindBox();
}

void BvhSolid::FindBox() {
  low_K_ = high_K_ = model_.vertices[0];
  for (std::size_t i = 1; i < straight_K_.size(); ++i) {
    low_K_ = low_K_.cwiseMin(model_.vertices[i]);
    high_K_ = high_K_.cwiseMax(model_.vertices[i]);
  }
}

bool BvhSolid::InBox(const Vec3& p_K) const {
  return (p_K.array() >= low_K_.array()).all() && (p_K.array() <= high_K_.array()).all();
}

bool BvhSolid::Encloses(const Vec3& p_K) const {
  const Vec3 ray(0.5671, 0.3313, 0.7541);  // along no edge or face that somebody would draw
  bool odd = false;
  for (int i = 0; i < model_.num_tris; ++i) {
    const fcl::Triangle& t = model_.tri_indices[i];
    odd ^= RayMeets(p_K, ray, model_.vertices[t[0]], model_.vertices[t[1]], model_.vertices[t[2]]);
  }
  return odd;
}

bool BvhSolid::EnclosesPartOf(const BvhSolid& other, const Pose& X_KL) const {
  if (!closed_) return false;
  return std::any_of(other.ends_.begin(), other.ends_.end(), [&](const auto& ends) {
    const auto at = [&](std::uint32_t i) { return Vec3(X_KL * other.model_.vertices[i]); };
    const auto in_box = [&](std::uint32_t i) { return InBox(at(i)); };
    return std::all_of(ends.begin(), ends.end(), in_box) && Encloses(at(ends[0]));
  });
}

}  // namespace plumbline
