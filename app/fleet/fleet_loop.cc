#include "app/fleet/fleet_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "app/log/log.h"
#include "app/service/utc_clock.h"
#include "app/text/json_text.h"
#include "drivers/clock.h"

namespace plumbline {
namespace {

constexpr double kRest_s = 0.1;     ///< where nothing is on its way
constexpr double kHurry_s = 0.002;  ///< where something is
constexpr double kJournalPeriod_s = 1;
constexpr double kRetry_s = 1;  ///< of a queue that does not work
constexpr double kBytesPerMB = 1e6;
/// Of messages that are not in the queue.
constexpr std::int64_t kBirthId = -1, kDeathId = -2;

std::int64_t NowUtc_ms() {
  return std::llround(1e3 * ComputerUtcSeconds());
}

nlohmann::json MemoryOf(const FleetQueue& queue) {
  auto json = JsonOrNull(queue.memory());
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

std::string DroppedText(const FleetQueue::Dropped& dropped) {
  return fmt::format("{} states, {} changes, {} alarms and probes", dropped[0], dropped[1],
                     dropped[2]);
}

}  // namespace

FleetCell FleetCellOf(const DaemonConfig& config) {
  const CellModel& model = config.machine.cell;
  FleetCell cell{config.mqtt->group, config.mqtt->node, model.robot.name, model.robot.joints, {}};
  for (const AssemblyPoint& point : config.machine.points) {
    cell.points.push_back({point.id, point.name});
  }
  return cell;
}

FleetLoop::FleetLoop(const DaemonConfig& config, FleetQueue queue)
    : config_(*config.mqtt),
      cell_(FleetCellOf(config)),
      queue_(std::move(queue)),
      client_(ViewSocketOf(config.state_directory), false),
      tail_(config.state_directory + "/journal.sqlite"),
      mark_(MarkOf(queue_)),
      changes_(config_, cell_, MemoryOf(queue_).value("changes", nlohmann::json()).dump()),
      link_(config_, WillOf(cell_)) {}

std::string FleetLoop::Memory() const {
  nlohmann::ordered_json memory = {
      {"changes", JsonOrNull<nlohmann::ordered_json>(changes_.Memory())}};
  if (mark_) memory["probes"] = {{"journal", mark_->journal}, {"id", mark_->id}};
  return memory.dump();
}

void FleetLoop::Round() {
  LookAtDaemon();
  LookAtJournal(MonotonicSeconds());
  Keep();
  Forward();
}

void FleetLoop::LookAtDaemon() {
  const bool came = client_.Read(on_the_way_ > 0 ? kHurry_s : kRest_s, view_);
  Notice(came ? changes_.Take(view_.state, MonotonicSeconds())
              : changes_.Wait(MonotonicSeconds(), ComputerUtcSeconds()));
  if (came) {
    SetLogContext({view_.state.cell, view_.state.model_version});
    if (!feed_problem_.empty()) Log({Event::kFleetFeedBack, "the daemon's states come again"});
    feed_problem_.clear();
  } else if (!client_.connected() && !client_.problem().empty() && feed_problem_.empty()) {
    feed_problem_ = client_.problem();
    Log({Event::kFleetFeedLost, feed_problem_});
  }
}

/// While the queue does not work what is noticed waits here: no states, and of the rest what is
/// least important goes first where it is too much.
void FleetLoop::Notice(std::vector<Message> messages) {
  for (Message& message : messages) {
    if (!queue_problem_.empty() && ImportanceOf(message.kind) == 0) continue;
    if (pending_.size() >= kMostPending) {
      const auto least = std::min_element(pending_.begin(), pending_.end(),
                                          [](const Message& a, const Message& b) {
                                            return ImportanceOf(a.kind) < ImportanceOf(b.kind);
                                          });
      pending_.erase(least);
      ++forgotten_;
    }
    pending_.push_back(std::move(message));
  }
}

void FleetLoop::QueueFault(const std::string& problem) {
  if (queue_problem_.empty()) Log({Event::kFleetQueueFault, "queue: " + problem});
  queue_problem_ = problem;
}

void FleetLoop::LookAtJournal(double now_s) {
  if (!config_.journal || !queue_problem_.empty() || now_s - looked_s_ < kJournalPeriod_s) return;
  looked_s_ = now_s;
  const auto taken = tail_.Look(mark_);
  if (!taken) {
    if (journal_problem_.empty()) {
      Log({Event::kFleetJournal, fmt::format("probes are not published: {}", taken.error())});
    }
    journal_problem_ = taken.error();
    return;
  }
  journal_problem_.clear();
  mark_ = taken->mark;
  for (const ProbeRow& probe : taken->probes) {
    pending_.push_back({MessageKind::kProbe, *probe.unix_ms, ProbeBody(probe)});
  }
}

void FleetLoop::Keep() {
  const bool faulty = !queue_problem_.empty();
  if (faulty && MonotonicSeconds() - tried_s_ < kRetry_s) return;
  tried_s_ = MonotonicSeconds();
  const FleetQueue::Dropped before = queue_.dropped();
  const auto kept = queue_.Append(pending_, Memory(), faulty);
  if (!kept) return QueueFault(kept.error());
  const std::size_t late = std::exchange(pending_, {}).size();
  if (faulty) {
    // It works when it is written, emptied and read.
    if (const auto removed = queue_.Remove(arrived_); !removed) return QueueFault(removed.error());
    arrived_.clear();
    if (const auto next = queue_.Next(sent_, 1); !next) return QueueFault(next.error());
    Log({Event::kFleetQueueWorks,
         fmt::format("queue works again; {} messages are told late, {} were forgotten", late,
                     std::exchange(forgotten_, 0))});
    queue_problem_.clear();
  }
  if (queue_.dropped() == before || dropping_) return;
  dropping_ = true;
  Log({Event::kFleetDropping,
       fmt::format("queue is full ({:.0f} MB): the oldest states are dropped from now on, then "
                   "changes, alarms and probes last",
                   static_cast<double>(config_.queue_bytes) / kBytesPerMB)});
}

void FleetLoop::TakeConnection(std::int64_t connection) {
  connection_ = connection;
  sent_ = 0;
  on_the_way_ = 0;
  if (connection == 0) return;
  if (dropping_) {
    Log({Event::kFleetDropped,
         "dropped since the queue was made: " + DroppedText(queue_.dropped())});
    dropping_ = false;
  }
  if (queue_.dropped() != dropped_told_ && queue_.dropped() != FleetQueue::Dropped{}) {
    dropped_told_ = queue_.dropped();
    pending_.push_back({MessageKind::kLost, NowUtc_ms(), LostBody(dropped_told_)});
    Keep();
  }
  backlog_ = queue_.size();
  connected_s_ = MonotonicSeconds();
  Log({Event::kBrokerUp, fmt::format("broker {}:{} has the connection, {} messages wait",
                                     config_.host, config_.port, backlog_)});
  link_.Publish(connection, {{kBirthId, TopicOf(cell_, "NBIRTH"),
                              BirthText(cell_, queue_, connection, NowUtc_ms()), true}});
  ++on_the_way_;
}

void FleetLoop::Forward() {
  const BrokerLink::News news = link_.Take();
  std::copy_if(news.acknowledged.begin(), news.acknowledged.end(), std::back_inserter(arrived_),
               [](std::int64_t id) { return id > 0; });
  if (queue_problem_.empty()) {
    const auto removed = queue_.Remove(arrived_);
    if (removed) arrived_.clear();
    if (!removed) QueueFault(removed.error());
  }
  if (news.connection != connection_) {
    TakeConnection(news.connection);
  } else {
    on_the_way_ -= std::min(on_the_way_, news.acknowledged.size());
  }
  if (connection_ == 0) {
    if (!news.problem.empty() && news.problem != link_problem_ &&
        news.problem != "not connected yet") {
      link_problem_ = news.problem;
      Log({Event::kBrokerLost, fmt::format("broker {}:{}: {}; messages are kept meanwhile",
                                           config_.host, config_.port, news.problem)});
    }
    return;
  }
  link_problem_.clear();
  if (on_the_way_ < kMostOnTheWay) {
    const auto next = queue_.Next(sent_, kMostOnTheWay - on_the_way_);
    if (!next) QueueFault(next.error());
    if (next && !next->empty()) {
      std::vector<Outgoing> messages;
      for (const QueuedMessage& queued : *next) {
        messages.push_back({queued.seq, TopicOf(cell_, TopicTypeOf(queued.message.kind)),
                            MessageText(queue_.stream(), queued), false});
      }
      sent_ = next->back().seq;
      on_the_way_ += messages.size();
      link_.Publish(connection_, std::move(messages));
    }
  }
  TellQueue();
}

void FleetLoop::TellQueue() {
  if (backlog_ == 0 || on_the_way_ > 0) return;
  if (backlog_ > 1) {
    Log({Event::kFleetForwarded, fmt::format("{} messages forwarded in {:.1f} s", backlog_,
                                             MonotonicSeconds() - connected_s_)});
  }
  backlog_ = 0;
}

void FleetLoop::End(double patience_s) {
  if (connection_ == 0) return;
  link_.Publish(connection_, {{kDeathId, TopicOf(cell_, "NDEATH"),
                               DeathText(connection_, NowUtc_ms(), true), true}});
  const double until_s = MonotonicSeconds() + patience_s;
  while (MonotonicSeconds() < until_s) {
    const BrokerLink::News news = link_.Take();
    if (news.connection != connection_) return;  // the broker tells the will
    bool farewell = false;
    for (const std::int64_t id : news.acknowledged) {
      if (id > 0) arrived_.push_back(id);
      farewell = farewell || id == kDeathId;
    }
    if (queue_.Remove(arrived_)) arrived_.clear();
    if (farewell) return link_.Farewell(connection_);
    SleepSeconds(kHurry_s);
  }
}

std::string FleetLoop::Status() const {
  const std::string broker = connection_ != 0        ? "broker up"
                             : link_problem_.empty() ? "broker not there yet"
                                                     : "broker: " + link_problem_;
  return fmt::format("{}; {}; {} messages wait", broker,
                     feed_problem_.empty() ? "daemon up" : "no word of the daemon", queue_.size());
}

}  // namespace plumbline
