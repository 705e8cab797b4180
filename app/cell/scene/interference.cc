#include "app/cell/scene/interference.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "app/cell/scene/mesh_pair.h"

namespace plumbline::cell {
namespace {

// Penetration depth of two meshes: travel of one until it no longer touches the other.

/// Whether a part of one mesh is inside the other. Requires that their surfaces do not cross.
bool EitherContainsOther(const BvhSolid& a, const BvhSolid& b, const Pose& X_AB);

/// Depth and direction, as defined for Separation (interference.h).
struct Penetration {
  double depth_m = 0;
  Vec3 direction_A = Vec3::Zero();
};

constexpr std::size_t kCrossingsPerTest = 8;  ///< intersections used from one test
constexpr int kMaxTests = 80;
/// A test of a touching position stops at the first intersections, one of a free position examines
/// everything. Therefore strides start from the touching side and grow by this factor.
constexpr double kStrideGrowth = 4;
constexpr double kSameSide = 0.5;  ///< minimum cosine between the first direction and a better one

/// A straight path of a out of b, as far as it is known.
struct Way {
  Vec3 along_A;
  double touching_m = 0;         ///< known to touch up to here
  Vec3 normal_A = Vec3::Zero();  ///< normal of the contact there
};

class EscapeSearch {
 public:
  EscapeSearch(const BvhSolid& a, const BvhSolid& b, const Pose& X_AB, double step_m)
      : a_(a), b_(b), X_AB_(X_AB), step_m_(step_m) {}

  Penetration Find(const std::vector<TrianglePair>& crossing,
                   const Vec3& initial_direction_A) const {
    const MeshPair here(a_, b_, X_AB_);
    std::array<Way, 2> ways = {Way{initial_direction_A}, Way{-initial_direction_A}};
    for (Way& way : ways) AddContacts(here, crossing, 0, way);
    std::array<double, 2> stride_m = {step_m_, step_m_}, next_m{};
    std::size_t nearer = 0;
    for (int tests = 0; tests < kMaxTests; ++tests) {
      for (std::size_t k = 0; k < 2; ++k) next_m[k] = ways[k].touching_m + stride_m[k];
      nearer = next_m[0] <= next_m[1] ? 0 : 1;
      if (IsFree(ways[nearer], next_m[nearer])) break;
      stride_m[nearer] *= kStrideGrowth;
    }
    Way& way = ways[nearer];
    double free_m = Bisect(way, next_m[nearer]);
    const auto take_shorter = [&](Way other) {
      const double shorter_m = free_m - step_m_;
      if (other.touching_m >= shorter_m || !IsFree(other, shorter_m)) return;
      free_m = Bisect(other, shorter_m);
      way = other;
    };
    take_shorter(ways[1 - nearer]);
    // The normal of the last contact may be a shorter direction.
    const Vec3 normal_A = way.normal_A.normalized();
    if (normal_A.dot(way.along_A) > kSameSide) take_shorter({normal_A});
    return {free_m, way.along_A};
  }

 private:
  /// Updates the path with the intersecting triangles found at `at_m`.
  static void AddContacts(const MeshPair& pair, const std::vector<TrianglePair>& crossing,
                          double at_m, Way& way) {
    way.touching_m = std::max(way.touching_m, at_m);
    for (const TrianglePair& triangles : crossing) {
      const TriangleExit exit =
          ExitOf(pair.CornersOfA(triangles.a), pair.CornersOfB(triangles.b), way.along_A);
      if (!(at_m + exit.way_m >= way.touching_m)) continue;
      way.touching_m = at_m + exit.way_m;
      way.normal_A = exit.normal;
    }
  }

  bool IsFree(Way& way, double at_m) const {
    const Pose X_AB{X_AB_.R, X_AB_.p - at_m * way.along_A};
    const MeshPair there(a_, b_, X_AB);
    const std::vector<TrianglePair> crossing = there.Crossing(kCrossingsPerTest);
    if (crossing.empty() && !EitherContainsOther(a_, b_, X_AB)) return true;
    AddContacts(there, crossing, at_m, way);
    return false;
  }

