// Watch on the model that the controller uses: compares its tool pose with the cell while the robot
// works, and reports what the controller compensates as well.
#pragma once

#include <future>
#include <memory>
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
/// A sample is of one controller in one state: it starts anew after the link was lost, and with a
/// posture that contradicts the named relation; postures expire. Withdraws nothing. Used by the
/// main thread, which never waits for an identification.
class ControllerWatch {
 public:
  explicit ControllerWatch(log::LogSink sink) : sink_(std::move(sink)) {}
  ~ControllerWatch() { Abandon(); }  // waits for the thread, as futures of std::async do
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
    measure::ControllerSample sample;
    std::string finding, remedy;
    bool twice = false;
  };
  /// The relation that is named, and the sample that it was fitted to.
  struct Named {
    measure::ControllerSample sample;
    measure::HypothesisFit fit;
  };
  /// Asks an identification in progress to end; its result is dropped.
  void Abandon();
  /// Forgets the sample and what was found from it; an alarm stays until an identification ends it.
  void StartAnew();
  void Collect(const Snapshot& snapshot);
  bool ContradictsNamed(const measure::ControllerPosture& posture);
  void ReportFirstDifference();
  void StartIfDue(double now_s);
  void Take(const Found& found);

  log::LogSink sink_;
  std::unique_ptr<const measure::RelationContext> context_;  ///< of the cell
  measure::ControllerSample sample_;
  measure::PostureCollector collector_;
  measure::ReadingFilter filter_{false};
  std::stop_source stop_;
  std::future<Result<Found>> running_, abandoned_;
  std::optional<Named> named_;
  double checked_s_ = 0;  ///< when a posture was last compared with it
  double last_reading_s_ = 0;
  std::size_t new_postures_ = 0;  ///< since the last identification
  double last_s_ = 0;             ///< when it started
  bool difference_reported_ = false, twice_ = false, answered_ = false;
  bool differs_ = false;  ///< the log's latest finding is not nominal
  std::string reported_;  ///< the relations of the latest finding in the log
};

}  // namespace plumbline::cell
