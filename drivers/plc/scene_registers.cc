// Registers 640..649: interference and smallest distance of the virtual objects.
#include <array>

#include "drivers/plc/register_values.h"

namespace plumbline::plc {
namespace {

using enum FieldType;
constexpr double kUnknownDistance_mm = -1;

const status::SceneStatus& Scene(Source s) {
  return s.environment.scene;
}

bool Fresh(Source s) {
  return Scene(s).FreshAt(s.environment.now_s);
}

/// Interference is reported even if other pairs are not measured; "apart" only if all pairs are.
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
             "0 unknown (no object table, or a pair is not measured), 1 all pairs apart, 2 "
             "interference",
             State},
    MapField{641, kU16, "scene_interferences", "",
             "number of object pairs that touch; 0 if the scene status is older than 1 s",
             [](Source s) -> double { return Fresh(s) ? Scene(s).interferences : 0; }},
    MapField{642, kU16, "scene_object_a", "",
             "number of the first object of the closest pair; 0: none measured",
             [](Source s) -> double { return Measured(s) ? Scene(s).object_a : 0; }},
    MapField{643, kU16, "scene_object_b", "",
             "number of the second object of that pair; 0: none measured",
             [](Source s) -> double { return Measured(s) ? Scene(s).object_b : 0; }},
    MapField{644, kFloat, "scene_distance", "mm", "distance of that pair; 0: touching, -1: unknown",
             [](Source s) {
               return Measured(s) ? kMmPerMetre * Scene(s).smallest_m : kUnknownDistance_mm;
             }},
    MapField{646, kU16, "scene_unmeasured", "", "number of object pairs that are not measured",
             [](Source s) -> double { return Fresh(s) ? Scene(s).unmeasured : 0; }},
    MapField{647, kU16, "scene_age", "ms",
             "age of the scene status; 65535: older than that, or never reported",
             [](Source s) { return Age_ms(s, Scene(s).time_s); }},
    MapField{648, kU16, "scene_blocked", "",
             "number of approach paths that are blocked by an object",
             [](Source s) -> double { return Fresh(s) ? Scene(s).blocked : 0; }},
    MapField{649, kU16, "scene_near", "",
             "number of object pairs that are nearer than their declared near_mm without touching",
             [](Source s) -> double { return Fresh(s) ? Scene(s).near : 0; }},
};

}  // namespace

std::span<const MapField> registers::SceneFields() {
  return kSceneFields;
}

}  // namespace plumbline::plc
