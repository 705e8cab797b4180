#include "app/plant/sparkplug/edge_node.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/base/service/utc_clock.h"

namespace plumbline::plant {
namespace {

constexpr int kNumbers = 256;  ///< bdSeq and seq count from 0 to 255
constexpr double kLeaveTimeout_s = 2;
constexpr int kDataQos = 0, kDeathQos = 1;

std::int64_t SparkplugNow_ms() {
  return std::llround(1e3 * service::SystemUtcSeconds());
}

}  // namespace

EdgeNode::EdgeNode(const SparkplugConfig& config, std::string group, std::string node)
    : config_(config), group_(std::move(group)), node_(std::move(node)) {}

std::string EdgeNode::Topic(const char* type) const {
  return fmt::format("spBv1.0/{}/{}/{}", group_, type, node_);
}

void EdgeNode::Connect(double now_s) {
  client_ = std::make_unique<MqttClient>(config_.hosts);
  asked_ = born_ = leaving_ = rebirth_ = false;
  until_s_ = now_s + kTimeout_s;
  const auto begun = client_->Begin({fmt::format("{}/{}/{}", config_.client_id, group_, node_),
                                     true, Topic("NDEATH"), NodeDeath(bdSeq_, SparkplugNow_ms())});
  if (!begun) Fail(begun.error(), now_s);
}

void EdgeNode::Fail(const std::string& problem, double now_s) {
  if (!leaving_) {
    problem_ = problem;
    back_off_.Failed(now_s, kRetry_s);
  }
  if (leaving_) back_off_.Failed(now_s, kLeavePause_s);
  failed_ = !leaving_;
  ApplyBacklog();
  if (client_->reached()) bdSeq_ = (bdSeq_ + 1) % kNumbers;
  client_.reset();
  born_ = leaving_ = false;
}

void EdgeNode::Serve(short events, double now_s) {
  const auto served = client_->Serve(events);
  const auto received = client_->TakeReceived();
  for (const MqttClient::Received& message : received) {
    if (client_ && !leaving_) Receive(message, now_s);
  }
  if (client_ && !served) return Fail(served.error(), now_s);
  if (!client_ || !client_->connected() || asked_) return;
  asked_ = true;
  std::vector<std::string> filters = {Topic("NCMD")};
  if (!config_.primary_host.empty()) filters.push_back("spBv1.0/STATE/" + config_.primary_host);
  if (const auto sent = client_->Subscribe(filters); !sent) Fail(sent.error(), now_s);
}

void EdgeNode::Receive(const MqttClient::Received& received, double now_s) {
  if (received.topic != Topic("NCMD")) {
    if (const auto state = HostStateFromText(received.payload)) ReceiveState(*state, now_s);
    return;
  }
  if (received.retained) return;  // meant for an earlier session
  const auto command = CommandFromPayload(received.payload);
  if (!command) {
    ignored_.push_back(command.error());
    return;
  }
  rebirth_ = rebirth_ || command->rebirth;
  ignored_.insert(ignored_.end(), command->ignored.begin(), command->ignored.end());
}

void EdgeNode::ReceiveState(const HostState& state, double now_s) {
  if (host_ && state.utc_ms < host_->utc_ms) return;  // of an earlier session of the host
  host_ = state;
  if (!state.online && born_) Leave(now_s);
}

MetricStore::Outcome EdgeNode::Apply(CellMessage message) {
  const bool waits = store_.online() && !born_ && !failed_;
  if (waits && message.seq > 0 && backlog_.size() < kMaxBacklog) {
    backlog_.push_back(std::move(message));
    return MetricStore::Outcome::kApplied;
  }
  ApplyBacklog();
  return store_.Apply(message);
}

void EdgeNode::ApplyBacklog() {
  for (const CellMessage& message : std::exchange(backlog_, {})) store_.Apply(message);
}

/// Each message as data of its own.
void EdgeNode::PublishBacklog(double now_s) {
  for (const CellMessage& message : std::exchange(backlog_, {})) {
    store_.Apply(message);
    if (client_ && client_->writable() && !NeedsBirth() && store_.has_changes()) PublishData(now_s);
  }
}

bool EdgeNode::NeedsBirth() const {
  return !born_ || rebirth_ || births_ != store_.births() || metrics_ != store_.size();
}

void EdgeNode::Update(bool wanted, double now_s) {
  if (!client_) return;
  if (leaving_) {
    if (client_->socket() < 0 || now_s > until_s_) Fail("", now_s);
    return;
  }
  if (client_->socket() < 0) return Fail("connection lost", now_s);
  if (!wanted || !store_.online()) return Leave(now_s);
  if (!client_->subscribed()) {
    if (now_s > until_s_) Fail("no answer", now_s);
    return;
  }
  back_off_.Well();
  failed_ = false;
  if (!config_.primary_host.empty() && !(host_ && host_->online)) return ApplyBacklog();
  if (!client_->writable()) return;
  if (NeedsBirth()) {
    if (!born_ || now_s - birth_s_ >= kBirthPause_s) PublishBirth(now_s);
  } else if (store_.has_changes()) {
    PublishData(now_s);
  }
}

void EdgeNode::PublishBirth(double now_s) {
  seq_ = 0;
  const auto sent = client_->Publish(Topic("NBIRTH"),
                                     NodeBirth(store_, bdSeq_, seq_, SparkplugNow_ms()), kDataQos);
  if (!sent) return Fail(sent.error(), now_s);
  store_.Published();
  born_ = true;
  rebirth_ = false;
  birth_s_ = now_s;
  births_ = store_.births();
  metrics_ = store_.size();
  PublishBacklog(now_s);
}

void EdgeNode::PublishData(double now_s) {
  tokens_ = std::min(kDataBurst, tokens_ + kData_per_s * (now_s - filled_s_));
  filled_s_ = now_s;
  if (tokens_ < 1) return;
  tokens_ -= 1;
  seq_ = (seq_ + 1) % kNumbers;
  const auto sent =
      client_->Publish(Topic("NDATA"), NodeData(store_, seq_, SparkplugNow_ms()), kDataQos);
  if (!sent) Fail(sent.error(), now_s);
}

void EdgeNode::KeepAlive(double now_s) {
  if (!client_ || client_->socket() < 0) return;
  if (const auto alive = client_->KeepAlive(); !alive) Fail(alive.error(), now_s);
}

void EdgeNode::Leave(double now_s) {
  if (!client_ || leaving_) return;
  leaving_ = true;
  born_ = false;
  until_s_ = now_s + kLeaveTimeout_s;
  if (!client_->connected()) return Fail("", now_s);
  const auto sent =
      client_->Publish(Topic("NDEATH"), NodeDeath(bdSeq_, SparkplugNow_ms()), kDeathQos);
  if (sent) client_->Disconnect();
  if (!sent || client_->socket() < 0) Fail("", now_s);
}

}  // namespace plumbline::plant
