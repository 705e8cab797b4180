// Thread that reads the gauges: the press of a button becomes a probe.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "app/base/config/daemon_config.h"
#include "app/base/log/log.h"
#include "app/cell/daemon/cycle_mailboxes.h"
#include "drivers/gauge/gauge.h"
#include "drivers/thread_heartbeat.h"

namespace plumbline::cell {

/// Passes each reading to the control cycle, which records it if the robot is at standstill, and
/// logs what became of it. Does nothing if no gauge is configured.
class GaugeWorker {
 public:
  /// @param mailbox  must outlive this object
  GaugeWorker(GaugeMailbox& mailbox, log::LogSink sink);
  ~GaugeWorker() { Stop(); }
  GaugeWorker(const GaugeWorker&) = delete;
  GaugeWorker& operator=(const GaugeWorker&) = delete;

  /// Starts with the gauges of a configuration. Call it only while the worker is stopped.
  void Start(const config::DaemonConfig& config);
  void Stop();
  /// For the watchdog; also increases while there is no gauge and therefore no thread.
  std::uint64_t beats() const;
  const ThreadHeartbeat& heartbeat() const { return heartbeat_; }
  /// The configuration of the latest Start().
  const config::DaemonConfig& config() const { return config_; }

 private:
  /// A press that the cycle accepted and that is not known to be in the journal yet.
  struct AwaitedPress {
    std::uint32_t number = 0;
    std::string reading;  ///< as the log shows it
  };
  struct ReadGauge {
    config::GaugeConfig config;
    std::uint16_t artefact = 0;  ///< number in the cell's list, from 1
    gauge::Gauge device;
    bool lost = false;  ///< logged as lost
    double last_reading_s = -1e300;
    std::vector<double> intervals_s{};  ///< of the latest readings
    bool continuous = false;            ///< logged as sending without a press
    bool connected_once = false;
    std::vector<AwaitedPress> awaited{};
    std::uint32_t latest = 0;  ///< number of the latest press, if it was accepted; otherwise 0
    status::GaugeStatus status{};
  };
  void Run();
  void ReadOnce(ReadGauge& gauge);
  void Record(ReadGauge& gauge, double reading_m);
  /// Logs that a reading was not recorded, and publishes why.
  void Refuse(ReadGauge& gauge, status::GaugeOutcome outcome, const std::string& text);
  void SetOutcome(ReadGauge& gauge, status::GaugeOutcome outcome);
  /// Logs of the awaited presses whether the journal has their rows, as far as that is known now.
  void FollowAwaited(ReadGauge& gauge);
  void Await(ReadGauge& gauge, const std::string& reading);
  /// Updates the state of a gauge; publishes the status of all if it changed.
  void SetState(ReadGauge& gauge);
  void PublishStatus();
  static bool IsContinuous(ReadGauge& gauge, double now_s);
  /// Result of the cycle for a press; nullopt if it did not handle it in time.
  std::optional<correction::CorrectionCode> CodeOf(std::uint32_t number);

  GaugeMailbox& mailbox_;
  log::LogSink sink_;
  config::DaemonConfig config_;
  std::vector<ReadGauge> gauges_;
  std::uint32_t number_ = 0;  ///< of the latest press
  std::atomic<bool> stop_{false};
  ThreadHeartbeat heartbeat_;
  std::thread thread_;
};

/// Whether the worker must be restarted for another configuration: other gauges, or another number
/// of a gauge in the cell's list.
bool GaugesDiffer(const config::DaemonConfig& a, const config::DaemonConfig& b);

}  // namespace plumbline::cell
