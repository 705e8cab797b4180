#include "app/plant/publish/fleet_loop.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/base/log/log.h"
#include "app/base/service/utc_clock.h"
#include "app/base/text/json_text.h"
#include "app/cell/journal/journal.h"
#include "drivers/clock.h"

namespace plumbline::plant {
namespace {

constexpr double kIdleWait_s = 0.1;    ///< if nothing is in flight
constexpr double kBusyWait_s = 0.002;  ///< if messages are in flight
constexpr double kJournalPeriod_s = 1;
constexpr double kRetry_s = 1;  ///< of a queue that cannot be written, a cell that cannot be read
constexpr double kBytesPerMB = 1e6;
/// Removal of kept messages: its interval, and how many at a time, so that none takes long.
constexpr double kRemovalPeriod_s = 0.2;
constexpr std::size_t kMaxRemoved = 2000;
/// Ids of messages that are not in the queue.
constexpr std::int64_t kBirthId = -1, kDeathId = -2;

std::int64_t NowUtc_ms() {
  return std::llround(1e3 * service::SystemUtcSeconds());
}

nlohmann::json MemoryOf(const FleetQueue& queue) {
  auto json = text::JsonOrNull(queue.memory());
  return json.is_object() ? json : nlohmann::json::object();
}

std::optional<ProbeMark> MarkOf(const FleetQueue& queue) {
  const auto memory = MemoryOf(queue);
  const auto mark = memory.find("probes");
  if (mark == memory.end() || !mark->is_object()) return std::nullopt;
  return ProbeMark{mark->value("journal", std::int64_t{0}), mark->value("id", std::int64_t{0})};
}

BrokerLink::LastWill WillOf(const FleetCell& cell) {
  return {TopicOf(cell, "NDEATH"),
          [](std::int64_t number) { return DeathText(number, number, false); }};
}

std::string HostName() {
  char name[256] = {};
  return gethostname(name, sizeof name - 1) == 0 ? name : "";
}

std::string DroppedText(const FleetQueue::Dropped& dropped) {
  return fmt::format("{} states, {} changes, {} alarms and probes", dropped[0], dropped[1],
                     dropped[2]);
}

}  // namespace

FleetCell FleetCellOf(const config::DaemonConfig& config) {
  const model::CellModel& model = config.machine.cell;
  FleetCell cell{config.mqtt->group, config.mqtt->node, model.robot.name, model.robot.joints, {}};
  for (const correction::AssemblyPoint& point : config.machine.points) {
    cell.points.push_back({point.id, point.name});
  }
  cell.arm = model.robot.identity;
  cell.page = config.mqtt->page_url.empty() ? config::PageUrl(config.page, HostName())
                                            : config.mqtt->page_url;
  return cell;
}

FleetLoop::FleetLoop(const config::DaemonConfig& config, FleetQueue queue)
    : daemon_(config),
      config_(*config.mqtt),
      cell_(FleetCellOf(config)),
      queue_(std::move(queue)),
      client_(cell::ViewSocketOf(config.state_directory), false),
      tail_(config.state_directory + "/journal.sqlite", cell_.joints),
      mark_(MarkOf(queue_)),
      changes_(config_, cell_, text::JsonText(MemoryOf(queue_).value("changes", nlohmann::json()))),
      link_(config_, WillOf(cell_)),
      cell_reported_(MemoryOf(queue_).value("cell", "")) {}

std::string FleetLoop::Memory() const {
  nlohmann::ordered_json memory = {
      {"changes", text::JsonOrNull<nlohmann::ordered_json>(changes_.Memory())}};
  if (mark_) memory["probes"] = {{"journal", mark_->journal}, {"id", mark_->id}};
  if (!cell_reported_.empty()) memory["cell"] = cell_reported_;
  return text::JsonText(memory);
}

void FleetLoop::RunOnce() {
  ReadDaemonState();
  ReadJournal(MonotonicSeconds());
  StorePending();
  Forward();
}

void FleetLoop::ReadDaemonState() {
  const bool came = client_.Read(in_flight_ > 0 ? kBusyWait_s : kIdleWait_s, view_);
  AddPending(came ? changes_.Update(view_.state, MonotonicSeconds())
                  : changes_.UpdateWithoutState(MonotonicSeconds(), service::SystemUtcSeconds()));
  if (came) {
    ReportCell(MonotonicSeconds());
    log::SetLogContext({view_.state.cell, view_.state.model_version});
    if (!feed_problem_.empty())
      log::Log({log::Event::kFleetFeedBack, "receiving data from plumblined again"});
    feed_problem_.clear();
  } else if (!client_.connected() && !client_.problem().empty() && feed_problem_.empty()) {
    feed_problem_ = client_.problem();
    log::Log({log::Event::kFleetFeedLost, feed_problem_});
  }
}

/// While the queue cannot be written, messages wait in memory: states are not kept, and of the
/// others the least important are discarded first beyond kMaxPending.
void FleetLoop::AddPending(std::vector<Message> messages) {
  for (Message& message : messages) {
    if (!queue_problem_.empty() && ImportanceOf(message.kind) == 0) continue;
    if (pending_.size() >= kMaxPending) {
      const auto least = std::min_element(pending_.begin(), pending_.end(),
                                          [](const Message& a, const Message& b) {
                                            return ImportanceOf(a.kind) < ImportanceOf(b.kind);
                                          });
      pending_.erase(least);
      ++discarded_;
    }
    pending_.push_back(std::move(message));
  }
}

void FleetLoop::LogQueueFault(const std::string& problem) {
  if (queue_problem_.empty()) log::Log({log::Event::kFleetQueueFault, "queue: " + problem});
  queue_problem_ = problem;
}

void FleetLoop::ReadJournal(double now_s) {
  if (!config_.journal || !queue_problem_.empty() || now_s - journal_read_s_ < kJournalPeriod_s)
    return;
  journal_read_s_ = now_s;
  const auto taken = tail_.ReadNew(mark_);
  if (!taken) {
    if (journal_problem_.empty()) {
      log::Log(
          {log::Event::kFleetJournal, fmt::format("probes are not published: {}", taken.error())});
    }
    journal_problem_ = taken.error();
    return;
  }
  journal_problem_.clear();
  mark_ = taken->mark;
  for (const ProbeRow& probe : taken->probes) {
    pending_.push_back({MessageKind::kProbe, *probe.unix_ms, ProbeBody(probe, cell_.joints)});
  }
  if (taken->skipped > 0) {
    log::Log({log::Event::kFleetJournal,
              fmt::format("{} probes are not published: they were recorded with another number of "
                          "joints than the cell's {}",
                          taken->skipped, cell_.joints.size())});
  }
}

/// At the start and whenever another model comes into force; published if the plant does not have
/// this content yet.
void FleetLoop::ReportCell(double now_s) {
  const int model = view_.state.model_version;
  if (model == cell_model_ || now_s - cell_read_s_ < kRetry_s) return;
  cell_read_s_ = now_s;
  const auto in_force = ReadCellInForce(daemon_, model);
  if (!in_force) {
    if (cell_problem_.empty()) {
      log::Log(
          {log::Event::kFleetCell, fmt::format("the cell is not published: {}", in_force.error())});
    }
    cell_problem_ = in_force.error();
    return;
  }
  cell_problem_.clear();
  cell_model_ = model;
  std::string body = CellBody(cell_, *in_force);
  const std::string hash = fmt::format("{:016x}", cell::ContentHash(body));
  if (hash == cell_reported_) return;
  cell_reported_ = hash;
  AddPending({{MessageKind::kCell, std::llround(1e3 * view_.state.utc_s), std::move(body)}});
}

void FleetLoop::StorePending() {
  const bool faulty = !queue_problem_.empty();
  if (faulty && MonotonicSeconds() - tried_s_ < kRetry_s) return;
  tried_s_ = MonotonicSeconds();
  const FleetQueue::Dropped before = queue_.dropped();
  const auto kept = queue_.Append(pending_, Memory(), faulty);
  if (!kept) return LogQueueFault(kept.error());
  const std::size_t late = std::exchange(pending_, {}).size();
  if (faulty) {
    // The queue works only if it can be appended to, removed from and read.
    if (const auto stored = StoreAcknowledged(MonotonicSeconds()); !stored)
      return LogQueueFault(stored.error());
    if (const auto next = queue_.Next(sent_, 1); !next) return LogQueueFault(next.error());
    log::Log({log::Event::kFleetQueueWorks,
              fmt::format("queue works again; {} messages are published late, {} were discarded",
                          late, std::exchange(discarded_, 0))});
    queue_problem_.clear();
  }
  if (queue_.dropped() == before || dropping_) return;
  dropping_ = true;
  log::Log(
      {log::Event::kFleetDropping,
       fmt::format("queue is full ({:.0f} MB): the oldest states are dropped from now on, then the "
                   "oldest changes, and alarms and probes last. Restore the broker connection",
                   static_cast<double>(config_.queue_bytes) / kBytesPerMB)});
}

void FleetLoop::HandleConnectionChange(std::int64_t connection) {
  connection_ = connection;
  sent_ = 0;
  in_flight_ = 0;
  // What the broker acknowledged on the previous connection it may have forgotten since.
  acknowledged_.clear();
  kept_.clear();
  rows_ = FleetQueue::Rows::kUnacknowledged;
  repetition_due_ = queue_.kept() > 0;
  if (connection == 0) return;
  if (dropping_) {
    log::Log({log::Event::kFleetDropped,
              "dropped since the queue was created: " + DroppedText(queue_.dropped())});
    dropping_ = false;
  }
  if (queue_.dropped() != dropped_reported_ && queue_.dropped() != FleetQueue::Dropped{}) {
    dropped_reported_ = queue_.dropped();
    pending_.push_back({MessageKind::kLost, NowUtc_ms(), LostBody(dropped_reported_)});
    StorePending();
  }
  backlog_ = queue_.size();
  connected_s_ = MonotonicSeconds();
  if (!intruded_) LogConnected();
  link_.Publish(connection, {{kBirthId, TopicOf(cell_, "NBIRTH"),
                              BirthText(cell_, queue_, connection, NowUtc_ms()), true}});
  ++in_flight_;
}

void FleetLoop::LogConnected() const {
  const std::string repeated =
      repetition_due_ ? fmt::format("; {} recent ones are published again", queue_.kept()) : "";
  log::Log({log::Event::kBrokerUp, fmt::format("broker {}:{} connected, {} messages queued{}",
                                               config_.host, config_.port, backlog_, repeated)});
}

Result<void> FleetLoop::StoreAcknowledged(double now_s) {
  const bool keep = config_.repeat_s > 0;
  const auto stored = keep ? queue_.Acknowledge(acknowledged_) : queue_.Remove(acknowledged_);
  if (!stored) return stored;
  for (const std::int64_t seq : std::exchange(acknowledged_, {})) {
    if (keep) kept_.push_back({seq, now_s});
  }
  return {};
}

/// Removes what the broker has had time to save.
void FleetLoop::RemoveSettled(double now_s) {
  if (!queue_problem_.empty() || now_s - removed_s_ < kRemovalPeriod_s) return;
  removed_s_ = now_s;
  std::vector<std::int64_t> seqs;
  while (!kept_.empty() && seqs.size() < kMaxRemoved &&
         now_s - kept_.front().acknowledged_s >= config_.repeat_s) {
    seqs.push_back(kept_.front().seq);
    kept_.pop_front();
  }
  // After a failure they stay in the file and are repeated on the next connection.
  if (const auto removed = queue_.Remove(seqs); !removed) LogQueueFault(removed.error());
}

/// Starts to publish all messages again, once for a connection.
void FleetLoop::RepeatKept() {
  const std::int64_t now_ms = NowUtc_ms();
  // A clock that was set back delays nothing.
  const auto since_s = 1e-3 * static_cast<double>(std::abs(now_ms - queue_.repeated_ms()));
  if (!repetition_due_ || !queue_problem_.empty() || since_s < kRepeatPause_s) return;
  if (const auto noted = queue_.RecordRepetition(now_ms); !noted)
    return LogQueueFault(noted.error());
  repetition_due_ = false;
  rows_ = FleetQueue::Rows::kAll;
  sent_ = 0;
}

/// A broker that misbehaves is logged once, until it has behaved for as long as it was left alone.
void FleetLoop::FollowIntrusion(const BrokerLink::Status& status) {
  if (status.intruded && !intruded_) {
    log::Log(
        {log::Event::kBrokerIntruded,
         fmt::format("broker {}:{} {}: disconnected, and tried again every {:.0f} s; messages "
                     "are queued meanwhile. Check that it is the plant's broker",
                     config_.host, config_.port, status.problem, BrokerLink::kIntrusionPause_s)});
    intruded_ = true;
  } else if (intruded_ && connection_ != 0 &&
             MonotonicSeconds() - connected_s_ > BrokerLink::kIntrusionPause_s) {
    intruded_ = false;
    LogConnected();
  }
}

void FleetLoop::Forward() {
  const BrokerLink::Status status = link_.TakeStatus();
  std::copy_if(status.acknowledged.begin(), status.acknowledged.end(),
               std::back_inserter(acknowledged_), [](std::int64_t id) { return id > 0; });
  const double now_s = MonotonicSeconds();
  if (queue_problem_.empty()) {
    if (const auto stored = StoreAcknowledged(now_s); !stored) LogQueueFault(stored.error());
  }
  if (status.connection != connection_) {
    HandleConnectionChange(status.connection);
  } else {
    in_flight_ -= std::min(in_flight_, status.acknowledged.size());
  }
  FollowIntrusion(status);
  if (connection_ == 0) {
    if (status.intruded) link_problem_ = status.problem;
    if (!status.problem.empty() && status.problem != link_problem_ &&
        status.problem != "not connected yet") {
      link_problem_ = status.problem;
      log::Log(
          {log::Event::kBrokerLost, fmt::format("broker {}:{}: {}; messages are queued meanwhile",
                                                config_.host, config_.port, status.problem)});
    }
    return;
  }
  link_problem_.clear();
  RemoveSettled(now_s);
  RepeatKept();
  if (in_flight_ < kMaxInFlight) {
    const auto next = queue_.Next(sent_, kMaxInFlight - in_flight_, rows_);
    if (!next) LogQueueFault(next.error());
    if (next && !next->empty()) {
      std::vector<Outgoing> messages;
      for (const QueuedMessage& queued : *next) {
        messages.push_back({queued.seq, TopicOf(cell_, TopicTypeOf(queued.message.kind)),
                            MessageText(queue_.stream(), queued), false});
      }
      sent_ = next->back().seq;
      in_flight_ += messages.size();
      link_.Publish(connection_, std::move(messages));
    }
  }
  LogBacklog();
}

void FleetLoop::LogBacklog() {
  if (backlog_ == 0 || in_flight_ > 0) return;
  if (backlog_ > 1) {
    log::Log(
        {log::Event::kFleetForwarded, fmt::format("{} messages forwarded in {:.1f} s", backlog_,
                                                  MonotonicSeconds() - connected_s_)});
  }
  backlog_ = 0;
}

void FleetLoop::End(double timeout_s) {
  if (connection_ == 0) return;
  link_.Publish(connection_, {{kDeathId, TopicOf(cell_, "NDEATH"),
                               DeathText(connection_, NowUtc_ms(), true), true}});
  const double until_s = MonotonicSeconds() + timeout_s;
  while (MonotonicSeconds() < until_s) {
    const BrokerLink::Status status = link_.TakeStatus();
    if (status.connection != connection_) return;  // the broker publishes the will
    bool death_acknowledged = false;
    for (const std::int64_t id : status.acknowledged) {
      if (id > 0) acknowledged_.push_back(id);
      death_acknowledged = death_acknowledged || id == kDeathId;
    }
    static_cast<void>(StoreAcknowledged(MonotonicSeconds()));  // else it is published again
    if (death_acknowledged) return link_.SuppressWill(connection_);
    SleepSeconds(kBusyWait_s);
  }
}

std::string FleetLoop::Status() const {
  const std::string broker = connection_ != 0        ? "broker connected"
                             : link_problem_.empty() ? "broker not connected yet"
                                                     : "broker: " + link_problem_;
  return fmt::format("{}; {}; {} messages queued", broker,
                     feed_problem_.empty() ? "daemon connected" : "no data from plumblined",
                     queue_.size());
}

}  // namespace plumbline::plant
