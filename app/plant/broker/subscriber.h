// MQTT subscription whose messages are acknowledged only when their receiver says so.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "app/plant/broker/broker_account.h"
#include "firmware-like/result.h"

namespace plumbline::plant {

struct SubscriberSettings {
  std::string host;
  int port = 1883;
  BrokerAccount account;
  std::string client_id;  ///< the broker keeps its messages under this name
  std::string topic;      ///< filter, also of a shared subscription
  /// Messages that the broker sends before the first is acknowledged.
  int receive_maximum = 60'000;
};

/// A received message.
struct Received {
  std::string topic, payload;
};

/// One connection by MQTT 5 with a session that the broker keeps, and QoS 1. Single thread, no
/// reconnection: after an error, destroy it and create another; the broker then repeats what was
/// not acknowledged.
///
/// libmosquitto queues the acknowledgement of a message as it reads it. It writes its queue by
/// itself only if it believes to be used by one thread; told that a program's own threads use it,
/// it leaves writing to mosquitto_loop_write(), which only Acknowledge() calls.
class Subscriber {
 public:
  static constexpr int kKeepAlive_s = 30;
  /// Read() returns after so many bytes, whatever the number of messages.
  static constexpr std::size_t kMaxRead_bytes = 32'000'000;
  /// Connects, with the name lookup and TCP connection before it returns.
  static Result<std::unique_ptr<Subscriber>> Connect(const SubscriberSettings& settings);
  /// Closes the connection without a farewell, so that nothing unacknowledged is forgotten.
  ~Subscriber();
  Subscriber(const Subscriber&) = delete;
  Subscriber& operator=(const Subscriber&) = delete;

  /// Waits up to `wait_ms` for messages and appends those that have arrived, up to `most`.
  /// @return  or why the connection has ended
  Result<void> Read(int wait_ms, std::size_t most, std::vector<Received>& messages);
  /// Writes the acknowledgements of all messages that Read() returned, requests and pings. Call it
  /// at least every kKeepAlive_s, also without messages.
  Result<void> Acknowledge();

  bool subscribed() const { return subscribed_; }
  /// Whether the broker had kept the session. If not, messages published before this connection
  /// were not kept.
  bool session_kept() const { return session_kept_; }
  int descriptor() const;

 private:
  Subscriber();
  std::string ErrorText(int code) const;

  std::unique_ptr<mosquitto, void (*)(mosquitto*)> client_;
  std::string topic_, last_error_, refused_;
  bool tls_ = false, connected_ = false, subscribed_ = false, session_kept_ = false;
  std::vector<Received>* target_ = nullptr;  ///< while the library reads
  std::size_t bytes_ = 0;                    ///< of this Read()
};

}  // namespace plumbline::plant
