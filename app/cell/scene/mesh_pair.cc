#include "app/cell/scene/mesh_pair.h"

#include <fcl/narrowphase/detail/primitive_shape_algorithm/triangle_distance.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace plumbline::cell {
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
