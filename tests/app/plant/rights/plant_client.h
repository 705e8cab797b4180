// MQTT client that may do anything, to test what a broker allows.
#pragma once

#include <mosquitto.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "tests/app/plant/broker/broker_process.h"

namespace plumbline::test {

class PlantClient {
  // Before their uses, which deduce the type.
  template <typename Change>
  void Note(Change change) {
    const std::lock_guard lock(mutex_);
    change(*this);
  }
  template <typename Value>
  auto Read(Value value) const {
    const std::lock_guard lock(mutex_);
    return value();
  }

 public:
  struct Options {
    int port = 0;
    std::string client_id, user, password;
    std::string ca;  ///< empty: without TLS
    std::string will_topic{};
    bool persistent = false;
  };

  /// Tries to connect once.
  explicit PlantClient(const Options& options) {
    static const int opened = mosquitto_lib_init();
    static_cast<void>(opened);
    client_.reset(mosquitto_new(options.client_id.c_str(), !options.persistent, this));
    mosquitto* const client = client_.get();
    mosquitto_connect_callback_set(client, [](mosquitto*, void* self, int code) {
      static_cast<PlantClient*>(self)->Note([code](PlantClient& own) {
        own.answered_ = true;
        own.connected_ = code == 0;
      });
    });
    mosquitto_disconnect_callback_set(client, [](mosquitto* of, void* self, int) {
      static_cast<PlantClient*>(self)->Note([](PlantClient& own) {
        own.answered_ = true;
        own.connected_ = false;
      });
      mosquitto_disconnect(of);  // no second attempt
    });
    mosquitto_publish_callback_set(client, [](mosquitto*, void* self, int) {
      static_cast<PlantClient*>(self)->Note([](PlantClient& own) { ++own.acknowledged_; });
    });
    mosquitto_subscribe_callback_set(
        client, [](mosquitto*, void* self, int, int, const int* granted) {
          static_cast<PlantClient*>(self)->Note(
              [granted](PlantClient& own) { own.granted_ = *granted; });
        });
    mosquitto_message_callback_set(
        client, [](mosquitto*, void* self, const mosquitto_message* message) {
          static_cast<PlantClient*>(self)->Note([message](PlantClient& own) {
            own.heard_.push_back(
                {message->topic, std::string(static_cast<char*>(message->payload),
                                             static_cast<std::size_t>(message->payloadlen))});
          });
        });
    if (!options.ca.empty()) {
      mosquitto_tls_set(client, options.ca.c_str(), nullptr, nullptr, nullptr, nullptr);
    }
    if (!options.user.empty()) {
      mosquitto_username_pw_set(client, options.user.c_str(), options.password.c_str());
    }
    if (!options.will_topic.empty()) {
      mosquitto_will_set(client, options.will_topic.c_str(), 4, "will", 1, true);
    }
    if (mosquitto_connect(client, "127.0.0.1", options.port, 30) != MOSQ_ERR_SUCCESS) return;
    mosquitto_loop_start(client);
    REQUIRE(Soon([this] { return Read([this] { return answered_; }); }));
  }
  ~PlantClient() {
    mosquitto_disconnect(client_.get());
    mosquitto_loop_stop(client_.get(), true);
  }
  PlantClient(const PlantClient&) = delete;
  PlantClient& operator=(const PlantClient&) = delete;

  bool Connected() const {
    return Read([this] { return connected_; });
  }
  bool Publish(const std::string& topic, const std::string& payload) const {
    return mosquitto_publish(client_.get(), nullptr, topic.c_str(),
                             static_cast<int>(payload.size()), payload.data(), 1,
                             false) == MOSQ_ERR_SUCCESS;
  }
  std::size_t Acknowledged() const {
    return Read([this] { return acknowledged_; });
  }
  /// @return  whether the broker granted it
  bool Subscribe(const std::string& filter) {
    Note([](PlantClient& own) { own.granted_ = -1; });
    REQUIRE(mosquitto_subscribe(client_.get(), nullptr, filter.c_str(), 1) == MOSQ_ERR_SUCCESS);
    REQUIRE(Soon([this] { return Read([this] { return granted_; }) >= 0; }));
    return Read([this] { return granted_; }) <= 2;
  }
  /// Messages received; of this topic and with this payload, where given.
  std::size_t Count(const std::string& topic = "", const std::string& payload = "") const {
    return Read([&] {
      return static_cast<std::size_t>(
          std::count_if(heard_.begin(), heard_.end(), [&](const Message& one) {
            return (topic.empty() || one.topic == topic) &&
                   (payload.empty() || one.payload == payload);
          }));
    });
  }
  bool Hears(const std::string& topic) const {
    return Soon([&] { return Count(topic) > 0; });
  }
  std::size_t Longest() const {
    return Read([this] {
      std::size_t longest = 0;
      for (const Message& one : heard_) longest = std::max(longest, one.payload.size());
      return longest;
    });
  }

 private:
  struct Message {
    std::string topic, payload;
  };
  mutable std::mutex mutex_;
  bool answered_ = false, connected_ = false;
  std::size_t acknowledged_ = 0;
  int granted_ = -1;
  std::vector<Message> heard_;
  std::unique_ptr<mosquitto, void (*)(mosquitto*)> client_{nullptr, &mosquitto_destroy};
};

}  // namespace plumbline::test
