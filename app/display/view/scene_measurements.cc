#include "app/display/view/scene_measurements.h"

namespace plumbline::display {

status::SceneStatus SceneStatusOf(const SceneMeasurements& measured) {
  status::SceneStatus scene;
  for (const MeasuredPair& pair : measured.pairs) {
    if (pair.state == scene::Proximity::kInterference) ++scene.interferences;
    if (pair.state == scene::Proximity::kNear) ++scene.near;
    if (!pair.separation) {
      ++scene.unmeasured;
    } else if (scene.object_a == 0 || pair.separation->distance_m < scene.smallest_m) {
      scene.smallest_m = pair.separation->distance_m;
      scene.object_a = static_cast<std::uint16_t>(pair.number_a);
      scene.object_b = static_cast<std::uint16_t>(pair.number_b);
    }
  }
  for (const MeasuredSweep& sweep : measured.sweeps) {
    if (sweep.result && sweep.result->hits) ++scene.blocked;
  }
  return scene;
}

}  // namespace plumbline::display
