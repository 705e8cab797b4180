#include "app/plant/broker/subscriber.h"

#include <fmt/format.h>
#include <mosquitto.h>
#include <mqtt_protocol.h>
#include <poll.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "app/plant/broker/broker_account.h"

namespace plumbline::plant {
Subscriber::Subscriber() : client_(nullptr, &mosquitto_destroy) {}

Subscriber::~Subscriber() = default;

Result<std::unique_ptr<Subscriber>> Subscriber::Connect(const SubscriberSettings& settings) {
  OpenLibrary();
  std::unique_ptr<Subscriber> made(new Subscriber);
  made->client_.reset(mosquitto_new(settings.client_id.c_str(), false, made.get()));
  mosquitto* const client = made->client_.get();
  if (client == nullptr) return Error{std::strerror(errno)};
  made->topic_ = settings.topic;
  made->tls_ = !settings.account.tls_ca.empty();
  mosquitto_int_option(client, MOSQ_OPT_PROTOCOL_VERSION, MQTT_PROTOCOL_V5);
  mosquitto_int_option(client, MOSQ_OPT_RECEIVE_MAXIMUM, settings.receive_maximum);
  mosquitto_threaded_set(client, true);
  mosquitto_connect_v5_callback_set(
      client, [](mosquitto*, void* self, int code, int flags, const mosquitto_property*) {
        auto& subscriber = *static_cast<Subscriber*>(self);
        if (code != 0) {
          subscriber.refused_ = mosquitto_reason_string(code);
          return;
        }
        subscriber.connected_ = true;
        // With a callback, the library formats a line for each packet.
        mosquitto_log_callback_set(subscriber.client_.get(), nullptr);
        subscriber.session_kept_ = (flags & 1) != 0;
        mosquitto_subscribe(subscriber.client_.get(), nullptr, subscriber.topic_.c_str(), kQos);
      });
  mosquitto_subscribe_callback_set(
      client, [](mosquitto*, void* self, int, int count, const int* granted) {
        auto& subscriber = *static_cast<Subscriber*>(self);
        subscriber.subscribed_ = count == 1 && granted[0] == kQos;
        if (!subscriber.subscribed_) {
          subscriber.refused_ =
              "the broker does not allow this user to subscribe to " + subscriber.topic_;
        }
      });
  mosquitto_message_callback_set(
      client, [](mosquitto*, void* self, const mosquitto_message* message) {
        auto& subscriber = *static_cast<Subscriber*>(self);
        if (subscriber.target_ == nullptr) return;
        subscriber.bytes_ += static_cast<std::size_t>(message->payloadlen);
        subscriber.target_->push_back(
            {message->topic, std::string(static_cast<const char*>(message->payload),
                                         static_cast<std::size_t>(message->payloadlen))});
      });
  mosquitto_log_callback_set(client, [](mosquitto*, void* self, int level, const char* text) {
    if (level == MOSQ_LOG_ERR) static_cast<Subscriber*>(self)->last_error_ = text;
  });
  if (const auto used = UseAccount(client, settings.account); !used) return used.failure();
  mosquitto_property* properties = nullptr;
  constexpr std::uint32_t kNeverExpires = 0xFFFFFFFF;
  mosquitto_property_add_int32(&properties, MQTT_PROP_SESSION_EXPIRY_INTERVAL, kNeverExpires);
  const int code = mosquitto_connect_bind_v5(client, settings.host.c_str(), settings.port,
                                             kKeepAlive_s, nullptr, properties);
  mosquitto_property_free_all(&properties);
  if (code != MOSQ_ERR_SUCCESS) return Error{made->ErrorText(code)};
  return made;
}

Result<void> Subscriber::Read(int wait_ms, std::size_t most, std::vector<Received>& messages) {
  mosquitto* const client = client_.get();
  target_ = &messages;
  bytes_ = 0;
  int code = MOSQ_ERR_SUCCESS;
  while (code == MOSQ_ERR_SUCCESS && messages.size() < most) {
    const int socket = mosquitto_socket(client);
    if (socket < 0) {
      code = MOSQ_ERR_CONN_LOST;
      break;
    }
    const std::size_t before = messages.size();
    if (bytes_ > kMaxRead_bytes) break;
    code = mosquitto_loop_read(client, 1);
    // Most often the next message is there already.
    if (code != MOSQ_ERR_SUCCESS || messages.size() > before) continue;
    pollfd waiting{socket, POLLIN, 0};
    const int ready = poll(&waiting, 1, std::exchange(wait_ms, 0));
    if (ready <= 0) break;
  }
  target_ = nullptr;
  if (!refused_.empty()) return Error{refused_};
  if (code != MOSQ_ERR_SUCCESS) return Error{ErrorText(code)};
  return {};
}

Result<void> Subscriber::Acknowledge() {
  mosquitto* const client = client_.get();
  int code = mosquitto_loop_misc(client);
  // The TLS handshake is continued by the library's read function.
  while (code == MOSQ_ERR_SUCCESS && (connected_ || !tls_) && mosquitto_want_write(client)) {
    pollfd waiting{mosquitto_socket(client), POLLOUT, 0};
    if (poll(&waiting, 1, 1000 * kKeepAlive_s) == 0) return Error{"the broker takes no data"};
    code = mosquitto_loop_write(client, 1);
  }
  if (code == MOSQ_ERR_SUCCESS && tls_ && !connected_) code = mosquitto_loop_write(client, 1);
  if (code != MOSQ_ERR_SUCCESS) return Error{ErrorText(code)};
  return {};
}

int Subscriber::descriptor() const {
  return mosquitto_socket(client_.get());
}

std::string Subscriber::ErrorText(int code) const {
  return refused_.empty() ? ConnectionFailure(code, last_error_) : refused_;
}

}  // namespace plumbline::plant
