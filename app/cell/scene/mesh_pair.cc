#include "app/cell/scene/mesh_pair.h"

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/detail/primitive_shape_algorithm/triangle_distance.h>

#include <algorithm>
#include <cmath>
#include <utility>

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

namespace {

/// Extent of a triangle along an axis.
struct Extent {
  double low, high;
};

Extent ExtentOf(const Corners& triangle, const Vec3& axis) {
  const double p = axis.dot(triangle[0]), q = axis.dot(triangle[1]), r = axis.dot(triangle[2]);
  return {std::min({p, q, r}), std::max({p, q, r})};
}

/// Calls `holds` for each potential separating axis until it returns false.
/// @return  whether it returned true for all
template <typename Holds>
bool ForEachAxis(const Corners& a, const Corners& b, const Holds& holds) {
  const std::array<Vec3, 3> ab = {a[1] - a[0], a[2] - a[1], a[0] - a[2]},
                            cd = {b[1] - b[0], b[2] - b[1], b[0] - b[2]};
  const Vec3 n = ab[0].cross(ab[1]), m = cd[0].cross(cd[1]);
  if (!holds(n) || !holds(m)) return false;
  for (const Vec3& edge : ab) {
    for (const Vec3& other : cd) {
      if (!holds(edge.cross(other))) return false;
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    if (!holds(ab[i].cross(n)) || !holds(cd[i].cross(m))) return false;
  }
  return true;
}

/// Point at which the edge from p to q passes through a triangle.
std::optional<Vec3> Passes(const Vec3& p, const Vec3& q, const Corners& triangle) {
  const Vec3 ab = triangle[1] - triangle[0], ac = triangle[2] - triangle[0];
  const Vec3 n = ab.cross(ac), pq = q - p;
  const double slope = n.dot(pq);
  if (slope == 0) return std::nullopt;
  const double at = n.dot(triangle[0] - p) / slope;
  if (at < 0 || at > 1) return std::nullopt;
  const Vec3 point = p + at * pq, ap = point - triangle[0];
  const double u = n.dot(ap.cross(ac)), v = n.dot(ab.cross(ap)), all = n.squaredNorm();
  if (u < 0 || v < 0 || u + v > all) return std::nullopt;
  return point;
}

}  // namespace

bool TrianglesCross(const Corners& a, const Corners& b) {
  return ForEachAxis(a, b, [&](const Vec3& axis) {
    const Extent of_a = ExtentOf(a, axis), of_b = ExtentOf(b, axis);
    return of_a.low <= of_b.high && of_b.low <= of_a.high;
  });
}

TriangleExit ExitOf(const Corners& a, const Corners& b, const Vec3& along) {
  TriangleExit exit{std::numeric_limits<double>::infinity(), along};
  ForEachAxis(a, b, [&](const Vec3& axis) {
    const double speed = axis.dot(along);
    if (speed == 0) return true;
    const Extent of_a = ExtentOf(a, axis), of_b = ExtentOf(b, axis);
    const double way_m = (speed > 0 ? of_b.high - of_a.low : of_b.low - of_a.high) / speed;
    if (way_m < exit.way_m) exit = {way_m, speed > 0 ? axis : Vec3(-axis)};
    return true;
  });
  exit.way_m = std::max(exit.way_m, 0.0);
  return exit;
}

std::optional<Vec3> MiddleOfCrossing(const Corners& a, const Corners& b) {
  Vec3 sum = Vec3::Zero();
  int count = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (const auto& point : {Passes(a[i], a[(i + 1) % 3], b), Passes(b[i], b[(i + 1) % 3], a)}) {
      if (!point) continue;
      sum += *point;
      ++count;
    }
  }
  if (count == 0) return std::nullopt;
  return Vec3(sum / count);
}

namespace {

/// Relative error of sums of lengths in single precision.
constexpr float kRounding = 2e-6F;
/// Beyond this ratio of centre distance to box size, the line through the centres separates two
/// boxes as well as their edge directions do.
constexpr float kNear = 5;

bool IsLeaf(const BoxNode& node) {
  return node.first_child < 0;
}

int TriangleOf(const BoxNode& leaf) {
  return -1 - leaf.first_child;
}

}  // namespace

MeshPair::MeshPair(const BvhSolid& a, const BvhSolid& b, const Pose& X_AB)
    : a_(a), b_(b), X_AB_(X_AB), R_AB_(X_AB.R.cast<float>()), p_AB_(X_AB.p.cast<float>()) {
  float lengths_m = p_AB_.norm();
  for (const BoxNode* const node : {&a.nodes()[0], &b.nodes()[0]}) {
    lengths_m += node->centre.norm() + node->half.norm();
  }
  margin_m_ = kRounding * lengths_m;
}

Corners MeshPair::CornersOfA(int triangle) const {
  const scene::Triangle& t = a_.triangles()[static_cast<std::size_t>(triangle)];
  return {a_.vertices_K()[t[0]], a_.vertices_K()[t[1]], a_.vertices_K()[t[2]]};
}

