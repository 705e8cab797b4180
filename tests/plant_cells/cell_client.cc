#include "tests/plant_cells/cell_client.h"

#include <fmt/format.h>

#include <algorithm>

namespace plumbline::plant_cells {
namespace {

constexpr double kRetry_s = 0.5;

std::string DeathOf(std::int64_t number, bool clean) {
  return fmt::format(R"({{"timestamp":{},"bdSeq":{},"clean_shutdown":{}}})", number, number, clean);
}

}  // namespace

CellClient::CellClient(BrokerAddress broker, std::string line, std::string node,
                       std::uint32_t stream, double repeat_s, BodyOf body)
    : broker_(std::move(broker)),
      line_(std::move(line)),
      node_(std::move(node)),
      stream_(stream),
      repeat_s_(repeat_s),
      body_(std::move(body)) {}

std::string CellClient::TopicOf(const char* type) const {
  return fmt::format("plumblineV1/{}/{}/{}", line_, type, node_);
}

void CellClient::Add(Item item) {
  kept_.push_back({item, false, 0});
  ++unacknowledged_;
}

void CellClient::Connect(std::int64_t utc_ms) {
  client_.reset(mosquitto_new((line_ + "-" + node_).c_str(), true, this));
  connected_ = false;
  in_flight_.clear();
  mosquitto_connect_callback_set(client_.get(), [](mosquitto*, void* self, int code) {
    static_cast<CellClient*>(self)->connected_ = code == 0;
  });
  mosquitto_publish_callback_set(client_.get(), [](mosquitto*, void* self, int number) {
    auto& cell = *static_cast<CellClient*>(self);
    const auto found = cell.in_flight_.find(number);
    if (found == cell.in_flight_.end()) return;
    const auto at = static_cast<std::size_t>(found->second - cell.first_);
    cell.in_flight_.erase(found);
    Kept& kept = cell.kept_[at];
    if (!kept.acknowledged) --cell.unacknowledged_;
    kept.acknowledged = true;
    kept.acknowledged_s = cell.now_s_;
  });
  mosquitto_max_inflight_messages_set(client_.get(), 0);
  birth_ = std::max(utc_ms, birth_ + 1);
  const std::string death = DeathOf(birth_, false);
  mosquitto_will_set(client_.get(), TopicOf("NDEATH").c_str(), static_cast<int>(death.size()),
                     death.data(), 1, true);
  next_seq_ = first_;
  if (mosquitto_connect(client_.get(), broker_.host.c_str(), broker_.port, 60) == 0) {
    const std::string birth = fmt::format(
        R"({{"timestamp":{},"bdSeq":{},"schema":1,"version":"simulated","cell":"{}","stream":"{:08x}",)"
        R"("waiting":{},"dropped":{{"states":0,"changes":0,"others":0}}}})",
        utc_ms, birth_, node_, stream_, unacknowledged_);
    mosquitto_publish(client_.get(), nullptr, TopicOf("NBIRTH").c_str(),
                      static_cast<int>(birth.size()), birth.data(), 1, true);
  }
}

void CellClient::Lost(double now_s) {
  client_.reset();
  connected_ = false;
  next_s_ = now_s + kRetry_s;
}

void CellClient::Work(double now_s, std::int64_t utc_ms) {
  now_s_ = now_s;
  if (!client_) {
    if (now_s < next_s_) return;
    Connect(utc_ms);
    if (mosquitto_socket(client_.get()) < 0) return Lost(now_s);
  }
  mosquitto* const client = client_.get();
  int code = mosquitto_loop(client, 0, 1);
  while (code == MOSQ_ERR_SUCCESS && connected_ && in_flight_.size() < kMostInFlight &&
         next_seq_ <= last_seq()) {
    const Kept& kept = kept_[static_cast<std::size_t>(next_seq_ - first_)];
    const std::string body = body_(kept.item);
    const std::string payload =
        fmt::format("{{\"stream\":\"{:08x}\",\"seq\":{},\"timestamp\":{}{}{}", stream_, next_seq_,
                    kept.item.utc_ms, body.size() > 2 ? "," : "", body.substr(1));
    int number = 0;
    code = mosquitto_publish(client, &number, TopicOf(kept.item.type).c_str(),
                             static_cast<int>(payload.size()), payload.data(), 1, false);
    in_flight_[number] = next_seq_++;
    ++sent_count_;
  }
  if (code != MOSQ_ERR_SUCCESS) return Lost(now_s);
  while (
      !kept_.empty() && kept_.front().acknowledged && first_ < next_seq_ &&
      now_s - kept_.front().acknowledged_s > repeat_s_ &&
      std::ranges::none_of(in_flight_, [this](const auto& one) { return one.second == first_; })) {
    kept_.pop_front();
    ++first_;
  }
}

void CellClient::Disconnect() {
  if (!client_ || !connected_) return;
  const std::string death = DeathOf(birth_, true);
  mosquitto_publish(client_.get(), nullptr, TopicOf("NDEATH").c_str(),
                    static_cast<int>(death.size()), death.data(), 1, true);
  for (int k = 0; k < 20; ++k) mosquitto_loop(client_.get(), 5, 1);
  mosquitto_disconnect(client_.get());
}

}  // namespace plumbline::plant_cells
