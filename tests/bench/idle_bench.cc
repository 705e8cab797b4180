// Benchmark of the daemon at idle: its processor time beside a bare libmodbus client that reads the
// same registers of the same robot every 10 ms.
#include <fmt/core.h>
#include <modbus/modbus.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "tests/bench/daemon_start.h"
#include "tests/bench/rows.h"

namespace os = plumbline::os;
using namespace plumbline::bench;

namespace {

constexpr long kPeriod_ns = 10'000'000;

/// Processor time of each thread of a process so far [s], with its name.
std::vector<std::pair<std::string, double>> ThreadTimes_s(pid_t pid) {
  std::vector<std::pair<std::string, double>> times;
  std::error_code gone;
  for (const auto& task :
       std::filesystem::directory_iterator(fmt::format("/proc/{}/task", pid), gone)) {
    double ns = 0;
    std::string name;
    std::ifstream(task.path() / "schedstat") >> ns;
    std::getline(std::ifstream(task.path() / "comm"), name);
    times.emplace_back(task.path().filename().string() + " " + name, 1e-9 * ns);
  }
  return times;
}

/// Share of one processor that a process takes during `seconds`; with --threads also that of each
/// of its threads.
double Share(pid_t pid, double seconds, bool threads) {
  const auto before = ThreadTimes_s(pid);
  const double start_ms = Now_ms();
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  const double elapsed_s = 1e-3 * (Now_ms() - start_ms);
  double sum_s = 0;
  for (const auto& [name, time_s] : ThreadTimes_s(pid)) {
    double own_s = time_s;
    for (const auto& [other, earlier_s] : before) {
      if (other == name) own_s -= earlier_s;
    }
    sum_s += own_s;
    if (threads) fmt::print("  thread {}: {:.2f} %\n", name, 100 * own_s / elapsed_s);
  }
  return sum_s / elapsed_s;
}

/// The peer: connects, and reads the profile's registers at each tick.
[[noreturn]] void ReadForever(int port) {
  modbus_t* const robot = modbus_new_tcp("127.0.0.1", port);
  std::uint16_t registers[13];
  if (modbus_connect(robot) != 0) _exit(1);
  timespec tick{};
  clock_gettime(CLOCK_MONOTONIC, &tick);
  for (;;) {
    if (modbus_read_registers(robot, 0, 13, registers) != 13) _exit(1);
    tick.tv_nsec += kPeriod_ns;
    if (tick.tv_nsec >= 1'000'000'000) {
      tick.tv_nsec -= 1'000'000'000;
      ++tick.tv_sec;
    }
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &tick, nullptr);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 3 && std::string_view(argv[1]) == "--peer") ReadForever(std::stoi(argv[2]));
  if (argc < 3) {
    fmt::print(stderr, "usage: idle_bench PLUMBLINED CELL.toml [--smoke | --quick] [--threads]\n");
    return 2;
  }
  const Effort effort = EffortFrom(argc, argv);
  const int runs = Choose(effort, 1, 3, 7);
  const double seconds = Choose(effort, 0.5, 3.0, 5.0);
  const bool threads = std::string_view(argv[argc - 1]) == "--threads";
  const WorkFolder own;
  const std::string& folder = own.path();
  BenchRobot robot;
  robot.SetPayload(20000);
  std::ofstream(folder + "/profile.toml") << kProfile;
  std::ofstream(folder + "/plumbline.toml") << fmt::format(
      "cell = \"{}\"\nstate_directory = \"{}\"\n[robot]\nprofile = \"{}/profile.toml\"\n"
      "host = \"127.0.0.1\"\nport = {}\n[payload]\nsource = \"robot\"\n[plc]\nlisten = "
      "\"127.0.0.1\"\nport = 0\n[[point]]\nid = 1\nxyz_mm = [2683.0, -424.0, 973.7]\nrpy_deg = "
      "[0.0, 90.0, 0.0]\n",
      argv[2], folder, folder, robot.port());
  const std::string robot_port = std::to_string(robot.port());
  std::vector<double> ours, peers;
  for (int run = 0; run < runs; ++run) {  // the robot serves one client at a time
    {
      StartedDaemon daemon = StartDaemon(argv[1], folder);
      std::this_thread::sleep_for(std::chrono::seconds(1));
      ours.push_back(Share(daemon.process.pid(), seconds, threads));
      daemon.process.End(20, SIGTERM);
    }
    os::ChildProcess peer = StartProgram({argv[0], "--peer", robot_port}, folder + "/peer");
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    peers.push_back(Share(peer.pid(), seconds, false));
    peer.End(5, SIGTERM);
  }
  Report({.what = fmt::format("processor time at idle, median of {} runs", runs),
          .ours = 100 * Quantile(ours, 0.5),
          .unit = "% of a core",
          .goal = RatioAtMost(1.5),
          .peer = "libmodbus loop of 10 ms",
          .peers = 100 * Quantile(peers, 0.5)});
  return 0;
}
