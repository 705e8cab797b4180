// Distances and interference of the scene's objects in the newest state.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "app/log/log_entry.h"
#include "app/view/carriers.h"
#include "app/view/measured.h"
#include "app/view_process/scene_stock.h"

namespace plumbline {

/// What is measured in.
struct MeasureInput {
  double time_s = 0;  ///< monotonic, of the state
  Carriers carriers;
};

/// Used by one thread.
class Measuring {
 public:
  /// @param near_m  of pairs that state none
  /// @param sink    told when an interference, or nearness, begins and ends
  Measuring(double near_m, LogSink sink) : near_m_(near_m), sink_(std::move(sink)) {}

  /// Takes another scene once it is complete; building its trees takes 3 us a triangle.
  void Take(std::shared_ptr<const SceneNow> scene);

  Measured Measure(const MeasureInput& input, double now_s);
  bool idle() const;  ///< nothing is asked for

 private:
  void Build();
  bool Place(const Carriers& carriers);
  MeasuredPair MeasurePair(std::size_t index);
  MeasuredDistance MeasureNamed(const SceneDistance& asked) const;
  void MeasureSweeps(const Carriers& carriers, double now_s);
  void Tell(const MeasuredPair& pair, Nearness before);
  struct End {
    std::optional<std::size_t> object;  ///< its place in `objects`
    Vec3 p_W = Vec3::Zero();            ///< of a point
  };
  std::optional<End> EndOf(const SceneDistance::End& end) const;
  bool Ready(std::size_t object) const { return solid_[object] && placed_[object]; }

  const double near_m_;
  const LogSink sink_;
  std::shared_ptr<const SceneNow> scene_;
  std::unique_ptr<Interference> solids_;
  std::vector<std::optional<std::size_t>> solid_;  ///< of each object, its number in `solids_`
  std::vector<bool> placed_;
  std::vector<InterferenceWatch> watches_;
  const Carriers* carriers_ = nullptr;  ///< while Measure() runs
  std::vector<MeasuredSweep> sweeps_;
  double sweep_due_s_ = -1e300;
};

}  // namespace plumbline
