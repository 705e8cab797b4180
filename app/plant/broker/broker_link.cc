#include "app/plant/broker/broker_link.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <map>
#include <mutex>
#include <thread>

#include "app/base/service/utc_clock.h"
#include "app/plant/broker/broker_account.h"
#include "app/plant/broker/memory_limit.h"
#include "drivers/back_off.h"
#include "drivers/clock.h"
#include "drivers/os/descriptor.h"
#include "drivers/thread_heartbeat.h"

namespace plumbline::plant {
namespace {

constexpr unsigned kMaxInFlight = 100;
constexpr auto kEndTimeout = std::chrono::seconds(2);

/// One connection, from its first byte to its end; used by one thread.
class Connection {
 public:
  explicit Connection(const config::MqttConfig& config)
      : config_(config),
        client_(mosquitto_new(config.client_id.c_str(), true, this), &mosquitto_destroy) {}

  /// @return  empty, or why the connection cannot be attempted
  std::string Begin(const std::string& will_topic, const std::string& will) {
    if (!client_) return std::strerror(errno);
    mosquitto* const client = client_.get();
    mosquitto_connect_callback_set(client, [](mosquitto*, void* self, int code) {
      static_cast<Connection*>(self)->connack_ = code;
    });
    mosquitto_publish_callback_set(client, [](mosquitto*, void* self, int number) {
      static_cast<Connection*>(self)->Acknowledged(number);
    });
    mosquitto_log_callback_set(client, [](mosquitto*, void* self, int level, const char* text) {
      if (level == MOSQ_LOG_ERR) static_cast<Connection*>(self)->last_error_ = text;
      // The only sign of a message of QoS 2 that the broker never completes.
      if (level == MOSQ_LOG_DEBUG && std::strstr(text, " received PUBLISH ") != nullptr)
        static_cast<Connection*>(self)->intruded_ = true;
    });
    mosquitto_max_inflight_messages_set(client, kMaxInFlight);
    const auto used = UseAccount(client, {config_.tls_ca, config_.username, config_.password_file});
    if (!used) return used.error();
    int code = MOSQ_ERR_SUCCESS;
    if (!will_topic.empty()) {
      code = mosquitto_will_set(client, will_topic.c_str(), static_cast<int>(will.size()),
                                will.data(), kQos, true);
    }
    if (code == MOSQ_ERR_SUCCESS) {
      code = mosquitto_connect_async(client, config_.host.c_str(), config_.port,
                                     BrokerLink::kKeepAlive_s);
    }
    return code == MOSQ_ERR_SUCCESS ? "" : ErrorText(code);
  }

  /// Waits up to `wait_ms` for the network or `wake`, and handles what arrived.
  /// @return  empty, or why the connection ended
  std::string Poll(int wake, int wait_ms) {
    mosquitto* const client = client_.get();
    const int socket = mosquitto_socket(client);
    if (socket < 0) return ErrorText(MOSQ_ERR_CONN_LOST);
    const bool write = !reached_ || (mosquitto_want_write(client) && !stuck_);
    pollfd waiting[2] = {{socket, static_cast<short>(write ? POLLIN | POLLOUT : POLLIN), 0},
                         {wake, POLLIN, 0}};
    if (poll(waiting, 2, wait_ms) < 0 && errno != EINTR) return std::strerror(errno);
    std::uint64_t woken = 0;
    [[maybe_unused]] const ssize_t taken = read(wake, &woken, sizeof woken);
    int code = MOSQ_ERR_SUCCESS;
    const bool writable = (waiting[0].revents & POLLOUT) != 0;
    // Once connected, the library continues the TLS handshake in its read function.
    const bool handshake = writable && !up() && !config_.tls_ca.empty();
    if ((waiting[0].revents & ~POLLOUT) != 0 || handshake) code = mosquitto_loop_read(client, 1);
    const bool no_memory = code == MOSQ_ERR_NOMEM;
    if (code == MOSQ_ERR_SUCCESS && writable) code = mosquitto_loop_write(client, 1);
    reached_ = reached_ || writable;
    stuck_ = writable && !up() && mosquitto_want_write(client);
    if (code == MOSQ_ERR_SUCCESS) code = mosquitto_loop_misc(client);
    if (connack_ > 0) return mosquitto_connack_string(connack_);
    intruded_ = intruded_ || no_memory;
    if (intruded_) {
      return no_memory ? "sent a packet for which there is no memory"
                       : "sent a message, although nothing was subscribed to";
    }
    return code == MOSQ_ERR_SUCCESS ? "" : ErrorText(code);
  }

