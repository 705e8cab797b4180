// Fleet publisher loop: daemon states and journal probes -> persistent queue -> broker.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/base/config/daemon_config.h"
#include "app/cell/view_link/view_client.h"
#include "app/plant/broker/broker_link.h"
#include "app/plant/publish/change_detector.h"
#include "app/plant/publish/probe_tail.h"
#include "app/plant/publish/queue.h"

namespace plumbline::plant {

/// Folder of the queue, the only one that the publisher writes to.
inline std::string FleetFolderOf(const std::string& state_directory) {
  return state_directory + "/fleet";
}
FleetCell FleetCellOf(const config::DaemonConfig& config);

/// All messages go through the queue, whether the broker is connected or not. A new connection
/// starts with a birth message and then publishes all messages of the queue, oldest first.
///
/// A message is removed once the connection on which the broker acknowledged it has lasted for
/// `repeat_s` more: until then the broker may be killed before it has saved the message. A
/// connection that breaks within that time is therefore followed by a repetition of everything
/// kept, but not sooner than kRepeatPause_s after the previous repetition: a connection that
/// flickers first publishes only what is unacknowledged, and repeats the rest once it lasts.
class FleetLoop {
 public:
  static constexpr std::size_t kMaxInFlight = 200;
  /// Limit on messages held in memory while the queue cannot be written.
  static constexpr std::size_t kMaxPending = 10'000;
  static constexpr double kRepeatPause_s = 10;
  FleetLoop(const config::DaemonConfig& config, FleetQueue queue);

  /// One iteration, at most about 100 ms.
  void RunOnce();
  /// Publishes the death message and waits for its acknowledgement.
  void End(double timeout_s);

  /// Status line for the service manager.
  std::string Status() const;
  std::uint64_t link_beats() const { return link_.beats(); }

 private:
  void ReadDaemonState();
  void ReadJournal(double now_s);
  void ReportCell(double now_s);
  void AddPending(std::vector<Message> messages);
  void StorePending();
  void LogQueueFault(const std::string& problem);
  void Forward();
  Result<void> StoreAcknowledged(double now_s);
  void RemoveSettled(double now_s);
  void RepeatKept();
  void HandleConnectionChange(std::int64_t connection);
  void LogConnected() const;
  void FollowIntrusion(const BrokerLink::Status& status);
  void LogBacklog();
  std::string Memory() const;

  const config::DaemonConfig daemon_;
  const config::MqttConfig config_;
  const FleetCell cell_;
  FleetQueue queue_;
  cell::ViewClient client_;
  ProbeTail tail_;
  std::optional<ProbeMark> mark_;
  ChangeDetector changes_;
  BrokerLink link_;

  cell::View view_;
  std::vector<Message> pending_;    ///< not in the queue yet
  int discarded_ = 0;               ///< messages discarded since the queue failed
  double tried_s_ = -1e300;         ///< last attempt to write the queue
  double journal_read_s_ = -1e300;  ///< last read of the journal
  int cell_model_ = -1;             ///< model of the cell that was compared last; -1: none yet
  double cell_read_s_ = -1e300;     ///< last attempt to read the cell
  std::string cell_reported_;       ///< hash of the last NCELL message
  std::int64_t connection_ = 0;     ///< 0: none
  std::int64_t sent_ = 0;           ///< seq of the last published message
  std::size_t in_flight_ = 0;
  std::vector<std::int64_t> acknowledged_;  ///< not recorded in the queue yet
  struct Kept {
    std::int64_t seq = 0;
    double acknowledged_s = 0;
  };
  std::deque<Kept> kept_;  ///< acknowledged on this connection, in that order
  double removed_s_ = -1e300;
  bool repetition_due_ = false;  ///< messages were kept when the connection was made
  FleetQueue::Rows rows_ = FleetQueue::Rows::kUnacknowledged;  ///< that this connection publishes
  std::string queue_problem_, journal_problem_, cell_problem_, link_problem_, feed_problem_;
  std::int64_t backlog_ = 0;  ///< queued when the connection was made; 0 once all are forwarded
  double connected_s_ = 0;
  FleetQueue::Dropped dropped_reported_{};  ///< counts already reported to the plant
  bool dropping_ = false;
  bool intruded_ = false;  ///< the broker sent what it must not, and that was logged
};

}  // namespace plumbline::plant
