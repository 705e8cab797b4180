// Benchmark of the daemon from socket to socket: latency from a robot register to a corrected
// point.
#include <fmt/core.h>
#include <modbus/modbus.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "tests/bench/daemon_start.h"
#include "tests/bench/rows.h"

using namespace plumbline::bench;

namespace {

constexpr double kCycle_ms = 10;
constexpr std::uint16_t kLight_g = 20000, kHeavy_g = 60000;
constexpr double kLeastChange_mm = 0.05;

/// point_x of the first point; counts a failed request in `bad`.
double PointX_mm(modbus_t* plc, int& bad) {
  std::uint16_t words[2] = {};
  bad += modbus_read_registers(plc, 2003, 2, words) != 2;
  return static_cast<double>(modbus_get_float_abcd(words));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    fmt::print(stderr, "usage: daemon_bench PLUMBLINED CELL.toml [--smoke | --quick]\n");
    return 2;
  }
  const int changes = Choose(EffortFrom(argc, argv), 5, 50, 500);
  const WorkFolder own;
  const std::string& folder = own.path();
  BenchRobot robot;
  robot.SetPayload(kLight_g);
  std::ofstream(folder + "/profile.toml") << kProfile;
  std::ofstream(folder + "/plumbline.toml") << fmt::format(
      "cell = \"{}\"\nstate_directory = \"{}\"\n[robot]\nprofile = \"{}/profile.toml\"\n"
      "host = \"127.0.0.1\"\nport = {}\n[payload]\nsource = \"robot\"\n[plc]\nlisten = "
      "\"127.0.0.1\"\nport = 0\n[[point]]\nid = 1\nxyz_mm = [2683.0, -424.0, 973.7]\nrpy_deg = "
      "[0.0, 90.0, 0.0]\n[[point]]\nid = 2\nxyz_mm = [2683.0, 424.0, 973.7]\nrpy_deg = [0.0, 90.0, "
      "0.0]\n",
      argv[2], folder, folder, robot.port());
  StartedDaemon daemon = StartDaemon(argv[1], folder);

  modbus_t* plc = modbus_new_tcp("127.0.0.1", daemon.port);
  std::uint16_t block[20];
  int bad = modbus_connect(plc);
  for (int wait = 0; wait < 200; ++wait) {  // wait until the point is valid
    if (modbus_read_registers(plc, 2000, 20, block) == 20 && (block[1] & 1) != 0) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  if (bad != 0 || (block[1] & 1) == 0) {
    fmt::print(stderr, "no valid point; the daemon's log:\n{}",
               plumbline::test::FileText(folder + "/log"));
    return 1;
  }

  // Round-trip time to the daemon. It also represents the round trip to the robot, which cannot be
  // measured with a second client; both are loopback.
  std::vector<double> round_trips;
  for (int k = 0; k < 2000; ++k) {
    const double start = Now_ms();
    bad += modbus_read_registers(plc, 2000, 20, block) != 20;
    round_trips.push_back(Now_ms() - start);
  }
  const double round_trip = Quantile(round_trips, 0.5);

  std::mt19937 random(1);
  std::uniform_real_distribution<double> phase(0, kCycle_ms);
  std::vector<double> latencies;
  for (int k = 0; k < changes; ++k) {
    std::this_thread::sleep_for(std::chrono::duration<double, std::milli>(30 + phase(random)));
    const double before_mm = PointX_mm(plc, bad);
    robot.SetPayload(k % 2 == 0 ? kHeavy_g : kLight_g);
    const double start = Now_ms();
    while (bad == 0 && std::abs(PointX_mm(plc, bad) - before_mm) < kLeastChange_mm) {
      if (Now_ms() - start > 1000) bad = 1;  // the cell does not deflect: nothing to measure
    }
    latencies.push_back(Now_ms() - start);
  }
  const double memory_mb = ResidentMb(daemon.process.pid());
  const bool stopped = daemon.process.End(20, SIGTERM).ok();
  modbus_free(plc);

  const double limit_ms = kCycle_ms + 2 * round_trip;
  const auto row = [&](const char* what, double fraction) {
    Report({.what = fmt::format("robot register to corrected point, {} of {}", what, changes),
            .ours = Quantile(latencies, fraction),
            .unit = "ms",
            .goal = RatioAtMost(1),
            .peer = "limit: a cycle and 2 round trips",
            .peers = limit_ms});
  };
  row("median", 0.5);
  row("99 %", 0.99);
  row("longest", 1);
  Report({.what = "resident memory of the daemon",
          .ours = memory_mb,
          .unit = "MB",
          .goal = AtMost(30),
          .timed = false});
  Report({.what = "failed requests to the daemon",
          .ours = static_cast<double>(bad),
          .goal = AtMost(0),
          .timed = false});
  if (!stopped) fmt::print(stderr, "the daemon did not end cleanly on SIGTERM\n");
  return bad == 0 && stopped ? 0 : 1;
}
