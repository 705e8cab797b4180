// Measured distances, interferences and sweeps between the virtual objects.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "firmware-like/geometry/pose.h"
#include "firmware-like/scene/interference_watch.h"

namespace plumbline::cell {

/// How far apart two objects a and b are, or how deep they interfere. Lengths in m, vectors in W.
struct Separation {
  bool touching = false;  ///< the surfaces cross, or one object is entirely inside the other
  bool inside = false;    ///< one object is entirely inside the other
  double distance_m = 0;  ///< between the nearest points; 0 if touching
  /// Nearest points; if touching, both are the centre of the surfaces' intersection curve.
  Vec3 p_a_W = Vec3::Zero(), p_b_W = Vec3::Zero();
  /// Penetration depth: how far a must move along penetration_direction_W until the objects are
  /// free; 0 if apart. The direction is the normal of the plane fitted to the intersection curve,
  /// in the sense that frees the objects sooner; or the normal of the surfaces that were last in
  /// contact on that path, if it frees them sooner still. The depth is exact for two spheres and
  /// for a body in a plane face, and is otherwise an upper bound on the minimum over all
  /// directions. Resolution: kDepthStep_m.
  double depth_m = 0;
  Vec3 penetration_direction_W = Vec3::Zero();
};

/// Result of moving an object along a path.
struct SweepResult {
  bool hits = false;
  double travelled_m = 0;   ///< along the path, up to the contact or to its end
  std::size_t other = 0;    ///< index in `against` of the object that is hit or came nearest
  double least_m = 0;       ///< smallest distance on the path
  Vec3 p_W = Vec3::Zero();  ///< point of the other object at the contact or smallest distance
};

struct MeasuredPair {
  std::string a, b;
  int number_a = 0, number_b = 0;  ///< object numbers of the object table
  scene::Proximity state = scene::Proximity::kApart;
  std::optional<Separation> separation;  ///< nullopt if an object has no pose or no mesh
};

struct MeasuredDistance {
  std::string name;
  std::optional<double> distance_m;
  Vec3 p_a_W = Vec3::Zero(), p_b_W = Vec3::Zero();
};

/// A named point of the object table at its present position.
struct PlacedPoint {
  std::string name;
  std::optional<Vec3> p_W;  ///< nullopt if its carrier has no pose
};

struct MeasuredSweep {
  std::string name;
  std::optional<SweepResult> result;
  std::string other;  ///< the object that is hit or came nearest
};

/// All measurements of one state, with the tool and arm deflected.
struct SceneMeasurements {
  double time_s = 0;  ///< time of the state, monotonic
  double took_s = 0;  ///< duration of the computation
  std::vector<MeasuredPair> pairs;
  std::vector<MeasuredDistance> distances;
  std::vector<PlacedPoint> points;
  std::vector<MeasuredSweep> sweeps;
};

/// Older measurements count as unknown.
inline constexpr double kMeasuredFresh_s = 1.0;

}  // namespace plumbline::cell
