// Benchmark of the Modbus server against its peers, measured in the same run and printed as ratios.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <exception>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "drivers/modbus/image_handler.h"
#include "tests/bench/modbus_load.h"
#include "tests/bench/modbus_servers.h"

namespace plumbline::bench {
namespace {

struct Row {
  std::string what, ours, peer, ratio, target;
  bool met = false;
};

std::string Text(const char* format, double value) {
  std::array<char, 64> text;
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

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
  Row AsRow(const std::string& what, const char* format, const std::string& target,
            bool met) const {
    return {
        what, Text(format, Median(ours)), Text(format, Median(peer)), Text("%.3f", Ratio()), target,
        met};
  }
};

std::vector<Row> CompareRoundTrips(bool quick) {
  const int cpu = LastCpu(), rounds = quick ? 5 : 31, polls = quick ? 2000 : 10'000;
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
  return {p50.AsRow("FC03 x10, one core, round trip p50 [us], peer bare libmodbus", "%.2f",
                    "<= 1.0x", p50.Ratio() <= 1.0),
          p99.AsRow("FC03 x10, one core, round trip p99 [us], peer bare libmodbus", "%.2f",
                    "<= 1.1x", p99.Ratio() <= 1.1)};
}

Row CompareRates(int clients, bool quick) {
  const int cpu = LastCpu(), rounds = quick ? 3 : 31, requests = quick ? 10'000 : 40'000;
  const ServerProcess ours(ServerKind::kPlumbline, cpu), peer(ServerKind::kLibmodbusSelect, cpu);
  Pairs rate;
  PinToCpu(cpu);
  for (int round = 0; round < rounds; ++round) {
    rate.ours.push_back(MeasureRate(ours.port(), clients, requests));
    rate.peer.push_back(MeasureRate(peer.port(), clients, requests));
  }
  PinToCpu(-1);
  return rate.AsRow(
      std::to_string(clients) + " clients, one core, requests a second, peer libmodbus with select",
      "%.0f", ">= 1.25x", rate.Ratio() >= 1.25);
}

GoodClient UnderAttack(ServerKind kind, std::size_t answer_bytes, double duration_s,
                       Attack attack = Attack::kMixed) {
  const ServerProcess server(kind);
  const HostileClients hostile(server.port(), attack);
  return PollEveryMillisecond(server.port(), answer_bytes, duration_s);
}

std::vector<Row> CompareUnderAttack(bool quick) {
  const int rounds = quick ? 1 : 3;
  const double duration_s = quick ? 1.5 : 5;
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
  const double limit_ms = std::max(10.0, 2 * echo.worst_ms);
  return {{"worst of " + std::to_string(ours.polls) +
               " polls at 1 kHz under hostile clients [ms], peer bare echo server",
           Text("%.2f", ours.worst_ms), Text("%.2f", echo.worst_ms),
           Text("%.2f", ours.worst_ms / echo.worst_ms), "<= " + Text("%.1f ms", limit_ms),
           ours.worst_ms <= limit_ms},
          {"reconnections of the well-behaved client; it is never locked out",
           std::to_string(ours.reconnections), std::to_string(echo.reconnections), "",
           "never locked out", !ours.locked_out}};
}

/// Worst response time of a well-behaved client under each attack and over all attacks.
std::vector<Row> CompareEachAttack(bool quick) {
  constexpr double kTarget_ms = 5;
  const double duration_s = quick ? 1.5 : 5;
  const std::pair<Attack, const char*> attacks[] = {
      {Attack::kMixed, "broken frames, dripped bytes, unread answers"},
      {Attack::kAcceptQueue, "a full accept queue"},
      {Attack::kTenThousand, "10,000 connections"},
      {Attack::kAbandon, "connections abandoned at once"}};
  std::vector<Row> rows;
  double worst_ms = 0, worst_peer_ms = 0;
  const auto row = [](const std::string& what, double ours_ms, double peer_ms) {
    return Row{what,
               Text("%.2f", ours_ms),
               Text("%.2f", peer_ms),
               Text("%.4f", ours_ms / peer_ms),
               "<= " + Text("%.0f ms", kTarget_ms),
               ours_ms <= kTarget_ms};
  };
  for (const auto& [attack, name] : attacks) {
    const GoodClient ours = UnderAttack(ServerKind::kPlumbline, 29, duration_s, attack);
    const GoodClient peer = UnderAttack(ServerKind::kLibmodbusSelect, 29, duration_s, attack);
    rows.push_back(
        row(std::string("worst poll under ") + name + " [ms], peer libmodbus with select",
            ours.worst_ms, peer.worst_ms));
    worst_ms = std::max(worst_ms, ours.worst_ms);
    worst_peer_ms = std::max(worst_peer_ms, peer.worst_ms);
  }
  rows.push_back(
      row("worst poll over all attacks [ms], peer libmodbus with select", worst_ms, worst_peer_ms));
  return rows;
}

Row CountTornReads(bool quick) {
  const ServerProcess server(ServerKind::kPlumbline, -1, 1000);
  const TornReads result = ReadBlocks(server.port(), quick ? 50'000 : 1'000'000);
  return {"torn reads among " + std::to_string(result.reads) + " of 40 registers over TCP, " +
              std::to_string(result.images) + " images published at 1 kHz",
          std::to_string(result.torn),
          "",
          "",
          "0",
          result.torn == 0 && result.images > 1};
}

/// Without a socket, against a writer that publishes as fast as possible.
Row CountTornReadsInProcess(bool quick) {
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
  const int reads = quick ? 50'000 : 1'000'000;
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
  return {"torn reads among " + std::to_string(reads) + " in process, writer without pause",
          std::to_string(torn),
          "",
          "",
          "0",
          torn == 0};
}

void Print(const std::vector<Row>& rows) {
  std::printf("| what | ours | peer | ratio | target | met |\n|---|---|---|---|---|---|\n");
  for (const Row& row : rows) {
    std::printf("| %s | %s | %s | %s | %s | %s |\n", row.what.c_str(), row.ours.c_str(),
                row.peer.c_str(), row.ratio.c_str(), row.target.c_str(), row.met ? "yes" : "NO");
  }
}

void WriteJson(const std::vector<Row>& rows, const std::string& file) {
  nlohmann::json all = nlohmann::json::array();
  for (const Row& row : rows) {
    all.push_back({{"what", row.what},
                   {"ours", row.ours},
                   {"peer", row.peer},
                   {"ratio", row.ratio},
                   {"target", row.target},
                   {"met", row.met}});
  }
  std::ofstream(file) << all.dump(2) << "\n";
}

int Run(int argc, char** argv) {
  CLI::App app{"Measures the Modbus TCP server against libmodbus and a bare echo server."};
  bool quick = false;
  std::string json_file, only;
  app.add_flag("--quick", quick, "a short run; its results are not significant");
  app.add_option("--json", json_file, "also write the table to this file");
  app.add_option("--only", only, "run one part only")
      ->check(CLI::IsMember({"latency", "rate", "attack", "torn"}));
  CLI11_PARSE(app, argc, argv);

  std::vector<Row> rows;
  const auto wanted = [&](const char* part) { return only.empty() || only == part; };
  if (wanted("latency")) rows = CompareRoundTrips(quick);
  if (wanted("rate")) {
    rows.push_back(CompareRates(8, quick));
    rows.push_back(CompareRates(32, quick));
  }
  if (wanted("attack")) {
    for (const Row& row : CompareUnderAttack(quick)) rows.push_back(row);
    for (const Row& row : CompareEachAttack(quick)) rows.push_back(row);
  }
  if (wanted("torn")) {
    rows.push_back(CountTornReads(quick));
    rows.push_back(CountTornReadsInProcess(quick));
  }
  Print(rows);
  if (!json_file.empty()) WriteJson(rows, json_file);
  return 0;
}

}  // namespace
}  // namespace plumbline::bench

int main(int argc, char** argv) {
  try {
    return plumbline::bench::Run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "modbus_bench: %s\n", error.what());
    return 1;
  }
}
