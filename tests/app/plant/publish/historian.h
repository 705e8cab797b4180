// Plant historian: subscribes to everything and stores it.
#pragma once

#include <mosquitto.h>

#include <catch2/catch.hpp>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "app/base/text/json_text.h"
#include "tests/app/plant/broker/broker_process.h"

namespace plumbline::test {

struct Heard {
  std::string type;  ///< NBIRTH, NDATA, ..
  nlohmann::json json;
  bool retained = false;
};

class Historian {
 public:
  /// Keeps its session, so that it misses nothing while disconnected.
  Historian(int port, const std::string& filter, const std::string& name = "historian")
      : filter_(filter), client_(mosquitto_new(name.c_str(), false, this), &mosquitto_destroy) {
    mosquitto_connect_callback_set(client_.get(), [](mosquitto* client, void* self, int code) {
      auto* const own = static_cast<Historian*>(self);
      if (code == 0) mosquitto_subscribe(client, nullptr, own->filter_.c_str(), 1);
    });
    mosquitto_subscribe_callback_set(
        client_.get(), [](mosquitto*, void* self, int, int, const int*) {
          const std::lock_guard lock(static_cast<Historian*>(self)->mutex_);
          static_cast<Historian*>(self)->subscribed_ = true;
        });
    mosquitto_message_callback_set(client_.get(),
                                   [](mosquitto*, void* self, const mosquitto_message* message) {
                                     static_cast<Historian*>(self)->Take(*message);
                                   });
    mosquitto_reconnect_delay_set(client_.get(), 1, 1, false);
    REQUIRE(mosquitto_connect(client_.get(), "127.0.0.1", port, 30) == MOSQ_ERR_SUCCESS);
    mosquitto_loop_start(client_.get());
    REQUIRE(Soon([this] {
      const std::lock_guard lock(mutex_);
      return subscribed_;
    }));
  }
  ~Historian() {
    mosquitto_disconnect(client_.get());
    mosquitto_loop_stop(client_.get(), true);
  }
  Historian(const Historian&) = delete;
  Historian& operator=(const Historian&) = delete;

  std::vector<Heard> All() const {
    const std::lock_guard lock(mutex_);
    return heard_;
  }
  std::vector<Heard> Of(const std::string& type) const {
    std::vector<Heard> found;
    for (const Heard& one : All()) {
      if (one.type == type) found.push_back(one);
    }
    return found;
  }
  bool Awaits(const std::string& type, std::size_t count = 1) const {
    return Soon([&] { return Of(type).size() >= count; });
  }

 private:
  void Take(const mosquitto_message& message) {
    const std::string topic = message.topic;
    const auto node = topic.rfind('/'), type = topic.rfind('/', node - 1);
    const std::string text(static_cast<const char*>(message.payload),
                           static_cast<std::size_t>(message.payloadlen));
    const std::lock_guard lock(mutex_);
    heard_.push_back(
        {topic.substr(type + 1, node - type - 1), text::JsonOrNull(text), message.retain});
  }

  const std::string filter_;
  mutable std::mutex mutex_;
  bool subscribed_ = false;
  std::vector<Heard> heard_;
  std::unique_ptr<mosquitto, void (*)(mosquitto*)> client_;
};

}  // namespace plumbline::test
