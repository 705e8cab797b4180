// The connection to the broker, in a thread of its own: a name server or a network that does not
// answer delays nobody else.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "app/config/mqtt_config.h"
#include "firmware-like/result.h"

namespace plumbline {

/// A message on its way; `id` is what its acknowledgement is told by.
struct Outgoing {
  std::int64_t id = 0;
  std::string topic, payload;
  bool retained = false;
};

/// Connects by itself, again after a pause that grows, each time anew: what was not acknowledged on
/// one connection is to be given again on the next. Publishes with QoS 1 in the order given.
/// Subscribes to nothing, so that a broker can say nothing but that it has got a message.
class BrokerLink {
 public:
  static constexpr int kKeepAlive_s = 30;
  /// A broker that does not answer the connection for so long.
  static constexpr double kConnectPatience_s = 10;

  struct LastWill {
    std::string topic;
    /// Of the connection of that number; made in the link's thread.
    std::function<std::string(std::int64_t number)> payload;
  };
  /// The password file is read at each connection, so that a new one needs no restart.
  /// @param will  without a topic: none
  BrokerLink(const MqttConfig& config, LastWill will);
  /// Ends within two seconds. Says goodbye only after Farewell(), or where it has published
  /// nothing: in every other case the broker tells the will.
  ~BrokerLink();
  BrokerLink(const BrokerLink&) = delete;
  BrokerLink& operator=(const BrokerLink&) = delete;

  struct News {
    std::int64_t connection = 0;  ///< its number, the moment it was tried, UTC [ms]; 0: none
    std::vector<std::int64_t> acknowledged;  ///< since the last call
    std::string problem;                     ///< why there is no connection; empty: there is
  };
  News Take();
  /// What was given for another connection than the present one is thrown away.
  void Publish(std::int64_t connection, std::vector<Outgoing> messages);
  /// What is to be told at the end of this connection is with the broker: no will is needed.
  void Farewell(std::int64_t connection);
  /// Raised by the thread each time it comes round; while a name is looked up it does not.
  std::uint64_t beats() const;

 private:
  struct Shared;
  const std::shared_ptr<Shared> shared_;  ///< the thread's too, which may outlive this
};

/// Whether the broker lets a client in that does nothing. @return  or why not
Result<void> TryBroker(const MqttConfig& config, double patience_s);

}  // namespace plumbline
