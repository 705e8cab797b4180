// Benchmark of corrections inside the motion: answers of the daemon beside its control cycle, and
// what a controller applies on a wire where everything happens to packets.
#include <fmt/core.h>
#include <modbus/modbus.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "tests/bench/daemon_start.h"
#include "tests/bench/rows.h"
#include "tests/drivers/motion/virtual_client.h"
#include "tests/motion_robots/egm_robot.h"
#include "tests/motion_robots/rsi_robot.h"
#include "tests/motion_robots/udp_peer.h"

using namespace plumbline::bench;
using plumbline::test::VirtualClient;
using plumbline::test::VirtualSettings;

namespace {

constexpr double kCycle_ms = 4;
constexpr double kResolution = 1e-5;  // of an answer's six decimals, in shares of a limit
/// Those of BenchRobot.
constexpr double kJoints_rad[] = {0.2, -1.4, 1.6, -0.9, -1.3, 0.3};

std::unique_ptr<motion_robots::Controller> MakeController(const std::string& kind,
                                                          motion_robots::AppliedOptions applied) {
  if (kind == "egm")
    return std::make_unique<motion_robots::EgmRobot>(motion_robots::EgmOptions{applied});
  return std::make_unique<motion_robots::RsiRobot>(motion_robots::RsiOptions{applied});
}

/// Everything that can happen to packets, in virtual time.
void BenchHostileWire(long packets) {
  double jump = 0, size = 0;
  long sent = 0, corrected = 0, stops = 0;
  std::size_t kinds = 0;
  unsigned seed = 11;
  std::array<long, motion_robots::kKinds> happened{};
  for (const std::string kind : {"rsi", "egm"}) {
    for (const bool hold_on : {true, false}) {
      const auto settings = VirtualSettings(kind, hold_on);
      motion_robots::AppliedOptions applied;
      applied.hold_on = hold_on;
      const auto controller = MakeController(kind, applied);
      VirtualClient client(settings);
      client.SetJoints({0, 20, 10, 0, 45, 0});
      motion_robots::HostileWire wire(*controller, client, {.trouble = 0.01, .seed = seed++});
      while (wire.packets() < packets / 4) wire.Run(1000);
      const motion_robots::AppliedOffset& offset = controller->offset();
      jump = std::max(jump, 1e-3 * offset.largest_jump_mm() / settings.limits.max_jump_m);
      size = std::max(size, 1e-3 * offset.largest_mm() / settings.limits.max_translation_m);
      sent += wire.packets();
      corrected += offset.corrected();
      stops += offset.stops();
      for (std::size_t k = 0; k < happened.size(); ++k) happened[k] += wire.happened()[k];
    }
  }
  for (std::size_t k = 0; k < happened.size(); ++k) {
    fmt::print("  {:8} {}\n", happened[k], motion_robots::kHostileKinds[k]);
    if (happened[k] > 0) ++kinds;
  }
  fmt::print("  {} packets, {} cycles with an offset, {} stops by the controller's timeout\n", sent,
             corrected, stops);
  Report({.what = fmt::format("largest jump that a controller applies, {} packets of {} kinds of "
                              "trouble, RSI and EGM, HOLDON 1 and 0",
                              sent, kinds),
          .ours = jump - kResolution,
          .unit = "of max_jump_mm",
          .goal = AtMost(1),
          .timed = false});
  Report({.what = "largest offset that a controller applies, the same packets",
          .ours = size - kResolution,
          .unit = "of max_offset_mm",
          .goal = AtMost(1),
          .timed = false});
}

std::string Config(const std::string& cell, const std::string& folder, int robot_port,
                   const std::string& kind, int motion_port) {
  return fmt::format(
      "cell = \"{}\"\nstate_directory = \"{}\"\n[robot]\nprofile = \"{}/profile.toml\"\n"
      "host = \"127.0.0.1\"\nport = {}\n[payload]\nsource = \"robot\"\n[plc]\nlisten = "
      "\"127.0.0.1\"\nport = 0\n[correction]\nmax_translation_mm = 50.0\nmax_rotation_deg = "
      "5.0\n[motion]\nenabled = true\nkind = \"{}\"\nrobot = \"127.0.0.1\"\nlisten = "
      "\"127.0.0.1\"\nport = {}\nonly_taught_targets = true\ncycle_ms = 4\ntimeout_ms = "
      "40\nmax_offset_mm = 20\n"
      "rate_mm_per_s = 20\nmax_jump_mm = 1\nwidest_radius_mm = 100\nweakest_basis = \"assumed\"\n"
      "[[point]]\nid = 1\nxyz_mm = [2683.0, -424.0, 973.7]\nrpy_deg = [0.0, 90.0, 0.0]\n",
      cell, folder, folder, robot_port, kind, motion_port);
}

/// A PLC that allows corrections and keeps its heartbeat going.
class Plc {
 public:
  explicit Plc(int port) : link_(modbus_new_tcp("127.0.0.1", port)) {
    modbus_connect(link_);
    thread_ = std::thread([this] {
      for (std::uint16_t beat = 1; !stop_; ++beat) {
        const std::uint16_t words[] = {beat, 2};
        modbus_write_registers(link_, 1030, 2, words);
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
      }
    });
  }
  ~Plc() {
    stop_ = true;
    thread_.join();
    modbus_close(link_);
    modbus_free(link_);
  }

