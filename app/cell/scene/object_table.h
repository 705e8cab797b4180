// Object table (objects.toml): virtual objects, their carriers, and what is measured between them.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "app/base/config/fault.h"
#include "app/vision/tracking/bodies.h"
#include "firmware-like/scene/display_list.h"

namespace plumbline::cell {

/// Carrier of a virtual object. K denotes its frame.
struct Carrier {
  enum class Kind { kWorld, kBase, kLink, kFlange, kBody, kTag };
  Kind kind = Kind::kWorld;
  std::string body;  ///< name, for kBody
  int tag = 0;       ///< id, for kTag
  int link = 0;      ///< number of the joint that moves it, from 1, for kLink

  bool operator==(const Carrier&) const = default;
};

struct SceneObject {
  int number = 0;
  std::string name;
  std::string file;  ///< relative paths are resolved against the table's folder
  std::string unit;
  double unit_m = 1;  ///< length of `unit` [m]
  Carrier on;
  Pose X_KO;  ///< pose of the object's own frame in the carrier's frame
  double scale = 1;
  bool visible = true;
  bool bends = false;     ///< bends with the tool; the carrier must be the flange
  bool occludes = false;  ///< models a real object: not drawn, but hides what is behind it
  scene::Colour colour{0.6F, 0.6F, 0.65F, 1};
};

/// Two objects whose distance is monitored, as indices in `objects`.
struct ScenePair {
  std::size_t a = 0, b = 0;
  double near_m = 0;  ///< distance below which nearness is reported; 0: interference only
  double end_m = 0;   ///< hysteresis: additional distance at which a report ends
};

/// An object moved along a line with fixed orientation, to find collisions.
struct SceneSweep {
  std::size_t object = 0;
  Pose X_KO;  ///< pose of the object relative to a path point at the origin of K
  std::vector<std::size_t> against;
};

/// A datum line, or an approach path if an object is swept along it.
struct SceneLine {
  std::string name;
  Carrier on;
  std::vector<Vec3> points_K;
  bool visible = true, dashed = false;
  float width_px = 2;
  scene::Colour colour{1, 1, 1, 1};
  std::optional<SceneSweep> sweep;
};

/// A named point of an object, with which it bends, or of a carrier.
struct ScenePoint {
  std::string name;
  std::variant<std::size_t, Carrier> of;  ///< index in `objects`, or a carrier
  Vec3 p = Vec3::Zero();  ///< in the object's own frame before scaling, or in the carrier's frame
};

/// A named distance between points or objects.
struct SceneDistance {
  struct End {
    bool is_object = false;
    std::size_t place = 0;  ///< index in `objects` or `points`
  };
  std::string name;
  End from, to;
};

struct SceneClip {
  Carrier on;
  Vec3 normal_K = Vec3::UnitZ();  ///< unit length
  double distance_m = 0;          ///< everything with normal . p > distance is cut away
  bool grid = true;
};

struct ObjectTable {
  bool background = true;
  std::optional<SceneClip> clip;
  std::vector<SceneObject> objects;
  std::vector<ScenePair> pairs;
  std::vector<SceneLine> lines;
  std::vector<ScenePoint> points;
  std::vector<SceneDistance> distances;
};

inline constexpr std::size_t kMostSceneObjects = 100;

/// Reads an object table and reports all faults; config/objects.toml shows every key.
/// @param file  the table's file name; mesh files are relative to its folder
/// @param tags  known tags and bodies, to check carriers against; no check if null
/// @return      nullopt if there is a fault
std::optional<ObjectTable> ObjectTableFromText(std::string_view text, const std::string& file,
                                               const target::TagDatabase* tags,
                                               config::FaultList& faults);

}  // namespace plumbline::cell
