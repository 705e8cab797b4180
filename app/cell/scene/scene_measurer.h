// Measurement of distances, interference and sweeps of the scene's objects in the newest state.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "app/base/log/log_entry.h"
#include "app/cell/scene/carriers.h"
#include "app/cell/scene/interference.h"
#include "app/cell/scene/scene_loader.h"
#include "app/cell/view_link/scene_measurements.h"

namespace plumbline::cell {

/// Summary for the PLC; its `time_s` is not set.
status::SceneStatus SceneStatusOf(const SceneMeasurements& measured);

/// Input of one measurement.
struct MeasureInput {
  double time_s = 0;  ///< time of the state, monotonic
  Carriers carriers;
};

/// Used by one thread.
class SceneMeasurer {
 public:
  /// @param near_m  warning distance of pairs that state none [m]
  /// @param sink    receives begin and end of interference and nearness
  SceneMeasurer(double near_m, log::LogSink sink);
  ~SceneMeasurer();
  SceneMeasurer(const SceneMeasurer&) = delete;
  SceneMeasurer& operator=(const SceneMeasurer&) = delete;

  /// Switches to another scene once it is complete; building its trees takes 3 us per triangle.
  /// @param end  set by another thread: nothing will be measured, stop as soon as possible
  void SetScene(std::shared_ptr<const SceneSnapshot> scene, const std::atomic<bool>* end = nullptr);

  SceneMeasurements Measure(const MeasureInput& input, double now_s);
  bool idle() const;  ///< the table requests no measurement

 private:
  void Build(const std::atomic<bool>* end);
  bool Place(const Carriers& carriers);
  MeasuredPair MeasurePair(std::size_t index);
  MeasuredDistance MeasureNamed(const SceneDistance& asked) const;
  void MeasureSweeps(const Carriers& carriers, double now_s);
  void LogTransition(const MeasuredPair& pair, scene::Proximity before);
  struct Endpoint {
    std::optional<std::size_t> object;  ///< index in `objects`; nullopt for a point
    Vec3 p_W = Vec3::Zero();            ///< position of a point
  };
  std::optional<Endpoint> ResolveEndpoint(const SceneDistance::End& end) const;
  bool Ready(std::size_t object) const { return solid_[object] && placed_[object]; }

  const double near_m_;
  const log::LogSink sink_;
  std::shared_ptr<const SceneSnapshot> scene_;
  std::unique_ptr<Interference> solids_;
  bool unavailable_ = false;                       ///< the module that measures cannot be loaded
  std::vector<std::optional<std::size_t>> solid_;  ///< of each object, its index in `solids_`
  std::vector<bool> placed_;
  std::vector<scene::InterferenceWatch> watches_;
  const Carriers* carriers_ = nullptr;  ///< valid while Measure() runs
  std::vector<MeasuredSweep> sweeps_;
  double sweep_due_s_ = -1e300;
};

}  // namespace plumbline::cell