Corners MeshPair::CornersOfB(int triangle) const {
  const scene::Triangle& t = b_.triangles()[static_cast<std::size_t>(triangle)];
  return {X_AB_ * b_.vertices_K()[t[0]], X_AB_ * b_.vertices_K()[t[1]],
          X_AB_ * b_.vertices_K()[t[2]]};
}

/// Lower bound on the distance of two boxes, negative if they may overlap: along the line through
/// their centres and, if that does not suffice, along the edges of each.
float MeshPair::Gap(const BoxNode& a, const BoxNode& b, float enough_m) const {
  const Vec3f between = R_AB_ * b.centre + p_AB_ - a.centre;
  const Vec3f between_b = R_AB_.transpose() * between;
  const Vec3f on_a = a.axes.transpose() * between, on_b = b.axes.transpose() * between_b;
  const float centres_m = std::sqrt(between.squaredNorm());
  float gap_m =
      centres_m == 0
          ? 0
          : centres_m - (on_a.cwiseAbs().dot(a.half) + on_b.cwiseAbs().dot(b.half)) / centres_m;
  if (gap_m <= enough_m + margin_m_ && centres_m < kNear * (a.half[0] + b.half[0])) {
    const Eigen::Matrix3f b_in_a = a.axes.transpose().lazyProduct(R_AB_);
    const Eigen::Matrix3f turned = b_in_a.lazyProduct(b.axes).cwiseAbs();
    const Vec3f by_a = on_a.cwiseAbs() - a.half - turned.lazyProduct(b.half);
    const Vec3f by_b = on_b.cwiseAbs() - b.half - turned.transpose().lazyProduct(a.half);
    gap_m = std::max({gap_m, by_a.maxCoeff(), by_b.maxCoeff()});
  }
  return gap_m - margin_m_;
}

void MeshPair::CrossingBelow(int a, int b, std::size_t most,
                             std::vector<TrianglePair>& found) const {
  const BoxNode &box_a = a_.nodes()[static_cast<std::size_t>(a)],
                &box_b = b_.nodes()[static_cast<std::size_t>(b)];
  if (found.size() >= most || Gap(box_a, box_b, 0) > 0) return;
  if (IsLeaf(box_a) && IsLeaf(box_b)) {
    const TrianglePair pair{TriangleOf(box_a), TriangleOf(box_b)};
    if (TrianglesCross(CornersOfA(pair.a), CornersOfB(pair.b))) found.push_back(pair);
    return;
  }
  const bool open_a = IsLeaf(box_b) || (!IsLeaf(box_a) && box_a.half[0] > box_b.half[0]);
  for (int half = 0; half < 2; ++half) {
    if (open_a) {
      CrossingBelow(box_a.first_child + half, b, most, found);
    } else {
      CrossingBelow(a, box_b.first_child + half, most, found);
    }
  }
}

std::vector<TrianglePair> MeshPair::Crossing(std::size_t most) const {
  std::vector<TrianglePair> found;
  CrossingBelow(0, 0, most, found);
  return found;
}

void MeshPair::NearestOf(const TrianglePair& pair, NearestPoints& found) const {
  const Corners on_a = CornersOfA(pair.a), on_b = CornersOfB(pair.b);
  Vec3 p, q;
  const double apart_m =
      fcl::detail::TriangleDistanced::triDistance(on_a.data(), on_b.data(), p, q);
  if (apart_m < found.distance_m) found = {apart_m, p, q, pair};
}

void MeshPair::NearestBelow(int a, int b, NearestPoints& found) const {
  const BoxNode &box_a = a_.nodes()[static_cast<std::size_t>(a)],
                &box_b = b_.nodes()[static_cast<std::size_t>(b)];
  if (IsLeaf(box_a) && IsLeaf(box_b)) {
    return NearestOf({TriangleOf(box_a), TriangleOf(box_b)}, found);
  }
  // Open the larger box, nearer child first: it may make visiting the other one unnecessary.
  const bool open_a = IsLeaf(box_b) || (!IsLeaf(box_a) && box_a.half[0] > box_b.half[0]);
  const auto enough_m = static_cast<float>(found.distance_m);
  std::array<std::pair<float, int>, 2> halves;
  for (int k = 0; k < 2; ++k) {
    const int half = (open_a ? box_a : box_b).first_child + k;
    const BoxNode& box = (open_a ? a_ : b_).nodes()[static_cast<std::size_t>(half)];
    halves[static_cast<std::size_t>(k)] = {
        open_a ? Gap(box, box_b, enough_m) : Gap(box_a, box, enough_m), half};
  }
  if (halves[1].first < halves[0].first) std::swap(halves[0], halves[1]);
  for (const auto& [gap_m, half] : halves) {
    if (gap_m < found.distance_m) {
      open_a ? NearestBelow(half, b, found) : NearestBelow(a, half, found);
    }
  }
}

NearestPoints MeshPair::Nearest(const TrianglePair& near) const {
  NearestPoints found;
  if (near.a >= 0) NearestOf(near, found);
  NearestBelow(0, 0, found);
  return found;
}

}  // namespace plumbline::cell
