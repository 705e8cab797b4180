#include "app/plant/sparkplug/bridge.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <unistd.h>

#include <vector>

#include "app/base/log/log.h"
#include "drivers/clock.h"
#include "drivers/files/replace_file.h"
#include "drivers/files/text_file.h"

namespace plumbline::plant {
namespace {

constexpr int kWait_ms = 200;
constexpr double kKeepAlivePeriod_s = 1, kEndTimeout_s = 2;
/// After a lookup of a host name that took this long, no node connects for a while.
constexpr double kSlowLookup_s = 1, kLookupPause_s = 10;
constexpr std::size_t kMaxNameInLog = 80;
constexpr double kWritePeriod_s = 300;
constexpr files::SizeLimit kPointsFileSize{32'000'000, "a file of points", "Delete it"};

/// Deaths come first: a cell whose retained birth arrives is then known to be online or not.
std::vector<std::string> SourceFilters() {
  std::vector<std::string> filters = {"plumblineV1/+/NDEATH/+"};
  for (const char* type : kCellTopics) {
    if (std::string(type) != "NDEATH") filters.push_back(fmt::format("plumblineV1/+/{}/+", type));
  }
  return filters;
}

std::string AddressText(const BrokerSettings& broker) {
  return fmt::format("{}:{}", broker.host, broker.port);
}

}  // namespace

Bridge::Bridge(SparkplugConfig config, std::string points_file)
    : config_(std::move(config)),
      points_file_(std::move(points_file)),
      written_s_(MonotonicSeconds()) {
  if (!points_file_.empty()) ReadPoints();
}

void Bridge::ReadPoints() {
  if (access(points_file_.c_str(), F_OK) != 0) return;  // the first run
  const auto text = files::ReadFileUpTo(kPointsFileSize, points_file_);
  auto read = text ? KeptPointsFromText(*text) : Result<KeptPoints>(text.failure());
  if (read) {
    kept_ = std::move(read).value();
  } else {
    log::Log({log::Event::kSparkplugPoints,
              fmt::format("{}: {}; points are unknown until the cells report them", points_file_,
                          read.error())});
  }
}

void Bridge::WritePoints() {
  KeptPoints points = kept_;
  for (const auto& [name, node] : nodes_) points[name] = node->store().ToKeep();
  written_s_ = MonotonicSeconds();
  const auto written = files::ReplaceFileDurably(points_file_, TextOfKeptPoints(points));
  if (!written) {
    log::Log({log::Event::kSparkplugPoints,
              fmt::format("points are not kept across a restart: {}", written.error())});
  }
}

bool Bridge::SourceKnown(double now_s) const {
  return (source_ && source_->subscribed()) || now_s - source_seen_s_ < kSourceGrace_s;
}

void Bridge::ConnectSource(double now_s) {
  source_ = std::make_unique<MqttClient>(config_.cells);
  source_asked_ = false;
  source_until_s_ = now_s + EdgeNode::kTimeout_s;
  // The broker keeps messages for this session while the bridge is away.
  if (const auto begun = source_->Begin({config_.client_id, false, "", ""}); !begun)
    LoseSource(begun.error(), now_s);
}

void Bridge::LoseSource(const std::string& problem, double now_s) {
  source_.reset();
  source_back_off_.Failed(now_s);
  source_logged_ = false;
  if (problem == source_problem_) return;
  source_problem_ = problem;
  log::Log({log::Event::kSparkplugCellsLost,
            fmt::format("cells' broker {}: {}; after {:.0f} s all edge nodes are reported dead",
                        AddressText(config_.cells), problem, kSourceGrace_s)});
}

void Bridge::ServeSource(short events, double now_s) {
  const auto served = source_->Serve(events);
  for (const MqttClient::Received& received : source_->TakeReceived()) Receive(received, now_s);
  if (!served) return LoseSource(served.error(), now_s);
  if (source_->connected() && !source_asked_) {
    source_asked_ = true;
    if (const auto asked = source_->Subscribe(SourceFilters()); !asked)
      return LoseSource(asked.error(), now_s);
  }
  if (!source_->subscribed()) return;
  source_seen_s_ = now_s;
  source_back_off_.Well();
  source_problem_.clear();
  if (std::exchange(source_logged_, true)) return;
  log::Log({log::Event::kSparkplugCellsUp,
            fmt::format("cells' broker {} connected", AddressText(config_.cells))});
}

EdgeNode* Bridge::NodeOf(const CellAddress& address) {
  const auto found = nodes_.find({address.group, address.node});
  if (found != nodes_.end()) return found->second.get();
  std::size_t metrics = 0;
  for (const auto& [name, node] : nodes_) metrics += node->store().size();
  if (nodes_.size() < static_cast<std::size_t>(config_.max_nodes) && metrics < kMaxMetrics) {
    auto& node = nodes_[{address.group, address.node}];
    node = std::make_unique<EdgeNode>(config_, address.group, address.node);
    const auto kept = kept_.find({address.group, address.node});
    if (kept != kept_.end()) {
      node->Restore(std::move(kept->second));
      kept_.erase(kept);
    }
    return node.get();
  }
  log::Log({log::Event::kSparkplugTooMany,
            fmt::format("cell {}/{} has no edge node: there are {} nodes with {} metrics",
                        address.group.substr(0, kMaxNameInLog),
                        address.node.substr(0, kMaxNameInLog), nodes_.size(), metrics)});
  return nullptr;
}

void Bridge::Receive(const MqttClient::Received& received, double now_s) {
  const auto address = CellAddressFromTopic(received.topic);
  if (!address) return;
  auto message = CellMessageFromText(address->topic, received.payload);
  if (!message) {
    ++unreadable_;
    log::Log({log::Event::kSparkplugUnreadable,
              fmt::format("message {} not understood: {}", received.topic.substr(0, 200),
                          message.error())});
    return;
  }
  EdgeNode* const node = NodeOf(*address);
  if (node == nullptr) return;
  const std::int64_t seq = message->seq;
  if (node->Apply(std::move(message).value()) == MetricStore::Outcome::kMissed) {
    log::Log({log::Event::kSparkplugMissed,
              fmt::format("cell {}/{}: messages before number {} are missing; its points count as "
                          "stale until they are reported again",
                          node->group(), node->node(), seq)});
  }
  if (SourceKnown(now_s)) Connect(*node, now_s);
  node->Update(SourceKnown(now_s), now_s);
}

void Bridge::LogNode(EdgeNode& node) {
  const std::string problem = node.TakeProblem();
  if (!problem.empty() && problem != hosts_problem_) {
    hosts_problem_ = problem;
    log::Log({log::Event::kSparkplugHostsLost,
              fmt::format("Sparkplug broker {}: {} (edge node {}/{})", AddressText(config_.hosts),
                          problem, node.group(), node.node())});
  }
  if (const auto ignored = node.TakeIgnored(); !ignored.empty()) {
    log::Log(
        {log::Event::kSparkplugCommand, fmt::format("command to {}/{} ignored: {}", node.group(),
                                                    node.node(), fmt::join(ignored, ", "))});
  }
}

void Bridge::UpdateNodes(double now_s) {
  const bool known = SourceKnown(now_s);
  const bool keep_alive = now_s - kept_alive_s_ >= kKeepAlivePeriod_s;
  if (keep_alive) kept_alive_s_ = now_s;
  connecting_ = 0;
  online_ = born_ = 0;
  for (const auto& [name, node] : nodes_) {
    if (keep_alive) node->KeepAlive(now_s);
    node->Update(known, now_s);
    if (node->connecting()) ++connecting_;
    if (node->store().online()) ++online_;
    if (node->born()) ++born_;
    LogNode(*node);
  }
  for (const auto& [name, node] : nodes_) {
    if (known) Connect(*node, now_s);
  }
  if (keep_alive && source_) {
    const auto alive = source_->KeepAlive();
    if (!alive) LoseSource(alive.error(), now_s);
  }
  LogHosts();
}

void Bridge::LogHosts() {
  if (hosts_problem_.empty() || born_ < online_ || online_ == 0) return;
  hosts_problem_.clear();
  log::Log({log::Event::kSparkplugHostsUp,
            fmt::format("Sparkplug broker {}: all {} edge nodes are connected again",
                        AddressText(config_.hosts), born_)});
}

void Bridge::Connect(EdgeNode& node, double now_s) {
  if (connecting_ >= kMaxConnecting || now_s < connect_s_) return;
  if (!node.store().online() || !node.WantsToConnect(now_s)) return;
  node.Connect(now_s);
  if (node.connecting()) ++connecting_;
  const double after_s = MonotonicSeconds();
  if (after_s - now_s > kSlowLookup_s) connect_s_ = after_s + kLookupPause_s;
}

void Bridge::RunOnce(int wake) {
  double now_s = MonotonicSeconds();
  if (!source_ && source_back_off_.Due(now_s)) ConnectSource(now_s);
  std::vector<pollfd> waiting = {{wake, POLLIN, 0}, {source_ ? source_->socket() : -1, 0, 0}};
  if (source_) waiting[1].events = source_->events();
  std::vector<EdgeNode*> nodes;
  for (const auto& [name, node] : nodes_) {
    if (node->socket() < 0) continue;
    waiting.push_back({node->socket(), node->events(), 0});
    nodes.push_back(node.get());
  }
  poll(waiting.data(), waiting.size(), kWait_ms);
  now_s = MonotonicSeconds();
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    if (waiting[k + 2].revents != 0 && nodes[k]->socket() == waiting[k + 2].fd)
      nodes[k]->Serve(waiting[k + 2].revents, now_s);
  }
  if (source_ && waiting[1].revents != 0) {
    ServeSource(waiting[1].revents, now_s);
  } else if (source_ && !source_->subscribed() && now_s > source_until_s_) {
    LoseSource("no answer", now_s);
  }
  if (source_ && source_->subscribed()) source_seen_s_ = now_s;
  UpdateNodes(now_s);
  if (!points_file_.empty() && now_s - written_s_ > kWritePeriod_s) WritePoints();
}

