// Benchmark of the Modbus server against its peers, measured in the same run and printed as ratios.
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "drivers/modbus/image_handler.h"
#include "tests/bench/modbus_load.h"
#include "tests/bench/modbus_servers.h"
#include "tests/bench/rows.h"

namespace plumbline::bench {
namespace {

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
}

/// A quantity measured several times, alternating between ours and the peer.
struct Pairs {
  std::vector<double> ours, peer;

  double Ratio() const {
    std::vector<double> ratios;
    for (std::size_t i = 0; i < ours.size(); ++i) ratios.push_back(ours[i] / peer[i]);
    return Median(ratios);
  }
  void ReportAs(const std::string& what, const char* unit, const char* peer_name, Goal goal) const {
    // The median of the ratios, which disturbances move less than the ratio of the medians.
    Report({.what = what,
            .ours = Ratio() * Median(peer),
            .unit = unit,
            .goal = goal,
            .peer = peer_name,
            .peers = Median(peer)});
  }
};

void CompareRoundTrips(Effort effort) {
  const int cpu = LastCpu(), rounds = Choose(effort, 1, 5, 31),
            polls = Choose(effort, 200, 2000, 10'000);
  const ServerProcess ours(ServerKind::kPlumbline, cpu), peer(ServerKind::kLibmodbus, cpu);
  Pairs p50, p99;
  PinToCpu(cpu);
  for (int round = 0; round < rounds; ++round) {
    const RoundTrips a = MeasureRoundTrips(ours.port(), polls);
    const RoundTrips b = MeasureRoundTrips(peer.port(), polls);
    p50.ours.push_back(a.p50_us);
    p99.ours.push_back(a.p99_us);
    p50.peer.push_back(b.p50_us);
    p99.peer.push_back(b.p99_us);
  }
  PinToCpu(-1);
  p50.ReportAs("FC03 of 10 registers, one core, round trip, median", "us", "bare libmodbus",
               RatioAtMost(1.0));
  p99.ReportAs("FC03 of 10 registers, one core, round trip, 99 %", "us", "bare libmodbus",
               RatioAtMost(1.1));
}

void CompareRates(int clients, Effort effort) {
  const int cpu = LastCpu(), rounds = Choose(effort, 1, 3, 31),
            requests = Choose(effort, 1000, 10'000, 40'000);
  const ServerProcess ours(ServerKind::kPlumbline, cpu), peer(ServerKind::kLibmodbusSelect, cpu);
  Pairs rate;
  PinToCpu(cpu);
  for (int round = 0; round < rounds; ++round) {
    rate.ours.push_back(MeasureRate(ours.port(), clients, requests));
    rate.peer.push_back(MeasureRate(peer.port(), clients, requests));
  }
  PinToCpu(-1);
  rate.ReportAs(std::to_string(clients) + " clients, one core, requests", "1/s",
                "libmodbus with select", RatioAtLeast(1.25));
}

GoodClient UnderAttack(ServerKind kind, std::size_t answer_bytes, double duration_s,
                       Attack attack = Attack::kMixed) {
  const ServerProcess server(kind);
  const HostileClients hostile(server.port(), attack);
  return PollEveryMillisecond(server.port(), answer_bytes, duration_s);
}

void CompareUnderAttack(Effort effort) {
  const int rounds = Choose(effort, 1, 1, 3);
  const double duration_s = Choose(effort, 0.3, 1.5, 5.0);
  GoodClient ours, echo;
  const auto add = [](GoodClient& sum, const GoodClient& one) {
    sum.worst_ms = std::max(sum.worst_ms, one.worst_ms);
    sum.polls += one.polls;
    sum.reconnections += one.reconnections;
    sum.locked_out |= one.locked_out;
  };
  for (int round = 0; round < rounds; ++round) {
    add(ours, UnderAttack(ServerKind::kPlumbline, 29, duration_s));
    add(echo, UnderAttack(ServerKind::kEcho, 12, duration_s));
  }
  Report({.what = "longest of 1 kHz polls under hostile clients",
          .ours = ours.worst_ms,
          .unit = "ms",
          .goal = AtMost(std::max(10.0, 2 * echo.worst_ms)),
          .peer = "bare echo server",
          .peers = echo.worst_ms});
  Report({.what = "well-behaved client locked out by hostile ones",
          .ours = ours.locked_out ? 1.0 : 0.0,
          .goal = AtMost(0),
          .timed = false});
}

/// Worst response time of a well-behaved client under each attack and over all attacks.
void CompareEachAttack(Effort effort) {
  constexpr double kTarget_ms = 5;
  const double duration_s = Choose(effort, 0.3, 1.5, 5.0);
  const std::pair<Attack, const char*> attacks[] = {
      {Attack::kMixed, "broken frames, dripped bytes, unread answers"},
      {Attack::kAcceptQueue, "a full accept queue"},
      {Attack::kTenThousand, "10,000 connections"},
      {Attack::kAbandon, "connections abandoned at once"}};
  for (const auto& [attack, name] : attacks) {
    const GoodClient ours = UnderAttack(ServerKind::kPlumbline, 29, duration_s, attack);
    const GoodClient peer = UnderAttack(ServerKind::kLibmodbusSelect, 29, duration_s, attack);
    Report({.what = std::string("longest poll under ") + name,
            .ours = ours.worst_ms,
            .unit = "ms",
            .goal = AtMost(kTarget_ms),
            .peer = "libmodbus with select",
            .peers = peer.worst_ms});
  }
}

void CountTornReads(Effort effort) {
  const ServerProcess server(ServerKind::kPlumbline, -1, 1000);
  const TornReads result = ReadBlocks(server.port(), Choose(effort, 5000, 50'000, 1'000'000));
  Report({.what = "torn reads among " + std::to_string(result.reads) +
                  " over TCP, images published at 1 kHz",
          .ours = result.images > 1 ? static_cast<double>(result.torn) : NAN,
          .goal = AtMost(0),
          .timed = false});
}

/// Without a socket, against a writer that publishes as fast as possible.
void CountTornReadsInProcess(Effort effort) {
  modbus::RegisterImage image;
  image.readable =
      std::make_shared<modbus::AddressRanges>(std::vector<modbus::AddressRanges::Range>{{0, 39}});
  image.registers.resize(40);
  const auto fill = [](modbus::RegisterImage& target, unsigned number) {
    for (unsigned k = 0; k < 40; ++k) {
      target.registers[k] = static_cast<std::uint16_t>(number + k);
    }
  };
  fill(image, 0);
  Latest<modbus::RegisterImage> images(1, image);
  modbus::ImageHandler handler(images, {}, {});
  std::atomic<bool> stop{false};
  std::thread writer([&] {
    for (unsigned number = 1; !stop; ++number) {
      fill(images.Begin(), number);
      images.Publish();
    }
  });
  const std::array<std::uint8_t, 5> request = {3, 0, 0, 0, 40};
  std::array<std::uint8_t, modbus::kMaxPduBytes> response{};
  const int reads = Choose(effort, 5000, 50'000, 1'000'000);
  int torn = 0;
  for (int i = 0; i < reads; ++i) {
    handler.Handle({}, request, response);
    const auto word = [&](std::size_t k) {
      return (response[2 + 2 * k] << 8) | response[3 + 2 * k];
    };
    bool whole = true;
    for (std::size_t k = 0; k < 40; ++k) {
      whole = whole && word(k) == ((word(0) + static_cast<int>(k)) & 0xFFFF);
    }
    if (!whole) ++torn;
  }
  stop = true;
  writer.join();
  Report({.what = "torn reads among " + std::to_string(reads) + " in process, writer without pause",
          .ours = static_cast<double>(torn),
          .goal = AtMost(0),
          .timed = false});
}

}  // namespace
}  // namespace plumbline::bench

int main(int argc, char** argv) {
  using namespace plumbline::bench;
  try {
    const Effort effort = EffortFrom(argc, argv);
    CompareRoundTrips(effort);
    CompareRates(8, effort);
    CompareRates(32, effort);
    CompareUnderAttack(effort);
    CompareEachAttack(effort);
    CountTornReads(effort);
    CountTornReadsInProcess(effort);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "modbus_bench: %s\n", error.what());
    return 1;
  }
}
