#include "app/plant/broker/broker_link.h"

#include <ctime>
#include <filesystem>
#include <tuple>

#include "tests/app/plant/broker/silent_broker.h"

namespace plumbline::broker_link_test {

using namespace plumbline::plant;
using namespace plumbline::test;

namespace {

config::MqttConfig At(int port) {
  config::MqttConfig config;
  config.host = "127.0.0.1";
  config.port = port;
  config.client_id = "link-test";
  return config;
}

/// Heartbeats of the link's thread in a second; it waits up to 200 ms when idle.
std::uint64_t TurnsInASecond(const config::MqttConfig& config) {
  const BrokerLink link(config, {});
  std::this_thread::sleep_for(std::chrono::seconds(1));
  return link.beats();
}

constexpr std::uint64_t kMostTurns = 30;

}  // namespace

TEST_CASE("a broker that accepts the connection but never replies causes no busy loop") {
  const SilentBroker broker(false);
  const std::uint64_t turns = TurnsInASecond(At(broker.port()));
  CHECK(turns >= 1);
  CHECK(turns <= kMostTurns);
  const std::clock_t before = std::clock();
  const auto tried = TryBroker(At(broker.port()), 1);
  REQUIRE_FALSE(tried);
  CHECK(tried.error() == "no answer");
  CHECK(std::clock() - before < CLOCKS_PER_SEC / 4);  // CPU time, independent of other load
}

TEST_CASE("a TLS broker that never replies causes no busy loop") {
  config::MqttConfig config;
  config.tls_ca = "/etc/ssl/certs/ca-certificates.crt";
  if (!std::filesystem::exists(config.tls_ca)) {
    WARN("SKIPPED: no certificates here (apt install ca-certificates)");
    return;
  }
  const SilentBroker broker(false);
  const std::string authority = config.tls_ca;
  config = At(broker.port());
  config.tls_ca = authority;
  CHECK(TurnsInASecond(config) <= kMostTurns);
}

TEST_CASE("the link disconnects cleanly after SuppressWill() or if nothing was published") {
  const std::string disconnect("\xE0\x00", 2);  // DISCONNECT [MQTT 3.1.1, 3.14]
  for (const auto& [publishes, suppress_will, expected] :
       {std::tuple(true, false, false), {true, true, true}, {false, false, true}}) {
    SilentBroker broker(true);
    {
      BrokerLink link(At(broker.port()), {"will", [](std::int64_t) { return "dead"; }});
      std::int64_t connection = 0;
      while ((connection = link.TakeStatus().connection) == 0) std::this_thread::yield();
      if (publishes) link.Publish(connection, {{1, "birth", "BIRTH", true}});
      while (publishes && broker.Bytes().find("BIRTH") == std::string::npos) {
        std::this_thread::yield();
      }
      if (suppress_will) link.SuppressWill(connection);
    }
    const std::string received = broker.AllBytes();
    const bool clean = received.size() >= 2 && received.substr(received.size() - 2) == disconnect;
    CHECK(clean == expected);
  }
}

}  // namespace plumbline::broker_link_test
