// Benchmark of the daemon from socket to socket: latency from a robot register to a corrected
// point.
#include <fmt/core.h>
#include <modbus/modbus.h>
#include <sys/wait.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "tests/bench/daemon_start.h"

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
    fmt::print(stderr, "usage: daemon_bench PLUMBLINED CELL.toml [CHANGES]\n");
    return 2;
  }
  const int changes = argc > 3 ? std::stoi(argv[3]) : 500;
  char pattern[] = "/tmp/plumbline-bench-XXXXXX";
  const std::string folder = mkdtemp(pattern);
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
  int port = 0;
  const pid_t daemon = StartDaemon(argv[1], folder, port);

  modbus_t* plc = modbus_new_tcp("127.0.0.1", port);
  std::uint16_t block[20];
  int bad = modbus_connect(plc);
  for (int wait = 0; wait < 200; ++wait) {  // wait until the point is valid
    if (modbus_read_registers(plc, 2000, 20, block) == 20 && (block[1] & 1) != 0) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  if (bad != 0 || (block[1] & 1) == 0) {
    fmt::print(stderr, "no valid point; see {}/log\n", folder);
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
  const double memory_mb = ResidentMb(daemon);
  kill(daemon, SIGTERM);
  int status = 0;
  waitpid(daemon, &status, 0);
  modbus_free(plc);

  const double limit = kCycle_ms + 2 * round_trip;
  fmt::print("| what | ours | peer | ratio | target | met |\n|---|---|---|---|---|---|\n");
  const auto row = [&](const char* what, double ours) {
    fmt::print(
        "| robot register to corrected point, {} of {} | {:.2f} ms | {:.2f} ms (a cycle + 2 "
        "round trips) | {:.2f} | <= 1.0 | {} |\n",
        what, changes, ours, limit, ours / limit, ours <= limit ? "yes" : "NO");
  };
  row("median", Quantile(latencies, 0.5));
  row("99 %", Quantile(latencies, 0.99));
  row("worst", Quantile(latencies, 1));
  fmt::print("| resident memory of the daemon | {:.1f} MB | | | <= 30 MB | {} |\n", memory_mb,
             memory_mb <= 30 ? "yes" : "NO");
  fmt::print("| failed requests; exit code of the daemon | {}; {} | | | 0; 0 | {} |\n", bad,
             WEXITSTATUS(status), bad == 0 && status == 0 ? "yes" : "NO");
  return bad == 0 && status == 0 ? 0 : 1;
}
