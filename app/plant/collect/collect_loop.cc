#include "app/plant/collect/collect_loop.h"

#include <fmt/format.h>

#include "app/base/log/log.h"
#include "app/base/service/utc_clock.h"
#include "app/plant/database/schema.h"
#include "drivers/clock.h"

namespace plumbline::plant {
namespace {

constexpr double kBatch_s = 0.2;      ///< a message waits at most this long for others
constexpr double kAcknowledge_s = 5;  ///< after which no batch is added before an acknowledgement
constexpr int kWait_ms = 50;
constexpr double kForbiddenPause_s = 30;  ///< until a person has changed something
constexpr double kDropPeriod_s = 6 * 3600;
constexpr double kFindingsPeriod_s = 60;

}  // namespace

StoreCounts CollectLoop::Counts() const {
  StoreCounts sum = before_;
  if (store_ == nullptr) return sum;
  const StoreCounts& now = store_->counts();
  sum.stored += now.stored;
  sum.repeated += now.repeated;
  sum.dead_letters += now.dead_letters;
  sum.refused += now.refused;
  return sum;
}

SubscriberSettings CollectLoop::BrokerAccess() const {
  const BrokerSettings& broker = config_.broker;
  SubscriberSettings settings;
  settings.host = broker.host;
  settings.port = broker.port;
  settings.account = {broker.tls_ca, broker.username, broker.password_file};
  settings.client_id = "plumbline-collect-" + config_.collect.name;
  settings.topic = config_.collect.topic;
  if (!config_.collect.share.empty()) {
    settings.topic = fmt::format("$share/{}/{}", config_.collect.share, settings.topic);
  }
  return settings;
}

void CollectLoop::LogDatabaseLost(const std::string& why) {
  if (why == database_problem_) return;
  database_problem_ = why;
  log::Log({log::Event::kCollectDatabaseLost,
            fmt::format("database: {}; messages stay at the broker meanwhile", why)});
}

void CollectLoop::LogBrokerLost(const std::string& why) {
  if (why == broker_problem_) return;
  broker_problem_ = why;
  broker_logged_ = false;
  log::Log({log::Event::kCollectBrokerLost,
            fmt::format("broker {}:{}: {}", config_.broker.host, config_.broker.port, why)});
}

void CollectLoop::ConnectDatabase(double now_s) {
  if (!database_pause_.Due(now_s)) return;
  auto connection = Connection::Open(config_.database.connection, "plumbline-collect");
  Result<void> usable =
      connection ? RequireSchema(connection.value()) : Result<void>(connection.failure());
  auto store = usable ? MessageStore::On(std::move(connection).value(), admission_)
                      : Result<MessageStore>(usable.failure());
  if (!store) {
    LogDatabaseLost(store.error());
    database_pause_.Failed(MonotonicSeconds(), 0);
    return;
  }
  store_ = std::make_unique<MessageStore>(std::move(store).value());
  if (database_problem_.empty()) log::Log({log::Event::kCollectDatabaseUp, "database connected"});
}

void CollectLoop::ConnectBroker(double now_s) {
  if (!broker_pause_.Due(now_s)) return;
  auto subscriber = Subscriber::Connect(BrokerAccess());
  if (subscriber) {
    subscriber_ = std::move(subscriber).value();
    batch_.clear();
    // The broker repeats what was not acknowledged; nothing of it counts twice.
    unacknowledged_ = 0;
    admission_ = admitted_;
    return;
  }
  LogBrokerLost(subscriber.error());
  broker_pause_.Failed(MonotonicSeconds(), 0);
}

void CollectLoop::DatabaseFailed(const std::string& why) {
  const bool forbidden = store_->forbidden();
  LogDatabaseLost(why + (forbidden ? "; the database user needs the role plumbline_collector, and "
                                     "the server must not be read-only"
                                   : ""));
  before_ = Counts();
  subscriber_.reset();
  store_.reset();
  batch_.clear();
  database_pause_.Failed(MonotonicSeconds(), forbidden ? kForbiddenPause_s : 0);
}

bool CollectLoop::WriteBatch() {
  if (const auto written = store_->Write(batch_, service::SystemUtcSeconds()); !written) {
    DatabaseFailed(written.error());
    return false;
  }
  unacknowledged_ += batch_.size();
  batch_.clear();
  if (!database_problem_.empty()) {
    log::Log({log::Event::kCollectDatabaseUp, "database connected again; messages are stored"});
  }
  database_problem_.clear();
  database_pause_.Well();
  return true;
}

void CollectLoop::Collect() {
  const std::size_t before = batch_.size();
  Result<void> read = subscriber_->Read(kWait_ms, kBatch, batch_);
  const double now_s = MonotonicSeconds();
  if (before == 0) begun_s_ = now_s;
  const bool full = batch_.size() >= kBatch;
  // At the end of a connection, what was read is worth storing: its repetition is discarded.
  if (!batch_.empty() && (full || now_s - begun_s_ > kBatch_s || !read)) {
    if (!WriteBatch()) return;
  }
  // While a backlog arrives, one wait for the disk covers several batches.
  const bool more = full && unacknowledged_ + kBatch <= kMostUnacknowledged &&
                    now_s - acknowledged_s_ < kAcknowledge_s;
  if (read && batch_.empty() && !more) {
    if (unacknowledged_ > 0) {
      if (const auto flushed = store_->Flush(); !flushed) return DatabaseFailed(flushed.error());
    }
    read = subscriber_->Acknowledge();  // the subscription and pings, too
    if (read && unacknowledged_ > 0) admitted_ = admission_;
    if (read) unacknowledged_ = 0;
    acknowledged_s_ = now_s;
  }
  if (!read) {
    LogBrokerLost(read.error());
    subscriber_.reset();
    batch_.clear();
    broker_pause_.Failed(MonotonicSeconds(), 0);
    return;
  }
  if (!subscriber_->subscribed() || broker_logged_) return;
  broker_logged_ = true;
  broker_problem_.clear();
  broker_pause_.Well();
  log::Log({log::Event::kCollectBrokerUp,
            fmt::format("broker {}:{} connected; {}", config_.broker.host, config_.broker.port,
                        subscriber_->session_kept()
                            ? "it has kept this collector's messages"
                            : "it had kept nothing for this collector: messages published before "
                              "now arrive only if the cells repeat them")});
}

void CollectLoop::LogFindings() {
  const StoreCounts now = Counts();
  if (now.dead_letters > reported_.dead_letters) {
    log::Log({log::Event::kCollectDeadLetters,
              fmt::format("{} messages could not be read; they are in the table dead_letter, with "
                          "the reason. `plumbline plant status` groups them",
                          now.dead_letters - reported_.dead_letters)});
  }
  if (now.refused > reported_.refused) {
    log::Log({log::Event::kCollectRefused,
              fmt::format("{} messages were refused because their cells sent too many; `plumbline "
                          "plant status` names the cells",
                          now.refused - reported_.refused)});
  }
  reported_ = now;
}

void CollectLoop::RunOnce() {
  const double now_s = MonotonicSeconds();
  if (store_ == nullptr) ConnectDatabase(now_s);
  if (store_ == nullptr) return SleepSeconds(1e-3 * kWait_ms);
  if (subscriber_ == nullptr) ConnectBroker(now_s);
  if (subscriber_ == nullptr) return SleepSeconds(1e-3 * kWait_ms);
  Collect();
  if (now_s - findings_s_ > kFindingsPeriod_s) {
    findings_s_ = now_s;
    LogFindings();
  }
  if (store_ != nullptr && batch_.empty() && now_s - dropped_s_ > kDropPeriod_s) {
    dropped_s_ = now_s;
    if (const auto dropped = store_->DropOld(service::SystemUtcSeconds()); !dropped) {
      log::Log({log::Event::kCollectRetention,
                fmt::format("old messages are not deleted: {}", dropped.error())});
    }
  }
}

std::string CollectLoop::Status() const {
  const StoreCounts now = Counts();
  const std::string database = store_ != nullptr           ? "database connected"
                               : database_problem_.empty() ? "database not connected yet"
                                                           : "database: " + database_problem_;
  const std::string broker = subscriber_ != nullptr && subscriber_->subscribed()
                                 ? "broker connected"
                             : broker_problem_.empty() ? "broker not connected"
                                                       : "broker: " + broker_problem_;
  return fmt::format("{}; {}; {} messages stored, {} repeated, {} unreadable, {} refused", broker,
                     database, now.stored, now.repeated, now.dead_letters, now.refused);
}

}  // namespace plumbline::plant
