// plumbline-fleet and a broker that attacks it: memory stays bounded, and it is logged once.
#include "tests/app/plant/broker/hostile_broker.h"

#include <cstdlib>
#include <fstream>

#include "tests/app/plant/publish/fleet_station.h"

namespace plumbline::hostile_broker_test {

using namespace plumbline::test;

namespace {

constexpr std::size_t kMB = 1'000'000;

/// PUBLISH [MQTT 3.1.1, 3.3] with one topic, as many bytes announced as the length can state.
std::string Publish(int qos, std::size_t payload, bool complete) {
  std::string body("\x00\x01t", 3);
  if (qos > 0) body += std::string("\x00\x07", 2);
  const std::size_t announced = body.size() + payload;
  std::string packet(1, static_cast<char>(0x30 | qos << 1));
  std::size_t left = announced;
  do {
    packet += static_cast<char>((left % 128) | (left >= 128 ? 128 : 0));
    left /= 128;
  } while (left > 0);
  packet += body;
  if (complete) packet.append(payload, 'x');
  return packet;
}

/// Largest memory that the process has used since its start [bytes].
std::size_t PeakMemory(pid_t pid) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmHWM:")) return 1024 * std::strtoull(line.c_str() + 6, nullptr, 10);
  }
  return 0;
}

int Count(const std::string& text, const std::string& what) {
  int count = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

}  // namespace

TEST_CASE("a broker that announces 256 MB or floods costs little memory, and is left alone") {
  struct Attack {
    const char* name;
    std::string once, flood;
  };
  const std::string logged = "disconnected, and tried again every 60 s";
  const Attack attack = GENERATE_COPY(
      Attack{"256 MB announced and sent", Publish(0, 268'000'000, false), std::string(65536, 'x')},
      Attack{"messages of 20 MB", "", Publish(0, 20 * kMB, true)},
      Attack{"flood of small messages", "", Publish(0, 10, true)},
      Attack{"messages of QoS 1", "", Publish(1, 1000, true)},
      Attack{"messages of QoS 2 that never end", "", Publish(2, kMB, true)});
  CAPTURE(attack.name);
  const HostileBroker broker(attack.once, attack.flood);
  FleetStation station(fmt::format("port = {}\n", broker.port()));
  station.Start();
  REQUIRE(Soon([&] { return broker.hung_up() > 0; }));
  INFO(station.Log());
  CHECK(station.Says(logged));
  const std::size_t peak = PeakMemory(station.pid);
  WARN(attack.name << ": " << broker.sent() / kMB << " MB sent, peak memory " << peak / kMB
                   << " MB");
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  const bool exhausted = Count(station.Log(), "sent a packet for which there is no memory") == 1;
  if (!attack.once.empty()) CHECK(exhausted);  // large messages may meet either limit first
  CHECK(peak > 0);
  CHECK(peak < 80 * kMB);
#endif
  std::this_thread::sleep_for(std::chrono::seconds(3));  // an ordinary pause is at most one second
  CHECK(broker.clients() == 1);
  CHECK(Count(station.Log(), logged) == 1);
  station.Signal(SIGTERM);
  CHECK(station.Wait() == 0);
}

}  // namespace plumbline::hostile_broker_test
