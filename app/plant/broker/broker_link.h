// MQTT broker connection, in a thread of its own, so that an unresponsive network or name server
// delays nothing else.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "app/base/config/mqtt_config.h"
#include "firmware-like/result.h"

namespace plumbline::plant {

/// A message to publish.
struct Outgoing {
  std::int64_t id = 0;  ///< returned when the broker has acknowledged the message
  std::string topic, payload;
  bool retained = false;
};

/// Connects and reconnects automatically, with growing pauses and a clean session each time: the
/// caller must publish unacknowledged messages again on the next connection. Publishes with QoS 1
/// in the given order. Subscribes to nothing, so that acknowledgements are all a broker may send:
/// at its first message, or at a packet for which there is no memory, the connection is closed, and
/// not tried again for kIntrusionPause_s.
class BrokerLink {
 public:
  static constexpr int kKeepAlive_s = 30;
  /// Time limit for the broker to accept the connection.
  static constexpr double kConnectTimeout_s = 10;
  static constexpr double kIntrusionPause_s = 60;

  struct LastWill {
    std::string topic;  ///< empty: no will
    /// Returns the payload for the connection with that number; called in the link's thread.
    std::function<std::string(std::int64_t number)> payload;
  };
  /// The password file is read for each connection, so that a new password needs no restart.
  BrokerLink(const config::MqttConfig& config, LastWill will);
  /// Returns within two seconds. Disconnects cleanly only after SuppressWill(), or if nothing was
  /// published; otherwise the broker publishes the will.
  ~BrokerLink();
  BrokerLink(const BrokerLink&) = delete;
  BrokerLink& operator=(const BrokerLink&) = delete;

  struct Status {
    /// Number of the connection: the UTC time of the attempt [ms]; 0 if not connected.
    std::int64_t connection = 0;
    std::vector<std::int64_t> acknowledged;  ///< since the last call
    std::string problem;                     ///< why there is no connection; empty while connected
    bool intruded = false;  ///< it was closed because the broker sent what it must not
  };
  Status TakeStatus();
  /// Discards the messages if `connection` is not the current one.
  void Publish(std::int64_t connection, std::vector<Outgoing> messages);
  /// Call when the broker has the final message of this connection, so that no will is needed.
  void SuppressWill(std::int64_t connection);
  /// Heartbeat of the link's thread; pauses during a name lookup.
  std::uint64_t beats() const;

 private:
  struct Shared;
  const std::shared_ptr<Shared> shared_;  ///< shared with the thread, which may outlive this object
};

/// Tries to connect and disconnects again, without publishing.
/// @return  why the broker refused, if it did
Result<void> TryBroker(const config::MqttConfig& config, double timeout_s);

}  // namespace plumbline::plant
