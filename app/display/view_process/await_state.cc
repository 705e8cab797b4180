#include "app/display/view_process/await_state.h"

#include "drivers/clock.h"

namespace plumbline::display {
namespace {

constexpr double kMeasurementTimeout_s = 3;  ///< for a current state and its measurements

}  // namespace

bool AwaitState(Viewer& viewer, double timeout_s) {
  const double until_s = MonotonicSeconds() + timeout_s;
  while (!viewer.has_state() && MonotonicSeconds() < until_s) viewer.Read(0.1);
  return viewer.has_state();
}

void AwaitMeasured(Viewer& viewer, double meshes_timeout_s) {
  // First the table is read, then its meshes, then the distances are measured.
  const double until_s = MonotonicSeconds() + meshes_timeout_s;
  for (;;) {
    const display::ViewFacts& facts = viewer.Facts();
    const bool read = viewer.config().objects_file.empty() ||
                      (viewer.scene()->version > 0 && viewer.scene()->complete);
    const bool measured =
        facts.table == nullptr ||
        (facts.measured != nullptr && facts.measured->pairs.size() == facts.table->pairs.size());
    if ((read && measured) || MonotonicSeconds() > until_s) break;
    viewer.Read(0.05);
  }
  const double asked_s = MonotonicSeconds();
  for (bool newer = false, measured = false;
       !(newer && measured) && MonotonicSeconds() < asked_s + kMeasurementTimeout_s;) {
    newer = viewer.Read(0.05) || newer;
    const display::ViewFacts& facts = viewer.Facts();
    measured =
        facts.table == nullptr || (facts.measured != nullptr && facts.measured->time_s >= asked_s);
  }
}

}  // namespace plumbline::display
