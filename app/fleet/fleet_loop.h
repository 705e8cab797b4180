// The publisher: what the daemon shows and the journal keeps -> the queue on the disk -> the
// broker.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/config/daemon_config.h"
#include "app/fleet/broker_link.h"
#include "app/fleet/changes.h"
#include "app/fleet/probe_tail.h"
#include "app/fleet/queue.h"
#include "app/view_link/view_client.h"

namespace plumbline {

/// Where its queue lies: the only folder that it writes to.
inline std::string FleetFolderOf(const std::string& state_directory) {
  return state_directory + "/fleet";
}
FleetCell FleetCellOf(const DaemonConfig& config);

/// Everything goes through the queue, whether the broker is there or not: one way, tested once.
/// Messages on their way stay in the queue until they are acknowledged; on a new connection all of
/// them go again, from the oldest, behind a birth.
class FleetLoop {
 public:
  static constexpr std::size_t kMostOnTheWay = 200;
  /// Kept in memory while the queue does not work.
  static constexpr std::size_t kMostPending = 10'000;
  FleetLoop(const DaemonConfig& config, FleetQueue queue);

  /// One round, at most some 100 ms.
  void Round();
  /// Says goodbye to the broker, with patience.
  void End(double patience_s);

  /// One line for the service manager.
  std::string Status() const;
  std::uint64_t link_beats() const { return link_.beats(); }

 private:
  void LookAtDaemon();
  void LookAtJournal(double now_s);
  void Notice(std::vector<Message> messages);
  void Keep();
  void QueueFault(const std::string& problem);
  void Forward();
  void TakeConnection(std::int64_t connection);
  void TellQueue();
  std::string Memory() const;

  const MqttConfig config_;
  const FleetCell cell_;
  FleetQueue queue_;
  ViewClient client_;
  ProbeTail tail_;
  std::optional<ProbeMark> mark_;
  Changes changes_;
  BrokerLink link_;

  View view_;
  std::vector<Message> pending_;  ///< noticed, not in the queue yet
  int forgotten_ = 0;             ///< of those, since the queue does not work
  double tried_s_ = -1e300;       ///< to write the queue
  double looked_s_ = -1e300;      ///< at the journal
  std::int64_t connection_ = 0;   ///< 0: none
  std::int64_t sent_ = 0;         ///< seq of the last one on its way
  std::size_t on_the_way_ = 0;
  std::vector<std::int64_t> arrived_;  ///< acknowledged, not out of the queue yet
  std::string queue_problem_, journal_problem_, link_problem_, feed_problem_;
  std::int64_t backlog_ = 0;  ///< messages that waited when the connection came; 0: forwarded
  double connected_s_ = 0;
  FleetQueue::Dropped dropped_told_{};  ///< to the plant, by a message or a birth
  bool dropping_ = false;
};

}  // namespace plumbline
