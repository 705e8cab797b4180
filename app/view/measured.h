// What was found between the virtual objects, and between them and the cell's model.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/scene/interference.h"
#include "firmware-like/scene/interference_watch.h"
#include "firmware-like/status/scene_status.h"

namespace plumbline {

struct MeasuredPair {
  std::string a, b;
  int number_a = 0, number_b = 0;  ///< of the object table
  Nearness state = Nearness::kApart;
  std::optional<Separation> separation;  ///< nothing: one of them is not placed or not loaded
};

struct MeasuredDistance {
  std::string name;
  std::optional<double> distance_m;
  Vec3 p_a_W = Vec3::Zero(), p_b_W = Vec3::Zero();
};

/// A point of the table, where it is now.
struct PlacedPoint {
  std::string name;
  std::optional<Vec3> p_W;  ///< nothing: what carries it is not in place
};

struct MeasuredSweep {
  std::string name;
  std::optional<SweepResult> result;
  std::string other;  ///< what is hit, or came nearest
};

/// All of one moment, in the deflected state.
struct Measured {
  double time_s = 0;  ///< monotonic, of the state that it is about
  double took_s = 0;
  std::vector<MeasuredPair> pairs;
  std::vector<MeasuredDistance> distances;
  std::vector<PlacedPoint> points;
  std::vector<MeasuredSweep> sweeps;
};

/// What of it the PLC is told; without its time.
SceneStatus SceneForPlc(const Measured& measured);

/// Older results are told as not known.
inline constexpr double kMeasuredFresh_s = 1.0;

}  // namespace plumbline