void Bridge::End() {
  source_.reset();  // from here on the broker keeps the cells' messages
  const double until_s = MonotonicSeconds() + kEndTimeout_s;
  for (const auto& [name, node] : nodes_) node->Leave(MonotonicSeconds());
  for (bool left = false; !left && MonotonicSeconds() < until_s;) {
    left = true;
    std::vector<pollfd> waiting;
    for (const auto& [name, node] : nodes_) {
      if (node->socket() < 0) continue;
      left = false;
      waiting.push_back({node->socket(), node->events(), 0});
    }
    poll(waiting.data(), waiting.size(), kWait_ms);
    for (const pollfd& one : waiting) {
      for (const auto& [name, node] : nodes_) {
        if (one.revents != 0 && node->socket() == one.fd)
          node->Serve(one.revents, MonotonicSeconds());
      }
    }
  }
  if (!points_file_.empty()) WritePoints();
}

std::string Bridge::Status() const {
  const std::string cells = source_ && source_->subscribed() ? "cells' broker connected"
                            : source_problem_.empty()        ? "cells' broker not connected yet"
                                                             : "cells' broker: " + source_problem_;
  return fmt::format(
      "{}; {} cells, {} online, {} born{}{}", cells, nodes_.size(), online_, born_,
      hosts_problem_.empty() ? "" : "; Sparkplug broker: " + hosts_problem_,
      unreadable_ == 0 ? "" : fmt::format("; {} messages not understood", unreadable_));
}

}  // namespace plumbline::plant
