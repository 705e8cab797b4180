// Distances and interference of meshes, in the state in which they really are: bent and placed.
#pragma once

#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "firmware-like/scene/bend_field.h"
#include "firmware-like/scene/mesh_facts.h"

namespace plumbline {

/// How two objects a and b stand to each other; all in W [m].
struct Separation {
  bool touching = false;  ///< surfaces cross, or one object lies wholly inside the other
  bool inside = false;    ///< the latter
  double distance_m = 0;  ///< of the nearest points; 0 where touching
  /// Nearest points; where touching, both the middle of the curve along which the surfaces cross.
  Vec3 p_a_W = Vec3::Zero(), p_b_W = Vec3::Zero();
  /// How far a must be moved along `way_out` until nothing touches; 0 where apart. The way out is
  /// first the normal of the plane that fits best through the curve along which the surfaces cross,
  /// in the sense that is the shorter; then, if that is shorter still, the normal of what touched
  /// last on that way. So the depth is that of two spheres, or of a body in a plane face, and never
  /// less than the shortest way out of all directions. Resolved to kDepthStep_m.
  double depth_m = 0;
  Vec3 way_out_W = Vec3::Zero();
};

/// What an object meets on a path.
struct SweepResult {
  bool hits = false;
  double travelled_m = 0;   ///< along the path, up to the contact or its end
  std::size_t other = 0;    ///< the place in `against` of what is hit, or came nearest
  double least_m = 0;       ///< the smallest distance on the way
  Vec3 p_W = Vec3::Zero();  ///< where it was: on the other object
};

struct TrianglePair;

/// Meshes with trees of boxes over them. Building takes about 3 us a triangle; bending moves the
/// boxes and lets them grow by what their vertices moved apart, which holds for any bending. Used
/// by one thread.
class Interference {
 public:
  static constexpr double kDepthStep_m = 1e-5;
  static constexpr double kSweepStep_m = 1e-3;
  static constexpr double kBendStep_m = 1e-5;

  Interference();
  ~Interference();
  Interference(const Interference&) = delete;
  Interference& operator=(const Interference&) = delete;

  /// A mesh whose point p_O is at p_K = X_KO (scale p_O) in its carrier's frame.
  /// @param bends  K is the flange, and p_K goes where Bend says
  /// @return       its number: 0, 1, ...
  std::size_t Add(const CheckedMesh& mesh, const Pose& X_KO, double scale, bool bends);
  std::size_t size() const;

  /// How the tool stands. Meshes follow where some station moved by more than kBendStep_m, or
  /// turned by as much at the tip. @return whether they did
  bool Bend(const BendField& field);
  void Place(std::size_t object, const Pose& X_WK);

  /// @param with_depth  depth and way out too, where they touch
  Separation Measure(std::size_t a, std::size_t b, bool with_depth = true);

  /// A point of an object's file, carried along and bent.
  Vec3 PointOf(std::size_t object, const Vec3& p_O) const;
  /// From a point to a surface, within 1 um.
  Separation FromPoint(const Vec3& p_W, std::size_t object) const;

  /// Carries an object along straight pieces, bent as it is now and without turning, and stops
  /// where it first touches. Goes on by the distance that is free, at least by kSweepStep_m: a
  /// shorter overlap can be missed.
  /// @param X_WO     of the object's own frame where the path passes through W's origin
  /// @param path_W   at least one point
  SweepResult Sweep(std::size_t object, const Pose& X_WO, const std::vector<Vec3>& path_W,
                    const std::vector<std::size_t>& against);

 private:
  struct Solid;
  std::vector<std::unique_ptr<Solid>> solids_;
  BendField field_;
  std::map<std::pair<std::size_t, std::size_t>, TrianglePair> nearest_;
};

}  // namespace plumbline
