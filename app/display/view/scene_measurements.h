// Measured distances, interferences and sweeps between the virtual objects.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/display/scene/interference.h"
#include "firmware-like/scene/interference_watch.h"
#include "firmware-like/status/scene_status.h"

namespace plumbline::display {

struct MeasuredPair {
  std::string a, b;
  int number_a = 0, number_b = 0;  ///< object numbers of the object table
  scene::Proximity state = scene::Proximity::kApart;
  std::optional<display::Separation> separation;  ///< nullopt if an object has no pose or no mesh
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
  std::optional<display::SweepResult> result;
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

/// Summary for the PLC; its `time_s` is not set.
status::SceneStatus SceneStatusOf(const SceneMeasurements& measured);

/// Older measurements count as unknown.
inline constexpr double kMeasuredFresh_s = 1.0;

}  // namespace plumbline::display