  bool up() const { return connack_ == 0; }
  bool has_published() const { return published_; }
  /// Whether the broker sent what a client without subscriptions never receives.
  bool intruded() const { return intruded_; }

  std::string Publish(const Outgoing& message) {
    int number = 0;
    const int code = mosquitto_publish(client_.get(), &number, message.topic.c_str(),
                                       static_cast<int>(message.payload.size()),
                                       message.payload.data(), kQos, message.retained);
    if (code != MOSQ_ERR_SUCCESS) return ErrorText(code);
    ids_[number] = message.id;
    published_ = true;
    return "";
  }
  std::vector<std::int64_t> TakeAcknowledged() { return std::exchange(acknowledged_, {}); }
  /// Disconnects cleanly, so that the broker discards the will.
  void End() { mosquitto_disconnect(client_.get()); }

 private:
  void Acknowledged(int number) {
    const auto found = ids_.find(number);
    if (found == ids_.end()) return;
    acknowledged_.push_back(found->second);
    ids_.erase(found);
  }
  std::string ErrorText(int code) const { return ConnectionFailure(code, last_error_); }

  const config::MqttConfig& config_;
  const std::unique_ptr<mosquitto, void (*)(mosquitto*)> client_;
  int connack_ = -1;      ///< code of the broker's CONNACK; -1: not received yet
  bool reached_ = false;  ///< the TCP connection is established
  /// The library waits for a reply before it can write: polling for a writable socket would spin.
  bool stuck_ = false;
  bool published_ = false;  ///< has published
  bool intruded_ = false;
  std::string last_error_;
  std::map<int, std::int64_t> ids_;
  std::vector<std::int64_t> acknowledged_;
};

constexpr int kPollPeriod_ms = 200;

}  // namespace

struct BrokerLink::Shared {
  Shared(const config::MqttConfig& mqtt, LastWill last_will)
      : config(mqtt), will(std::move(last_will)), wake(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    status.problem = "not connected yet";
  }
  void Wake() const {
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = write(wake.get(), &one, sizeof one);
  }
  void Run();
  /// One connection.
  struct Ended {
    std::string problem;
    bool intruded = false;
  };
  Ended Serve(BackOff& back_off);
  bool Exchange(Connection& connection, std::int64_t number, std::vector<Outgoing>& messages);

