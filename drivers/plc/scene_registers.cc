// Registers 640..647: interference and distance of virtual objects.
#include <algorithm>
#include <array>
#include <cmath>

#include "drivers/plc/register_map.h"
#include "firmware-like/geometry/length.h"

namespace plumbline {
namespace {

using Source = const MapSource&;

using enum FieldType;
constexpr double kOldest_ms = 65535, kNotKnown = -1;

const SceneStatus& Scene(Source s) {
  return s.environment.scene;
}

bool Fresh(Source s) {
  return Scene(s).FreshAt(s.environment.now_s);
}

/// One that touches is known although others are not measured; "apart" is said of all or of none.
double State(Source s) {
  if (!Fresh(s)) return 0;
  if (Scene(s).interferences > 0) return 2;
  return Scene(s).unmeasured > 0 || Scene(s).object_a == 0 ? 0 : 1;
}

bool Measured(Source s) {
  return Fresh(s) && Scene(s).object_a != 0;
}

const std::array kSceneFields = {
    MapField{640, kU16, "scene_state", "code",
             "0 not known (no monitor, or a pair is not measured), 1 apart, 2 interference", State},
    MapField{641, kU16, "scene_interferences", "", "pairs of objects that touch",
             [](Source s) -> double { return Fresh(s) ? Scene(s).interferences : 0; }},
    MapField{642, kU16, "scene_object_a", "", "number of an object of the nearest pair, 0: none",
             [](Source s) -> double { return Measured(s) ? Scene(s).object_a : 0; }},
    MapField{643, kU16, "scene_object_b", "", "the other one",
             [](Source s) -> double { return Measured(s) ? Scene(s).object_b : 0; }},
    MapField{644, kFloat, "scene_distance", "mm", "its distance, 0: it touches, -1: not known",
             [](Source s) { return Measured(s) ? kMmPerMetre * Scene(s).smallest_m : kNotKnown; }},
    MapField{646, kU16, "scene_unmeasured", "", "pairs that are not measured",
             [](Source s) -> double { return Fresh(s) ? Scene(s).unmeasured : 0; }},
    MapField{647, kU16, "scene_age", "ms", "since it was told, 65535 where older or never",
             [](Source s) {
               const double age_ms = std::floor(1e3 * (s.environment.now_s - Scene(s).time_s));
               return age_ms < kOldest_ms ? std::max(0.0, age_ms) : kOldest_ms;
             }},
    MapField{648, kU16, "scene_blocked", "", "approach paths with an object on them",
             [](Source s) -> double { return Fresh(s) ? Scene(s).blocked : 0; }},
};

}  // namespace

std::span<const MapField> plc_map::SceneFields() {
  return kSceneFields;
}

}  // namespace plumbline
