// Collector loop: broker -> batch -> one transaction -> acknowledgement.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/plant/broker/subscriber.h"
#include "app/plant/collect/message_store.h"
#include "app/plant/database/plant_config.h"
#include "drivers/back_off.h"

namespace plumbline::plant {

/// The database is connected first and lost last: without it nothing is read, so that the broker
/// keeps the messages. After a failed transaction both connections are closed; the broker repeats
/// what was not acknowledged, and the ledger discards what had been committed.
class CollectLoop {
 public:
  static constexpr std::size_t kBatch = 10'000;
  /// Messages that are written before one commit waits for the disk, and all are acknowledged.
  static constexpr std::size_t kMostUnacknowledged = 5 * kBatch;
  explicit CollectLoop(const PlantConfig& config)
      : config_(config),
        admission_(config.collect.messages_per_second, config.collect.messages_per_day),
        admitted_(admission_) {}

  /// One iteration: at most a batch, or one attempt to connect.
  void RunOnce();
  /// Status line for the service manager.
  std::string Status() const;

 private:
  void ConnectDatabase(double now_s);
  void ConnectBroker(double now_s);
  void Collect();
  bool WriteBatch();
  void DatabaseFailed(const std::string& why);
  void LogDatabaseLost(const std::string& why);
  void LogBrokerLost(const std::string& why);
  void LogFindings();
  SubscriberSettings BrokerAccess() const;

  const PlantConfig config_;
  Admission admission_, admitted_;  ///< now; when messages were last acknowledged
  std::unique_ptr<MessageStore> store_;
  std::unique_ptr<Subscriber> subscriber_;
  BackOff database_pause_, broker_pause_;
  std::string database_problem_, broker_problem_;
  bool broker_logged_ = false;
  std::vector<Received> batch_;
  std::size_t unacknowledged_ = 0;  ///< messages that are written, perhaps not on disk
  double acknowledged_s_ = -1e300;
  double begun_s_ = 0;         ///< when the batch received its first message, monotonic
  double dropped_s_ = -1e300;  ///< when old rows were last dropped
  double findings_s_ = -1e300;
  StoreCounts before_, reported_;  ///< of earlier stores; of what was logged
  StoreCounts Counts() const;
};

}  // namespace plumbline::plant
