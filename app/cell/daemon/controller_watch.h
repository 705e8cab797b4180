// Watch on the model that the controller uses: compares its tool pose with the cell while the robot
// works, and reports what the controller compensates as well.
#pragma once

#include <future>
#include <optional>
#include <stop_token>
#include <string>

#include "app/base/config/daemon_config.h"
#include "app/base/log/log_entry.h"
#include "app/measure/controller/posture_collector.h"
#include "firmware-like/result.h"
#include "firmware-like/snapshot.h"

namespace plumbline::cell {

/// Collects postures at standstill, as widely spread as the robot's work is, and has the relation
/// of the reported pose to the cell identified in the background once there are enough new ones.
/// Withdraws nothing. Used by the main thread.
class ControllerWatch {
 public:
  explicit ControllerWatch(log::LogSink sink) : sink_(std::move(sink)) {}
  ~ControllerWatch() { Abandon(); }
  ControllerWatch(const ControllerWatch&) = delete;
  ControllerWatch& operator=(const ControllerWatch&) = delete;

  /// At the start and after a reload. Postures are kept if robot and cell are the same.
  void Configure(const config::DaemonConfig& config);
  /// To be called several times a second.
  void Observe(const Snapshot& snapshot);

  /// True if the controller's pose contains what the cell corrects as well, until an
  /// identification shows that it does not.
  bool compensated_twice() const { return twice_; }
  /// True if an identification has ended since the cell was configured.
  bool answered() const { return answered_; }

 private:
  struct Found {
    measure::Identification identification;
    std::string finding, remedy;
    bool twice = false;
  };
  /// Ends an identification in progress, within a fraction of a second.
  void Abandon();
  void Collect(const Snapshot& snapshot);
  void ReportFirstDifference();
  void StartIfDue(double now_s);
  void Take(const Found& found);

  log::LogSink sink_;
  std::optional<model::CellModel> cell_;
  measure::ControllerSample sample_;
  measure::PostureCollector collector_;
  measure::ReadingFilter filter_{false};
  std::stop_source stop_;
  std::future<Result<Found>> running_;
  std::size_t new_postures_ = 0;  ///< since the last identification
  double last_s_ = 0;             ///< when it started
  bool difference_reported_ = false, twice_ = false, answered_ = false;
  std::string reported_;  ///< the latest finding in the log
};

}  // namespace plumbline::cell