  /// @param free_m  a free position
  /// @return        a free position at most one step beyond a touching one
  double Bisect(Way& way, double free_m) const {
    double stride_m = step_m_;
    for (int tests = 0; tests < kMaxTests && free_m - way.touching_m > step_m_; ++tests) {
      const double at_m = way.touching_m + std::min(stride_m, 0.5 * (free_m - way.touching_m));
      const bool free = IsFree(way, at_m);
      if (free) free_m = at_m;
      stride_m = free ? step_m_ : kStrideGrowth * stride_m;
    }
    return free_m;
  }

  const BvhSolid& a_;
  const BvhSolid& b_;
  const Pose& X_AB_;
  const double step_m_;
};

bool EitherContainsOther(const BvhSolid& a, const BvhSolid& b, const Pose& X_AB) {
  return a.EnclosesPartOf(b, X_AB) || b.EnclosesPartOf(a, X_AB.Inverse());
}

/// Tests positions along the initial direction and opposite to it with growing strides, then
/// bisects between the last that touches and the first that is free. Intersecting triangles are
/// known to intersect up to their exit (ExitOf), so positions before that are not tested.
/// @param crossing  the intersecting triangles; empty if one mesh is inside the other
/// @param initial_direction_A   a unit vector
/// @param step_m    resolution of the depth
Penetration PenetrationOf(const BvhSolid& a, const BvhSolid& b, const Pose& X_AB,
                          const std::vector<TrianglePair>& crossing,
                          const Vec3& initial_direction_A, double step_m) {
  return EscapeSearch(a, b, X_AB, step_m).Find(crossing, initial_direction_A);
}

constexpr std::size_t kMostCrossings = 4000;
constexpr double kPointSize_m = 1e-6;  ///< edge length of the triangle that represents a point

/// An object and its pose.
struct Placed {
  const BvhSolid& solid;
  Pose X_WK;
};

/// Intersection curve of two surfaces, in the first one's frame.
struct Crossing {
  Vec3 middle_A = Vec3::Zero();
  Vec3 plane_A = Vec3::UnitZ();  ///< normal of its best-fitting plane
};

Crossing CrossingOf(const MeshPair& pair, const std::vector<TrianglePair>& triangles) {
  std::vector<Vec3> points_A;
  for (const TrianglePair& both : triangles) {
    const Corners a = pair.CornersOfA(both.a), b = pair.CornersOfB(both.b);
    points_A.push_back(MiddleOfCrossing(a, b).value_or((a[0] + a[1] + a[2]) / 3));
  }
  Vec3 mean_A = Vec3::Zero();
  for (const Vec3& p_A : points_A) mean_A += p_A / static_cast<double>(points_A.size());
  Mat3 scatter = Mat3::Zero();
  for (const Vec3& p_A : points_A) scatter += (p_A - mean_A) * (p_A - mean_A).transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(scatter);
  Crossing crossing;
  if (axes.eigenvalues()[1] > 1e-12 * axes.eigenvalues()[2]) {
    crossing.plane_A = axes.eigenvectors().col(0);
  } else {  // collinear points define no plane: use the normal of a triangle there
    const Corners b = pair.CornersOfB(triangles.front().b);
    const Vec3 normal_A = (b[1] - b[0]).cross(b[2] - b[0]);
    if (normal_A.norm() > 0) crossing.plane_A = normal_A.normalized();
  }
  // The mean is biased towards small triangles, so take the centre of the extent.
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();
  for (const Vec3& p_A : points_A) {
    const Vec3 along = axes.eigenvectors().transpose() * (p_A - mean_A);
    low = low.cwiseMin(along);
    high = high.cwiseMax(along);
  }
  crossing.middle_A = mean_A + axes.eigenvectors() * (0.5 * (low + high));
  return crossing;
}

/// @param last  nearest triangles of the previous call; updated
Separation MeasurePlaced(const Placed& a, const Placed& b, bool with_depth, TrianglePair& last) {
  const Pose X_AB = a.X_WK.Inverse() * b.X_WK;
  const MeshPair pair(a.solid, b.solid, X_AB);
  const auto find_penetration = [&](const std::vector<TrianglePair>& crossing,
                                    const Vec3& initial_direction_A, Separation& found) {
    const Penetration way = PenetrationOf(a.solid, b.solid, X_AB, crossing, initial_direction_A,
                                          Interference::kDepthStep_m);
    found.depth_m = way.depth_m;
    found.penetration_direction_W = a.X_WK.R * way.direction_A;
  };
  Separation found;
  const std::vector<TrianglePair> crossing = pair.Crossing(with_depth ? kMostCrossings : 1);
  if (!crossing.empty()) {
    found.touching = true;
    const Crossing curve = CrossingOf(pair, crossing);  // without depth: of one triangle pair
    found.p_a_W = found.p_b_W = a.X_WK * curve.middle_A;
    if (!with_depth) return found;
    find_penetration(crossing, curve.plane_A, found);
    return found;
  }
  const NearestPoints nearest = pair.Nearest(last);
  last = nearest.triangles;
  found.distance_m = nearest.distance_m;
  found.p_a_W = a.X_WK * nearest.p_a_A;
  found.p_b_W = a.X_WK * nearest.p_b_A;
  if (!EitherContainsOther(a.solid, b.solid, X_AB)) return found;
  found.touching = found.inside = true;
  found.distance_m = 0;
  const Vec3 between_A = nearest.p_b_A - nearest.p_a_A;
  if (with_depth && between_A.norm() > 0) find_penetration({}, between_A.normalized(), found);
  return found;
}

/// Centre of the intersection curve of two objects whose surfaces cross.
Vec3 MiddleOf(const Placed& a, const Placed& b) {
  const MeshPair pair(a.solid, b.solid, a.X_WK.Inverse() * b.X_WK);
  return a.X_WK * CrossingOf(pair, pair.Crossing(kMostCrossings)).middle_A;
}

/// Largest change of a station's displacement, or of the tip by a station's rotation [m].
double Moved(const scene::BendField& one, const scene::BendField& other) {
  double most_m = std::abs(one.length_m - other.length_m);
  for (std::size_t i = 0; i < one.stations.size(); ++i) {
    const scene::BendStation &a = one.stations[i], &b = other.stations[i];
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

std::size_t Interference::Add(const scene::CheckedMesh& mesh, const Pose& X_KO, double scale,
                              bool bends) {
  solids_.push_back(std::make_unique<Solid>(Solid{BvhSolid(mesh, X_KO, scale), bends, Pose()}));
  if (bends && field_.length_m > 0) solids_.back()->bvh.Bend(field_);
  return solids_.size() - 1;
}

std::size_t Interference::size() const {
  return solids_.size();
}

bool Interference::Bend(const scene::BendField& field) {
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
  return solid.X_WK * (solid.bends ? scene::BentPoint(field_, p_K) : p_K);
}

Separation Interference::FromPoint(const Vec3& p_W, std::size_t object) const {
  scene::CheckedMesh point;
  constexpr auto kSide = static_cast<float>(kPointSize_m);
  point.mesh = {{Vec3f(0, 0, 0), Vec3f(kSide, 0, 0), Vec3f(0, kSide, 0)}, {{0, 1, 2}}};
  point.facts.ends = {{0, 0, 0, 0, 0, 0}};
  point.facts.triangles = point.facts.open_edges = 1;
  const BvhSolid dot(point, {}, 1);
  TrianglePair none;
  return MeasurePlaced({dot, {Mat3::Identity(), p_W}}, solids_[object]->placed(), false, none);
}

SweepResult Interference::Sweep(std::size_t object, const Pose& X_WO,
                                const std::vector<Vec3>& path_W,
                                const std::vector<std::size_t>& against) {
  const Solid& solid = *solids_[object];
  SweepResult result;
  result.least_m = std::numeric_limits<double>::infinity();
  // Measures at one point of the path and returns the free distance.
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
      result.p_W = here.touching && !here.inside ? MiddleOf(moved, other) : here.p_b_W;
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

}  // namespace plumbline::cell