  const config::MqttConfig config;
  const LastWill will;
  const os::Descriptor wake;
  ThreadHeartbeat pulse;
  std::mutex mutex;  ///< of what follows
  std::condition_variable changed;
  bool stop = false, ended = false;
  std::int64_t will_suppressed = 0;  ///< number of the connection whose will is not needed; 0: none
  Status status;
  std::vector<Outgoing> outgoing;  ///< for the present connection
};

/// Publishes the connection's status and takes the queued messages.
/// @return  false if the link is to stop
bool BrokerLink::Shared::Exchange(Connection& connection, std::int64_t number,
                                  std::vector<Outgoing>& messages) {
  const std::lock_guard lock(mutex);
  const auto acknowledged = connection.TakeAcknowledged();
  status.acknowledged.insert(status.acknowledged.end(), acknowledged.begin(), acknowledged.end());
  if (connection.up() && status.connection != number) {
    status.connection = number;
    status.intruded = false;
    status.problem.clear();
  }
  messages.swap(outgoing);
  return !stop;
}

/// Runs one connection to its end. @return  why it ended
BrokerLink::Shared::Ended BrokerLink::Shared::Serve(BackOff& back_off) {
  const auto number = static_cast<std::int64_t>(std::llround(1e3 * service::SystemUtcSeconds()));
  Connection connection(config);
  std::string problem =
      connection.Begin(will.topic, will.topic.empty() ? "" : will.payload(number));
  const double until_s = MonotonicSeconds() + kConnectTimeout_s;
  while (problem.empty()) {
    pulse.Beat();
    problem = connection.Poll(wake.get(), kPollPeriod_ms);
    std::vector<Outgoing> messages;
    if (!Exchange(connection, number, messages)) {
      const std::lock_guard lock(mutex);
      if (will_suppressed == number || !connection.has_published()) connection.End();
      return {"stopped"};
    }
    if (connection.up()) back_off.Well();
    if (problem.empty() && !connection.up() && MonotonicSeconds() > until_s) problem = "no answer";
    for (const Outgoing& message : messages) {
      if (problem.empty()) problem = connection.Publish(message);
    }
  }
  return {problem, connection.intruded()};
}

void BrokerLink::Shared::Run() {
  BackOff back_off;
  for (;;) {
    const Ended end = Serve(back_off);
    back_off.Failed(MonotonicSeconds(), end.intruded ? kIntrusionPause_s : 0);
    std::unique_lock lock(mutex);
    status.connection = 0;
    status.problem = end.problem;
    status.intruded = end.intruded;
    outgoing.clear();
    while (!stop && !back_off.Due(MonotonicSeconds())) {
      pulse.Beat();
      changed.wait_for(lock, std::chrono::milliseconds(100));
    }
    if (!stop) continue;
    ended = true;
    changed.notify_all();
    return;
  }
}

BrokerLink::BrokerLink(const config::MqttConfig& config, LastWill will)
    : shared_(std::make_shared<Shared>(config, std::move(will))) {
  OpenLibrary();
  std::thread thread([shared = shared_] { shared->Run(); });
  pthread_setname_np(thread.native_handle(), "broker");
  thread.detach();
}

BrokerLink::~BrokerLink() {
  std::unique_lock lock(shared_->mutex);
  shared_->stop = true;
  shared_->Wake();
  shared_->changed.notify_all();
  shared_->changed.wait_for(lock, kEndTimeout, [this] { return shared_->ended; });
}

BrokerLink::Status BrokerLink::TakeStatus() {
  const std::lock_guard lock(shared_->mutex);
  Status status = shared_->status;
  shared_->status.acknowledged.clear();
  return status;
}

void BrokerLink::Publish(std::int64_t connection, std::vector<Outgoing> messages) {
  {
    const std::lock_guard lock(shared_->mutex);
    if (connection != shared_->status.connection) return;
    std::move(messages.begin(), messages.end(), std::back_inserter(shared_->outgoing));
  }
  shared_->Wake();
}

void BrokerLink::SuppressWill(std::int64_t connection) {
  const std::lock_guard lock(shared_->mutex);
  shared_->will_suppressed = connection;
}

std::uint64_t BrokerLink::beats() const {
  return shared_->pulse.beats();
}

Result<void> TryBroker(const config::MqttConfig& config, double timeout_s) {
  OpenLibrary();
  const MemoryGrowthLimit limit(kMaxGrowth_bytes);
  config::MqttConfig other = config;
  other.client_id += "-doctor";  // the publisher's id would disconnect the publisher
  Connection connection(other);
  std::string problem = connection.Begin("", "");
  const os::Descriptor none(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  const double until_s = MonotonicSeconds() + timeout_s;
  while (problem.empty() && !connection.up()) {
    problem = connection.Poll(none.get(), kPollPeriod_ms);
    if (problem.empty() && !connection.up() && MonotonicSeconds() > until_s) problem = "no answer";
  }
  if (problem.empty()) connection.End();
  if (!problem.empty()) return Error{problem};
  return {};
}

}  // namespace plumbline::plant
