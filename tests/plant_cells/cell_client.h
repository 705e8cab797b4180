// Simulated cell of a plant: publishes by MQTT as plumbline-fleet does, from memory.
#pragma once

#include <mosquitto.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

namespace plumbline::plant_cells {

/// What a cell reports. Bodies are JSON objects, made when they are sent, so that a backlog of
/// hours takes little memory.
struct Item {
  std::int64_t utc_ms = 0;
  const char* type = "NDATA";  ///< third level of the topic
  std::int32_t index = 0;      ///< for the body
};
using BodyOf = std::function<std::string(const Item&)>;

struct BrokerAddress {
  std::string host = "127.0.0.1";
  int port = 1883;
};

/// Keeps every item until the broker has acknowledged it, and for `repeat_s` longer, because a
/// broker that is killed forgets what it has not saved; a new connection begins with a birth and
/// then repeats all that is kept, oldest first. Written apart from the product's publisher.
class CellClient {
 public:
  static constexpr std::size_t kMostInFlight = 100;
  CellClient(BrokerAddress broker, std::string line, std::string node, std::uint32_t stream,
             double repeat_s, BodyOf body);

  void Add(Item item);
  /// Sends and receives what is possible without waiting. @param utc_ms  the cell's clock
  void Work(double now_s, std::int64_t utc_ms);
  void Disconnect();

  std::int64_t last_seq() const { return first_ + static_cast<std::int64_t>(kept_.size()) - 1; }
  std::size_t unacknowledged() const { return unacknowledged_; }
  std::int64_t sent() const { return sent_count_; }
  int descriptor() const { return client_ ? mosquitto_socket(client_.get()) : -1; }
  bool wants_write() const { return client_ && mosquitto_want_write(client_.get()); }
  const std::string& line() const { return line_; }
  const std::string& node() const { return node_; }
  std::uint32_t stream() const { return stream_; }

 private:
  struct Kept {
    Item item;
    bool acknowledged = false;
    double acknowledged_s = 0;
  };
  void Connect(std::int64_t utc_ms);
  void Lost(double now_s);
  std::string TopicOf(const char* type) const;

  const BrokerAddress broker_;
  const std::string line_, node_;
  const std::uint32_t stream_;
  const double repeat_s_;
  const BodyOf body_;
  std::unique_ptr<mosquitto, void (*)(mosquitto*)> client_{nullptr, &mosquitto_destroy};
  bool connected_ = false;
  double next_s_ = 0, now_s_ = 0;
  std::int64_t birth_ = 0;
  std::deque<Kept> kept_;
  std::int64_t first_ = 1;                 ///< seq of kept_.front()
  std::int64_t next_seq_ = 1;              ///< to be sent next on this connection
  std::map<int, std::int64_t> in_flight_;  ///< message number of the library -> seq
  std::size_t unacknowledged_ = 0;
  std::int64_t sent_count_ = 0;
};

}  // namespace plumbline::plant_cells
