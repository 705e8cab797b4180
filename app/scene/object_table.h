// The object table: what virtual things there are, where they stand, and what is watched of them.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "app/config/fault.h"
#include "app/tracking/bodies.h"
#include "firmware-like/scene/display_list.h"

namespace plumbline {

/// What carries something: its frame is called K here.
struct Carrier {
  enum class Kind { kWorld, kBase, kFlange, kBody, kTag };
  Kind kind = Kind::kWorld;
  std::string body;  ///< of kBody: its name
  int tag = 0;       ///< of kTag: its id

  bool operator==(const Carrier&) const = default;
};

struct SceneObject {
  int number = 0;
  std::string name;
  std::string file;  ///< with the table's folder before it, unless it is absolute
  std::string unit;
  double unit_m = 1;  ///< `unit` [m]
  Carrier on;
  Pose X_KO;  ///< the object's own frame in its carrier's
  double scale = 1;
  bool visible = true;
  bool bends = false;     ///< with the tool; its carrier is then the flange
  bool occludes = false;  ///< a model of the real cell: not drawn, hides what is behind it
  Colour colour{0.6F, 0.6F, 0.65F, 1};
};

/// Two objects whose interference is watched, by their places in `objects`.
struct ScenePair {
  std::size_t a = 0, b = 0;
  double near_m = 0;  ///< told when nearer; 0: interference alone
  double end_m = 0;   ///< how much further apart they must be for it to end
};

/// An object carried along a line with its orientation kept, to see what it would hit.
struct SceneSweep {
  std::size_t object = 0;
  Pose X_KO;  ///< of the object, its origin on the path's points: p is the offset from them
  std::vector<std::size_t> against;
};

/// A datum line, or an approach path where something is swept along it.
struct SceneLine {
  std::string name;
  Carrier on;
  std::vector<Vec3> points_K;
  bool visible = true, dashed = false;
  float width_px = 2;
  Colour colour{1, 1, 1, 1};
  std::optional<SceneSweep> sweep;
};

/// A point with a name: of an object, with which it bends, or of a carrier.
struct ScenePoint {
  std::string name;
  std::variant<std::size_t, Carrier> of;  ///< a place in `objects`, or a carrier
  Vec3 p = Vec3::Zero();  ///< in the object's frame, before its scale, or the carrier's
};

/// A distance that is asked for by its name, between points or objects.
struct SceneDistance {
  struct End {
    bool is_object = false;
    std::size_t place = 0;  ///< in `objects` or `points`
  };
  std::string name;
  End from, to;
};

struct SceneClip {
  Carrier on;
  Vec3 normal_K = Vec3::UnitZ();  ///< unit length
  double distance_m = 0;          ///< what lies beyond, normal . p > distance, is cut away
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

/// Reads an object table; config/objects.toml shows every key. All faults at once.
/// @param file  the table's own name; mesh files are looked for beside it
/// @param tags  what tags and bodies there are; null: not checked
/// @return      nothing where there is a fault
std::optional<ObjectTable> ObjectTableFromText(std::string_view text, const std::string& file,
                                               const TagDatabase* tags, FaultList& faults);

}  // namespace plumbline