 private:
  modbus_t* link_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

/// The peer: answers each datagram with itself.
[[noreturn]] void EchoForever(int port) {
  const int fd = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_port = htons(static_cast<std::uint16_t>(port));
  own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (bind(fd, reinterpret_cast<const sockaddr*>(&own), sizeof own) != 0) _exit(1);
  std::vector<char> bytes(2048);
  for (;;) {
    sockaddr_in from{};
    socklen_t size = sizeof from;
    const ssize_t got =
        recvfrom(fd, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
    if (got > 0)
      sendto(fd, bytes.data(), static_cast<std::size_t>(got), 0,
             reinterpret_cast<const sockaddr*>(&from), size);
  }
}

/// Times of the answers [ms], one packet per cycle; a missing one counts as 1000.
std::vector<double> AnswerTimes_ms(motion_robots::Controller& controller, int port, int cycles) {
  const motion_robots::UdpPeer wire;
  std::vector<double> times;
  double next_ms = Now_ms();
  for (int k = 0; k < cycles; ++k) {
    const double start_ms = Now_ms();
    wire.Send(controller.BeginCycle(), port);
    const std::string answer = wire.Receive(static_cast<int>(kCycle_ms));
    times.push_back(answer.empty() ? 1000 : Now_ms() - start_ms);
    if (!answer.empty()) controller.Receive(answer);
    controller.EndCycle();
    if (controller.offset().stopped()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
      controller.Start();
      next_ms = Now_ms();
    }
    next_ms += kCycle_ms;
    const double left_ms = next_ms - Now_ms();
    if (left_ms > 0)
      std::this_thread::sleep_for(std::chrono::duration<double, std::milli>(left_ms));
    else
      next_ms = Now_ms();
  }
  return times;
}

double ShareWithin(const std::vector<double>& times_ms, double bound_ms) {
  const auto within = std::count_if(times_ms.begin(), times_ms.end(),
                                    [&](double time_ms) { return time_ms <= bound_ms; });
  return static_cast<double>(within) / static_cast<double>(times_ms.size());
}

struct Programs {
  std::string own, daemon, cell;
};

void BenchAnswers(const std::string& kind, const Programs& programs, int cycles, int kills) {
  const WorkFolder folder;
  BenchRobot robot;
  robot.SetPayload(20000);
  std::ofstream(folder.path() + "/profile.toml") << kProfile;
  const int port = motion_robots::UdpPeer::FreePort();
  std::ofstream(folder.path() + "/plumbline.toml")
      << Config(programs.cell, folder.path(), robot.port(), kind, port);
  motion_robots::AppliedOptions applied;
  applied.limit_mm = 50;
  const auto controller = MakeController(kind, applied);
  for (std::size_t k = 0; k < 6; ++k)
    controller->joints_deg[k] = kJoints_rad[k] * 57.29577951308232;
  std::vector<double> ours;
  for (int life = 0; life <= kills; ++life) {
    StartedDaemon daemon = StartDaemon(programs.daemon, folder.path());
    const Plc plc(daemon.port);
    std::this_thread::sleep_for(std::chrono::seconds(1));
    if (controller->offset().stopped()) controller->Start();
    const auto times = AnswerTimes_ms(*controller, port, cycles / (kills + 1));
    ours.insert(ours.end(), times.begin(), times.end());
    if (life == kills) {
      daemon.process.End(20, SIGTERM);
      break;
    }
    daemon.process.End(0, SIGKILL);  // the controller runs on, with nobody there
    const motion_robots::UdpPeer wire;
    while (!controller->offset().stopped()) {
      wire.Send(controller->BeginCycle(), port);
      controller->EndCycle();
      std::this_thread::sleep_for(std::chrono::milliseconds(4));
    }
  }
  const int echo_port = motion_robots::UdpPeer::FreePort();
  const auto echo = MakeController(kind, applied);
  auto peer =
      StartProgram({programs.own, "--echo", std::to_string(echo_port)}, folder.path() + "/echo");
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  std::vector<double> peers = AnswerTimes_ms(*echo, echo_port, std::min(cycles, 2500));
  peer.End(5, SIGTERM);
  const std::string name = kind == "rsi" ? "RSI" : "EGM";
  Report({.what = fmt::format("{} at 4 ms: packets answered within 1 ms beside the control cycle, "
                              "of {}",
                              name, ours.size()),
          .ours = 100 * ShareWithin(ours, 1),
          .unit = "%",
          .goal = {"ours", ">=", 99.9},
          .peer = "bare UDP echo",
          .peers = 100 * ShareWithin(peers, 1)});
  Report({.what = fmt::format("{} at 4 ms: answer, median", name),
          .ours = Quantile(ours, 0.5),
          .unit = "ms",
          .peer = "bare UDP echo",
          .peers = Quantile(peers, 0.5)});
  Report({.what = fmt::format("{}: largest jump that the controller applies, daemon killed {} "
                              "times in a corrected motion",
                              name, kills),
          .ours = controller->offset().largest_jump_mm(),
          .unit = "mm",
          .goal = AtMost(1),
          .timed = false});
  fmt::print("  {} cycles with an offset, up to {:.3f} mm\n", controller->offset().corrected(),
             controller->offset().largest_mm());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 3 && std::string_view(argv[1]) == "--echo") EchoForever(std::stoi(argv[2]));
  if (argc < 3) {
    fmt::print(stderr, "usage: motion_bench PLUMBLINED CELL.toml [--smoke | --quick]\n");
    return 2;
  }
  const Effort effort = EffortFrom(argc, argv);
  BenchHostileWire(Choose(effort, 20'000L, 200'000L, 1'000'000L));
  const Programs programs{argv[0], argv[1], argv[2]};
  for (const std::string kind : {"rsi", "egm"}) {
    BenchAnswers(kind, programs, Choose(effort, 500, 5000, 25000), Choose(effort, 1, 2, 4));
  }
  return 0;
}
