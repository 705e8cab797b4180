// Non-blocking MQTT connection, served by the poll loop of its owner.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "app/plant/sparkplug/sparkplug_config.h"
#include "firmware-like/result.h"

struct mosquitto;

namespace plumbline::plant {

/// One connection, from its first byte to its end. Only the lookup of a host name blocks, in
/// Begin(). A broker that accepts no bytes shows in writable(): what is published all the same is
/// buffered without limit, in the library.
class MqttClient {
 public:
  struct Options {
    std::string client_id;
    bool clean_session = true;
    std::string will_topic, will;  ///< QoS 1, not retained
  };
  struct Received {
    std::string topic, payload;
    bool retained = false;
  };

  explicit MqttClient(const BrokerSettings& broker);
  MqttClient(const MqttClient&) = delete;
  MqttClient& operator=(const MqttClient&) = delete;

  Result<void> Begin(const Options& options);
  int socket() const;    ///< -1: closed
  short events() const;  ///< of poll(2) to wait for
  /// Handles what poll(2) returned. @return  why the connection ended, if it did
  Result<void> Serve(short events);
  /// Keep-alive; to be called about once a second.
  Result<void> KeepAlive();

  /// The broker was reached, so that it may have received the CONNECT.
  bool reached() const { return reached_; }
  bool connected() const { return connack_ == 0; }
  bool subscribed() const { return subscribed_; }  ///< the broker has granted Subscribe()
  bool writable() const;

  Result<void> Subscribe(const std::vector<std::string>& filters);  ///< QoS 1
  Result<void> Publish(const std::string& topic, const std::string& payload, int qos);
  /// Disconnects cleanly, after what was published: the broker discards the will.
  void Disconnect();
  std::vector<Received> TakeReceived();

 private:
  std::string ErrorText(int code) const;

  const BrokerSettings& broker_;
  std::unique_ptr<mosquitto, void (*)(mosquitto*)> client_;
  int connack_ = -1;  ///< code of the broker's CONNACK; -1: not received yet
  bool reached_ = false, subscribed_ = false, refused_ = false;
  /// The library waits for a reply before it can write: polling for a writable socket would spin.
  bool stuck_ = false;
  std::string last_error_;
  std::vector<Received> received_;
};

}  // namespace plumbline::plant
