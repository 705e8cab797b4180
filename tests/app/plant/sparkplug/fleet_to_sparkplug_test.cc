// The real publisher's messages through the real bridge: all of them are understood.
#include <catch2/catch.hpp>
#include <mutex>

#include "tests/app/plant/publish/fleet_station.h"
#include "tests/app/plant/publish/historian.h"

namespace plumbline::test {
namespace {

/// Payloads by type; Sparkplug's are not JSON, so Historian cannot hold them.
class SparkplugListener {
 public:
  explicit SparkplugListener(int port)
      : client_(mosquitto_new("listener", true, this), &mosquitto_destroy) {
    mosquitto_message_callback_set(
        client_.get(), [](mosquitto*, void* self, const mosquitto_message* message) {
          auto* const own = static_cast<SparkplugListener*>(self);
          const std::lock_guard lock(own->mutex_);
          own->heard_[message->topic].emplace_back(static_cast<const char*>(message->payload),
                                                   static_cast<std::size_t>(message->payloadlen));
        });
    REQUIRE(mosquitto_connect(client_.get(), "127.0.0.1", port, 30) == MOSQ_ERR_SUCCESS);
    mosquitto_subscribe(client_.get(), nullptr, "spBv1.0/plumbline/#", 1);
    mosquitto_loop_start(client_.get());
  }
  ~SparkplugListener() {
    mosquitto_disconnect(client_.get());
    mosquitto_loop_stop(client_.get(), true);
  }
  SparkplugListener(const SparkplugListener&) = delete;
  SparkplugListener& operator=(const SparkplugListener&) = delete;

  std::vector<std::string> Of(const std::string& type) const {
    const std::lock_guard lock(mutex_);
    const auto found = heard_.find("spBv1.0/plumbline/" + type + "/cell-7");
    return found == heard_.end() ? std::vector<std::string>() : found->second;
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::string, std::vector<std::string>> heard_;
  std::unique_ptr<mosquitto, void (*)(mosquitto*)> client_;
};

struct BridgeProcess {
  TemporaryFolder folder;
  std::string log = folder.path() + "/log";
  pid_t pid = -1;
  explicit BridgeProcess(int port) {
    const std::string config = folder.path() + "/plant.toml";
    std::ofstream(config) << "[broker]\nhost = \"127.0.0.1\"\nport = " << port << "\n";
    pid = fork();
    if (pid == 0) {
      const int file = open(log.c_str(), O_WRONLY | O_CREAT, 0644);
      dup2(file, STDERR_FILENO);
      execl(PLUMBLINE_SPARKPLUG, PLUMBLINE_SPARKPLUG, config.c_str(), nullptr);
      _exit(127);
    }
  }
  ~BridgeProcess() {
    kill(pid, SIGTERM);
    waitpid(pid, nullptr, 0);
  }
};

TEST_CASE("What plumbline-fleet publishes is understood and published as Sparkplug") {
  if (MosquittoProgram().empty()) {
    WARN("SKIPPED: no mosquitto here");
    return;
  }
  BrokerProcess broker;
  const SparkplugListener listener(broker.port());
  FleetStation station("port = " + std::to_string(broker.port()) + "\n");
  const BridgeProcess bridge(broker.port());
  const auto log = [&] { return FileText(bridge.log); };
  station.Start();
  INFO(log());
  REQUIRE(Soon([&] { return !listener.Of("NBIRTH").empty(); }));
  REQUIRE(Soon([&] { return !listener.Of("NDATA").empty(); }));
  station.AddProbes(3);
  station.feed->Set([](cell::ViewState& state) {
    state.alarms = 2;
    state.cameras.resize(1);
    state.cameras[0].status.configured = true;
    state.points[0].translation_B = Vec3(0.001, 0, 0);
  });
  REQUIRE(Soon([&] {
    const auto births = listener.Of("NBIRTH");
    return births.back().find("Cameras/") != std::string::npos;
  }));
  CHECK(listener.Of("NBIRTH").back().find("Points/1/Correction/X") != std::string::npos);
  const std::size_t before = listener.Of("NDATA").size();
  CHECK(Soon([&] { return listener.Of("NDATA").size() > before + 2; }));
  station.Signal(SIGTERM);
  CHECK(station.Wait() == 0);
  CHECK(Soon([&] { return !listener.Of("NDEATH").empty(); }));
  CHECK(log().find("not understood") == std::string::npos);
  CHECK(log().find("missing") == std::string::npos);
}

}  // namespace
}  // namespace plumbline::test
