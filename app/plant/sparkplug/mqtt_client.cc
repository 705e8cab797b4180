#include "app/plant/sparkplug/mqtt_client.h"

#include <fmt/format.h>
#include <poll.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "app/plant/broker/broker_account.h"

namespace plumbline::plant {
namespace {

constexpr int kKeepAlive_s = 30, kSubscribeQos = 1, kWillQos = 1;
/// A broker that has more packets for this client is asked for the next one at once, so often.
constexpr int kMaxPackets = 100;

bool IsReadable(int socket) {
  pollfd waiting{socket, POLLIN, 0};
  return poll(&waiting, 1, 0) > 0;
}

}  // namespace

MqttClient::MqttClient(const BrokerSettings& broker)
    : broker_(broker), client_(nullptr, &mosquitto_destroy) {
  OpenLibrary();
}

Result<void> MqttClient::Begin(const Options& options) {
  client_.reset(mosquitto_new(options.client_id.c_str(), options.clean_session, this));
  mosquitto* const client = client_.get();
  if (client == nullptr) return Error{std::strerror(errno)};
  mosquitto_connect_callback_set(client, [](mosquitto*, void* self, int code) {
    static_cast<MqttClient*>(self)->connack_ = code;
  });
  mosquitto_subscribe_callback_set(client,
                                   [](mosquitto*, void* self, int, int count, const int* granted) {
                                     auto* const own = static_cast<MqttClient*>(self);
                                     own->subscribed_ = true;
                                     for (int k = 0; k < count; ++k)
                                       own->refused_ = own->refused_ || granted[k] > 2;
                                   });
  mosquitto_message_callback_set(client,
                                 [](mosquitto*, void* self, const mosquitto_message* message) {
                                   static_cast<MqttClient*>(self)->received_.push_back(
                                       {message->topic,
                                        std::string(static_cast<const char*>(message->payload),
                                                    static_cast<std::size_t>(message->payloadlen)),
                                        message->retain});
                                 });
  mosquitto_log_callback_set(client, [](mosquitto*, void* self, int level, const char* text) {
    if (level == MOSQ_LOG_ERR) static_cast<MqttClient*>(self)->last_error_ = text;
  });
  // Otherwise each step of a connection waits for the broker's delayed acknowledgement.
  mosquitto_int_option(client, MOSQ_OPT_TCP_NODELAY, 1);
  const auto used = UseAccount(client, {broker_.tls_ca, broker_.username, broker_.password_file});
  if (!used) return used;
  int code = MOSQ_ERR_SUCCESS;
  if (!options.will_topic.empty()) {
    code = mosquitto_will_set(client, options.will_topic.c_str(),
                              static_cast<int>(options.will.size()), options.will.data(), kWillQos,
                              false);
  }
  if (code == MOSQ_ERR_SUCCESS)
    code = mosquitto_connect_async(client, broker_.host.c_str(), broker_.port, kKeepAlive_s);
  if (code != MOSQ_ERR_SUCCESS) return Error{ErrorText(code)};
  return {};
}

std::string MqttClient::ErrorText(int code) const {
  return ConnectionFailure(code, last_error_);
}

int MqttClient::socket() const {
  return client_ ? mosquitto_socket(client_.get()) : -1;
}

bool MqttClient::writable() const {
  return connected() && !mosquitto_want_write(client_.get());
}

short MqttClient::events() const {
  const bool write = !reached_ || (mosquitto_want_write(client_.get()) && !stuck_);
  return static_cast<short>(write ? POLLIN | POLLOUT : POLLIN);
}

Result<void> MqttClient::Serve(short events) {
  mosquitto* const client = client_.get();
  const bool writes = (events & POLLOUT) != 0, fails = (events & (POLLERR | POLLHUP)) != 0;
  reached_ = reached_ || (writes && !fails);
  // Once the TCP connection is there, the library continues the TLS handshake when it reads.
  const bool handshake = writes && !connected() && !broker_.tls_ca.empty();
  int code = MOSQ_ERR_SUCCESS;
  if ((events & ~POLLOUT) != 0 || handshake) {
    for (int k = 0; k < kMaxPackets && code == MOSQ_ERR_SUCCESS; ++k) {
      code = mosquitto_loop_read(client, 1);
      if (handshake || mosquitto_socket(client) < 0 || !IsReadable(mosquitto_socket(client))) break;
    }
  }
  if (code == MOSQ_ERR_SUCCESS && writes) code = mosquitto_loop_write(client, 1);
  stuck_ = writes && !connected() && mosquitto_want_write(client);
  if (connack_ > 0) return Error{mosquitto_connack_string(connack_)};
  if (refused_) return Error{"the broker refused a subscription"};
  if (code != MOSQ_ERR_SUCCESS) return Error{ErrorText(code)};
  return {};
}

Result<void> MqttClient::KeepAlive() {
  const int code = mosquitto_loop_misc(client_.get());
  if (code != MOSQ_ERR_SUCCESS) return Error{ErrorText(code)};
  return {};
}

Result<void> MqttClient::Subscribe(const std::vector<std::string>& filters) {
  // The library does not change the filters, although it takes them as not constant.
  std::vector<char*> names;
  names.reserve(filters.size());
  for (const std::string& filter : filters) names.push_back(const_cast<char*>(filter.c_str()));
  const int code =
      mosquitto_subscribe_multiple(client_.get(), nullptr, static_cast<int>(names.size()),
                                   names.data(), kSubscribeQos, 0, nullptr);
  if (code != MOSQ_ERR_SUCCESS) return Error{ErrorText(code)};
  return {};
}

Result<void> MqttClient::Publish(const std::string& topic, const std::string& payload, int qos) {
  const int code = mosquitto_publish(client_.get(), nullptr, topic.c_str(),
                                     static_cast<int>(payload.size()), payload.data(), qos, false);
  if (code != MOSQ_ERR_SUCCESS) return Error{ErrorText(code)};
  return {};
}

void MqttClient::Disconnect() {
  mosquitto_disconnect(client_.get());
}

std::vector<MqttClient::Received> MqttClient::TakeReceived() {
  return std::exchange(received_, {});
}

}  // namespace plumbline::plant
