#include "app/display/scene/penetration.h"

#include <algorithm>
#include <optional>

namespace plumbline::display {
namespace {

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

}  // namespace

bool EitherContainsOther(const BvhSolid& a, const BvhSolid& b, const Pose& X_AB) {
  return a.EnclosesPartOf(b, X_AB) || b.EnclosesPartOf(a, X_AB.Inverse());
}

Penetration PenetrationOf(const BvhSolid& a, const BvhSolid& b, const Pose& X_AB,
                          const std::vector<TrianglePair>& crossing,
                          const Vec3& initial_direction_A, double step_m) {
  return EscapeSearch(a, b, X_AB, step_m).Find(crossing, initial_direction_A);
}

}  // namespace plumbline::display
