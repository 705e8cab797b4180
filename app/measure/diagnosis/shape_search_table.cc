// Table of shape searches by effect id.
#include <algorithm>
#include <array>

#include "app/measure/diagnosis/drift_search.h"
#include "app/measure/diagnosis/moment_search.h"
#include "app/measure/diagnosis/periodic_search.h"
#include "app/measure/diagnosis/shape_search.h"

namespace plumbline::measure {
namespace {

struct Registered {
  std::string_view id;
  const ShapeSearch& (*search)();
};

constexpr std::array kSearches = {
    Registered{"counterbalance", CounterbalanceSearch},
    Registered{"gear_periodic", GearPeriodicSearch},
    Registered{"thermal_drift", ThermalDriftSearch},
    Registered{"step_event", StepEventSearch},
    Registered{"tilt_event", TiltEventSearch},
    Registered{"camera_zoom", CameraZoomSearch},
};

}  // namespace

const ShapeSearch* ShapeSearchOf(const effects::Effect& effect) {
  const auto found = std::find_if(kSearches.begin(), kSearches.end(), [&](const Registered& known) {
    return known.id == effect.traits().id;
  });
  return found == kSearches.end() ? nullptr : &found->search();
}

bool ShapesAreVisible(const LinearProblem& problem,
                      const std::vector<effects::ActiveEffect>& effects) {
  return std::all_of(effects.begin(), effects.end(), [&](const effects::ActiveEffect& effect) {
    const ShapeSearch* const search = ShapeSearchOf(*effect.term.effect);
    return search == nullptr || search->Visible(problem, effect);
  });
}

}  // namespace plumbline::measure
