// Sparkplug edge node of one cell: its metrics and its session with the broker of the hosts.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "app/plant/sparkplug/metric_store.h"
#include "app/plant/sparkplug/mqtt_client.h"
#include "app/plant/sparkplug/payload.h"
#include "drivers/back_off.h"

namespace plumbline::plant {

/// Connects while the cell is online, with NDEATH as will; publishes NBIRTH, then NDATA for what
/// changes; publishes NDEATH and disconnects when the cell goes. While the broker accepts nothing,
/// or more than kData_per_s messages, changes are merged: the newest values are published. Messages
/// that arrive before the birth wait for it, at most kMaxBacklog, unless the broker is away.
class EdgeNode {
 public:
  static constexpr double kTimeout_s = 10;  ///< of a connection
  /// Between DISCONNECT and the next CONNECT: a broker that has not read the first publishes the
  /// will as well.
  static constexpr double kLeavePause_s = 0.5;
  static constexpr std::size_t kMaxBacklog = 50;
  static constexpr double kRetry_s = 2;       ///< between two attempts
  static constexpr double kBirthPause_s = 1;  ///< between two births of one connection
  static constexpr double kData_per_s = 200, kDataBurst = 1000;

  EdgeNode(const SparkplugConfig& config, std::string group, std::string node);

  const std::string& node() const { return node_; }
  const std::string& group() const { return group_; }
  const MetricStore& store() const { return store_; }
  void Restore(MetricStore::Kept kept) { store_.Restore(std::move(kept)); }

  bool idle() const { return client_ == nullptr; }
  bool connecting() const { return client_ != nullptr && !client_->subscribed() && !leaving_; }
  bool born() const { return born_; }
  int socket() const { return client_ ? client_->socket() : -1; }
  short events() const { return client_->events(); }
  bool WantsToConnect(double now_s) const { return idle() && back_off_.Due(now_s); }

  void Connect(double now_s);
  MetricStore::Outcome Apply(CellMessage message);
  /// Handles what poll(2) returned.
  void Serve(short events, double now_s);
  /// Publishes what is due. @param wanted  the cell is online, as far as is known
  void Update(bool wanted, double now_s);
  void KeepAlive(double now_s);
  /// Publishes NDEATH and disconnects.
  void Leave(double now_s);

  /// Why the last connection failed, once.
  std::string TakeProblem() { return std::exchange(problem_, {}); }
  /// Names of metrics that a host tried to write, once.
  std::vector<std::string> TakeIgnored() { return std::exchange(ignored_, {}); }

 private:
  std::string Topic(const char* type) const;
  void Fail(const std::string& problem, double now_s);
  void Receive(const MqttClient::Received& received, double now_s);
  void ReceiveState(const HostState& state, double now_s);
  bool NeedsBirth() const;
  void ApplyBacklog();
  void PublishBacklog(double now_s);
  void PublishBirth(double now_s);
  void PublishData(double now_s);

  const SparkplugConfig& config_;
  const std::string group_, node_;
  MetricStore store_;
  std::unique_ptr<MqttClient> client_;
  BackOff back_off_;
  bool asked_ = false;   ///< has subscribed
  bool failed_ = false;  ///< the last connection; messages do not wait for the next
  bool born_ = false, leaving_ = false, rebirth_ = false;
  double until_s_ = 0;          ///< time limit of what is awaited
  double birth_s_ = -1e300;     ///< of the last birth
  double filled_s_ = -1e300;    ///< when `tokens_` was brought up to date
  double tokens_ = kDataBurst;  ///< NDATA messages that may be published at once
  int bdSeq_ = 0, seq_ = 0;
  std::uint64_t births_ = 0;  ///< of the store, as published
  std::size_t metrics_ = 0;   ///< of the store, as published
  std::optional<HostState> host_;
  std::vector<CellMessage> backlog_;
  std::string problem_;
  std::vector<std::string> ignored_;
};

}  // namespace plumbline::plant
