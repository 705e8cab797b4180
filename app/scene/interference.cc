#include "app/scene/interference.h"

#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/detail/primitive_shape_algorithm/triangle_distance.h>
#include <fcl/narrowphase/distance.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "app/scene/bvh_solid.h"

namespace plumbline {
namespace {

constexpr std::size_t kMostContacts = 4000;
constexpr double kPointSize_m = 1e-6;  ///< of the triangle that stands for a point

/// An object somewhere.
struct Placed {
  const BvhSolid& solid;
  Pose X_WK;
};

bool SurfacesCross(const Placed& a, const Placed& b) {
  fcl::CollisionRequestd request;
  fcl::CollisionResultd result;
  return fcl::collide(&a.solid.model(), FclOf(a.X_WK), &b.solid.model(), FclOf(b.X_WK), request,
                      result) > 0;
}

/// Whether some part of `inner` lies in `outer`. Only where their surfaces do not cross.
bool LiesInside(const Placed& inner, const Placed& outer) {
  return outer.solid.EnclosesPartOf(inner.solid, outer.X_WK.Inverse() * inner.X_WK);
}

bool Touching(const Placed& a, const Placed& b) {
  return SurfacesCross(a, b) || LiesInside(a, b) || LiesInside(b, a);
}

/// Corners of a triangle in W.
std::array<Vec3, 3> CornersOf(const Placed& solid, int triangle) {
  const BvhModel& model = solid.solid.model();
  const fcl::Triangle& t = model.tri_indices[triangle];
  return {solid.X_WK * model.vertices[t[0]], solid.X_WK * model.vertices[t[1]],
          solid.X_WK * model.vertices[t[2]]};
}

/// @param last  the triangles that were nearest: what they are apart now bounds the search, and
///              halves it where things move little from one look to the next
Separation NearestPoints(const Placed& a, const Placed& b, NearestTriangles& last) {
  const fcl::DistanceRequestd request(true);
  fcl::DistanceResultd result;
  if (last.a >= 0) {
    const auto s = CornersOf(a, last.a), t = CornersOf(b, last.b);
    Vec3 p, q;
    const double now_m = fcl::detail::TriangleDistanced::triDistance(s.data(), t.data(), p, q);
    if (now_m > 0) result.min_distance = now_m * (1 + 1e-9) + 1e-9;  // so that they are found again
  }
  fcl::distance(&a.solid.model(), FclOf(a.X_WK), &b.solid.model(), FclOf(b.X_WK), request, result);
  if (result.b1 < 0) {  // should the bound have been too tight after all
    last = {};
    result = {};
    fcl::distance(&a.solid.model(), FclOf(a.X_WK), &b.solid.model(), FclOf(b.X_WK), request,
                  result);
  }
  last = {static_cast<int>(result.b1), static_cast<int>(result.b2)};
  Separation apart;
  apart.distance_m = std::max(0.0, result.min_distance);
  apart.p_a_W = result.nearest_points[0];
  apart.p_b_W = result.nearest_points[1];
  return apart;
}

/// The curve along which two surfaces cross.
struct Crossing {
  Vec3 middle_W = Vec3::Zero();
  Vec3 plane_W = Vec3::UnitZ();   ///< normal of the plane that fits it best
  Vec3 facing_W = Vec3::UnitZ();  ///< normal of one of the triangles there
};

/// @return  nothing where they do not cross
std::optional<Crossing> CrossingOf(const Placed& a, const Placed& b) {
  const fcl::CollisionRequestd request(kMostContacts, true);
  fcl::CollisionResultd result;
  fcl::collide(&a.solid.model(), FclOf(a.X_WK), &b.solid.model(), FclOf(b.X_WK), request, result);
  std::vector<fcl::Contactd> contacts;
  result.getContacts(contacts);
  if (contacts.empty()) return std::nullopt;
  Crossing crossing;
  const Vec3 normal = contacts.front().normal;
  if (normal.norm() > 0 && normal.allFinite()) crossing.facing_W = normal.normalized();
  Vec3 mean_W = Vec3::Zero();
  for (const auto& contact : contacts) mean_W += contact.pos / static_cast<double>(contacts.size());
  Mat3 scatter = Mat3::Zero();
  for (const auto& contact : contacts) {
    scatter += (contact.pos - mean_W) * (contact.pos - mean_W).transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(scatter);
  // Points on a line have no plane: then how the triangles face.
  const bool spread = axes.eigenvalues()[1] > 1e-12 * axes.eigenvalues()[2];
  crossing.plane_W = spread ? Vec3(axes.eigenvectors().col(0)) : crossing.facing_W;
  // The points crowd where triangles are small; the middle of their extent does not.
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();
  for (const auto& contact : contacts) {
    const Vec3 along = axes.eigenvectors().transpose() * (contact.pos - mean_W);
    low = low.cwiseMin(along);
    high = high.cwiseMax(along);
  }
  crossing.middle_W = mean_W + axes.eigenvectors() * (0.5 * (low + high));
  return crossing;
}

/// The search for a way on which a comes free of b.
class WayOut {
 public:
  WayOut(const Placed& a, const Placed& b) : a_(a), b_(b) {}

  void Find(const Vec3& guess_W, Separation& found) const {
    double free_m = kFirstTry_m;
    Vec3 way_W = guess_W;
    for (int doublings = 0; doublings < kMostDoublings; ++doublings, free_m *= 2) {
      if (IsFree(free_m * guess_W)) break;
      if (IsFree(-free_m * guess_W)) {
        way_W = -guess_W;
        break;
      }
    }
    free_m = Halve(way_W, free_m > kFirstTry_m ? 0.5 * free_m : 0, free_m);
    // What touched last tells how the surfaces face there.
    const Vec3 last_W = (free_m - Interference::kDepthStep_m) * way_W;
    const auto crossing = CrossingOf({a_.solid, {a_.X_WK.R, a_.X_WK.p + last_W}}, b_);
    if (crossing) {
      const Vec3 facing_W =
          crossing->facing_W.dot(way_W) < 0 ? Vec3(-crossing->facing_W) : crossing->facing_W;
      const double shorter_m = free_m - Interference::kDepthStep_m;
      if (facing_W.dot(way_W) > kHalf && shorter_m > 0 && IsFree(shorter_m * facing_W)) {
        way_W = facing_W;
        free_m = Halve(way_W, 0, shorter_m);
      }
    }
    found.depth_m = free_m;
    found.way_out_W = way_W;
  }

 private:
  static constexpr double kFirstTry_m = 1e-4, kHalf = 0.5;
  static constexpr int kMostDoublings = 40;

  bool IsFree(const Vec3& shift_W) const {
    return !Touching({a_.solid, {a_.X_WK.R, a_.X_WK.p + shift_W}}, b_);
  }
  /// Between a place that touches and one that is free.
  double Halve(const Vec3& way_W, double touching_m, double free_m) const {
    while (free_m - touching_m > Interference::kDepthStep_m) {
      const double middle_m = 0.5 * (free_m + touching_m);
      (IsFree(middle_m * way_W) ? free_m : touching_m) = middle_m;
    }
    return free_m;
  }

  const Placed& a_;
  const Placed& b_;
};

Separation MeasurePlaced(const Placed& a, const Placed& b, bool with_depth,
                         NearestTriangles& last) {
  Separation found;
  if (SurfacesCross(a, b)) {
    found.touching = true;
    if (!with_depth) return found;
    const Crossing crossing = CrossingOf(a, b).value_or(Crossing());
    found.p_a_W = found.p_b_W = crossing.middle_W;
    WayOut(a, b).Find(crossing.plane_W, found);
    return found;
  }
  found = NearestPoints(a, b, last);
  if (!LiesInside(a, b) && !LiesInside(b, a)) return found;
  found.touching = found.inside = true;
  const Vec3 between_W = found.p_b_W - found.p_a_W;
  found.distance_m = 0;
  if (with_depth && between_W.norm() > 0) WayOut(a, b).Find(between_W.normalized(), found);
  return found;
}

/// How far stations, and what is turned about them, are from where they were.
double Moved(const BendField& one, const BendField& other) {
  double most_m = std::abs(one.length_m - other.length_m);
  for (std::size_t i = 0; i < one.stations.size(); ++i) {
    const BendStation &a = one.stations[i], &b = other.stations[i];
    most_m = std::max<double>(most_m, (a.d_F - b.d_F).norm());
    most_m = std::max<double>(most_m, one.length_m * (a.r_F - b.r_F).norm());
  }
  return most_m;
}

}  // namespace

struct Interference::Solid {
  BvhSolid bvh;
  bool bends;
  Pose X_WK;
  Placed placed() const { return {bvh, X_WK}; }
};

Interference::Interference() = default;
Interference::~Interference() = default;

std::size_t Interference::Add(const CheckedMesh& mesh, const Pose& X_KO, double scale, bool bends) {
  solids_.push_back(std::make_unique<Solid>(Solid{BvhSolid(mesh, X_KO, scale), bends, Pose()}));
  if (bends && field_.length_m > 0) solids_.back()->bvh.Bend(field_);
  return solids_.size() - 1;
}

std::size_t Interference::size() const {
  return solids_.size();
}

bool Interference::Bend(const BendField& field) {
  if (Moved(field, field_) <= kBendStep_m) return false;
  field_ = field;
  for (const auto& solid : solids_) {
    if (solid->bends) solid->bvh.Bend(field_);
  }
  return true;
}

void Interference::Place(std::size_t object, const Pose& X_WK) {
  solids_[object]->X_WK = X_WK;
}

Separation Interference::Measure(std::size_t a, std::size_t b, bool with_depth) {
  return MeasurePlaced(solids_[a]->placed(), solids_[b]->placed(), with_depth, nearest_[{a, b}]);
}

Vec3 Interference::PointOf(std::size_t object, const Vec3& p_O) const {
  const Solid& solid = *solids_[object];
  const Vec3 p_K = solid.bvh.X_KO() * Vec3(solid.bvh.scale() * p_O);
  return solid.X_WK * (solid.bends ? BentPoint(field_, p_K) : p_K);
}

Separation Interference::FromPoint(const Vec3& p_W, std::size_t object) const {
  CheckedMesh point;
  constexpr auto kSide = static_cast<float>(kPointSize_m);
  point.mesh = {{Vec3f(0, 0, 0), Vec3f(kSide, 0, 0), Vec3f(0, kSide, 0)}, {{0, 1, 2}}};
  point.facts.ends = {{0, 0, 0, 0, 0, 0}};
  point.facts.triangles = point.facts.open_edges = 1;
  const BvhSolid dot(point, {}, 1);
  NearestTriangles none;
  return MeasurePlaced({dot, {Mat3::Identity(), p_W}}, solids_[object]->placed(), false, none);
}

SweepResult Interference::Sweep(std::size_t object, const Pose& X_WO,
                                const std::vector<Vec3>& path_W,
                                const std::vector<std::size_t>& against) {
  const Solid& solid = *solids_[object];
  SweepResult result;
  result.least_m = std::numeric_limits<double>::infinity();
  // Looks at one place of the path; how far it may go on from there.
  const auto free_at = [&](const Vec3& p_W) {
    const Placed moved{solid.bvh, Pose{X_WO.R, X_WO.p + p_W} * solid.bvh.X_KO().Inverse()};
    double free_m = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < against.size() && !result.hits; ++i) {
      const Placed other = solids_[against[i]]->placed();
      const Separation here = MeasurePlaced(moved, other, false, nearest_[{object, against[i]}]);
      result.hits = here.touching;
      free_m = std::min(free_m, here.distance_m);
      if (here.distance_m >= result.least_m && !here.touching) continue;
      result.least_m = here.distance_m;
      result.other = i;
      result.p_W = here.touching && !here.inside
                       ? CrossingOf(moved, other).value_or(Crossing()).middle_W
                       : here.p_b_W;
    }
    return free_m;
  };
  double free_m = free_at(path_W.front());
  for (std::size_t i = 1; i < path_W.size() && !result.hits; ++i) {
    const Vec3 piece = path_W[i] - path_W[i - 1];
    const double length_m = piece.norm();
    for (double at_m = 0; at_m < length_m && !result.hits;) {
      const double step_m = std::min(std::max(free_m, kSweepStep_m), length_m - at_m);
      at_m = step_m >= length_m - at_m ? length_m : at_m + step_m;
      result.travelled_m += step_m;
      free_m = free_at(path_W[i - 1] + at_m / length_m * piece);
    }
  }
  return result;
}

}  // namespace plumbline
