// Benchmark of the link to a Universal Robots controller: from a state that the controller sends to
// the corrected point in its input registers, and what the joints lose on the way.
#include <fmt/core.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <fstream>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "app/base/config/cell_reader.h"
#include "drivers/real_time.h"
#include "drivers/robot/rtde_codec.h"
#include "firmware-like/kinematics/chain.h"
#include "tests/bench/daemon_start.h"
#include "tests/bench/rows.h"
#include "tests/virtual_ur/rtde_server.h"

using namespace plumbline;
using namespace plumbline::bench;
using virtual_ur::RtdeServer;

namespace {

constexpr double kLight_kg = 20, kHeavy_kg = 24;
constexpr double kPeriod_ms = 2;

// Latency.

/// Controller whose payload changes at random cycles; measures until the point follows.
class LatencyRobot {
 public:
  explicit LatencyRobot(int changes) : changes_(changes) {
    virtual_ur::UrState& state = server_.state();
    state.actual_q = {0.2, -1.4, 1.6, -0.9, -1.3, 0.3};
    state.payload = kLight_kg;
    server_.on_outputs = [this] { BeforePackage(); };
    server_.on_inputs = [this] { AfterInputs(); };
    thread_ = std::thread([this] {
      SetRealTimePriority(kRobotPriority, "controller");
      for (double next_s = virtual_ur::MonotonicNow(); !stop_;) {
        next_s += RtdeServer::kCycle_s;
        server_.Serve(next_s);
        server_.Advance();
      }
    });
  }
  ~LatencyRobot() {
    stop_ = true;
    thread_.join();
  }

  int port() const { return server_.port(); }
  bool done() const { return done_; }
  /// Milliseconds; once done().
  const std::vector<double>& latencies() const { return latencies_; }

 private:
  void BeforePackage() {
    const virtual_ur::UrState& state = server_.state();
    if (state.input_int[25] == 0 || waiting_ || done_ || --pause_ > 0) return;
    before_m_ = state.input_double[24];
    server_.state().payload = state.payload == kLight_kg ? kHeavy_kg : kLight_kg;
    sent_s_ = virtual_ur::MonotonicNow();
    waiting_ = true;
  }
  void AfterInputs() {
    constexpr double kLeastChange_m = 1e-6;
    const double x_m = server_.state().input_double[24];
    if (!waiting_ || std::abs(x_m - before_m_) < kLeastChange_m) return;
    latencies_.push_back(1e3 * (virtual_ur::MonotonicNow() - sent_s_));
    waiting_ = false;
    pause_ = std::uniform_int_distribution<int>(10, 20)(random_);
    if (static_cast<int>(latencies_.size()) >= changes_) done_ = true;
  }

  RtdeServer server_;
  const int changes_;
  std::atomic<bool> stop_{false}, done_{false};
  bool waiting_ = false;
  int pause_ = 200;
  double before_m_ = 0, sent_s_ = 0;
  std::vector<double> latencies_;
  std::mt19937 random_{1};
  std::thread thread_;
};

std::string Configuration(const std::string& cell, const std::string& folder,
                          const std::string& robot) {
  return fmt::format(
      "cell = \"{}\"\nstate_directory = \"{}\"\n[robot]\nhost = \"127.0.0.1\"\n{}\n[cycle]\n"
      "period_ms = {}\n[payload]\nsource = \"robot\"\n[plc]\nlisten = \"127.0.0.1\"\nport = 0\n"
      "[push]\nenabled = true\npoint_ids = [1]\nmax_step_mm = 50.0\nmin_period_ms = 10\n"
      "[[point]]\nid = 1\nxyz_mm = [2683.0, -424.0, 973.7]\nrpy_deg = [0.0, 90.0, 0.0]\n",
      cell, folder, robot, kPeriod_ms);
}

/// Waits at most that long for a condition.
template <typename Condition>
bool Await(double seconds, Condition holds) {
  const double until_ms = Now_ms() + 1e3 * seconds;
  while (!holds()) {
    if (Now_ms() > until_ms) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

[[noreturn]] void GiveUp(const std::string& folder) {
  fmt::print(stderr, "no corrected point arrived; the daemon's log:\n{}",
             test::FileText(folder + "/log"));
  std::exit(1);
}

std::vector<double> RtdeLatencies(const char* program, const char* cell, int changes) {
  const WorkFolder folder;
  LatencyRobot robot(changes);
  std::ofstream(folder.path() + "/plumbline.toml") << Configuration(
      cell, folder.path(),
      fmt::format("transport = \"rtde\"\nport = {}\nrtde_hz = 500\nrtde_fields = [\"payload\"]",
                  robot.port()));
  StartedDaemon daemon = StartDaemon(program, folder.path());
  if (!Await(30 + 0.1 * changes, [&] { return robot.done(); })) GiveUp(folder.path());
  daemon.process.End(20, SIGTERM);
  return robot.latencies();
}

// The same over Modbus, with a cycle of the same length.

constexpr const char* kPush = R"([push]
first = 20
slots = 1
stride = 14
id_place = 12
pose_place = 0
sequence_place = 13
type = "float32"
position_step_mm = 1.0
angle_step_mrad = 1.0
convention = "rotation_vector"
)";

std::vector<double> ModbusLatencies(const char* program, const char* cell, int changes) {
  constexpr int kPose = 20, kSequence = 33;
  const WorkFolder folder;
  BenchRobot robot;
  robot.SetPayload(static_cast<std::uint16_t>(1e3 * kLight_kg));
  std::ofstream(folder.path() + "/profile.toml") << kProfile << kPush;
  std::ofstream(folder.path() + "/plumbline.toml") << Configuration(
      cell, folder.path(),
      fmt::format("profile = \"{}/profile.toml\"\nport = {}", folder.path(), robot.port()));
  StartedDaemon daemon = StartDaemon(program, folder.path());
  if (!Await(30, [&] { return robot.Register(kSequence) != 0; })) GiveUp(folder.path());
  std::mt19937 random(1);
  std::uniform_real_distribution<double> phase_ms(30, 40);
  std::vector<double> latencies;
  bool heavy = false;
  const auto x = [&] { return robot.Register(kPose) << 16 | robot.Register(kPose + 1); };
  for (int k = 0; k < changes; ++k) {
    std::this_thread::sleep_for(std::chrono::duration<double, std::milli>(phase_ms(random)));
    const int before = x();
    heavy = !heavy;
    robot.SetPayload(static_cast<std::uint16_t>(1e3 * (heavy ? kHeavy_kg : kLight_kg)));
    const double start_ms = Now_ms();
    // The new point counts once it is valid again.
    while (x() == before || robot.Register(kSequence) == 0) {
      if (Now_ms() - start_ms > 5000) GiveUp(folder.path());
      std::this_thread::sleep_for(std::chrono::microseconds(50));
    }
    latencies.push_back(Now_ms() - start_ms);
  }
  daemon.process.End(20, SIGTERM);
  return latencies;
}

// Quantisation.

/// Largest distance between the tip of joints as they are and as a link reports them [um].
struct Quantisation {
  double rtde_um = 0, modbus_um = 0;
};

Quantisation QuantisationAtTip(const std::string& cell_file, int postures) {
  using robot::rtde::Output;
  config::FaultList faults;
  const auto cell = config::ReadCell(cell_file, faults);
  if (!cell) {
    fmt::print(stderr, "{} cannot be read\n", cell_file);
    std::exit(1);
  }
  const kinematics::Chain chain(cell->robot);
  const std::vector<Output> fields{Output::kTimestamp, Output::kJoints};
  const robot::rtde::OutputLayout layout(fields, 2, 1);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> angle(-3, 3);
  Quantisation largest;
  const auto tip = [&](const model::JointVector& q) {
    kinematics::Posture posture;
    chain.Evaluate(q, posture);
    return posture.X_BF().p;
  };
  for (int k = 0; k < postures; ++k) {
    model::JointVector q(6), rounded(6);
    std::vector<std::uint8_t> package{1, 0, 0, 0, 0, 0, 0, 0, 0};
    for (int j = 0; j < 6; ++j) {
      q[j] = angle(random);
      rounded[j] = 1e-3 * std::round(1e3 * q[j]);
      std::uint64_t bits = 0;
      std::memcpy(&bits, &q[j], sizeof bits);
      for (int shift = 56; shift >= 0; shift -= 8) {
        package.push_back(static_cast<std::uint8_t>(bits >> shift));
      }
    }
    model::RobotState state;
    layout.RobotStateFromPackage(package, state);
    largest.rtde_um = std::max(largest.rtde_um, 1e6 * (tip(state.q) - tip(q)).norm());
    largest.modbus_um = std::max(largest.modbus_um, 1e6 * (tip(rounded) - tip(q)).norm());
  }
  return largest;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    fmt::print(stderr, "usage: rtde_bench PLUMBLINED CELL.toml UR.toml [--smoke | --quick]\n");
    return 2;
  }
  const Effort effort = EffortFrom(argc, argv);
  const int changes = Choose(effort, 20, 300, 2000);
  const Quantisation quantisation = QuantisationAtTip(argv[3], 10000);
  Report({.what = "joints over RTDE: largest error at the flange",
          .ours = quantisation.rtde_um,
          .unit = "um",
          .goal = AtMost(1),
          .peer = "Modbus registers of 1 mrad",
          .peers = quantisation.modbus_um,
          .timed = false});
  const std::vector<double> ours = RtdeLatencies(argv[1], argv[2], changes);
  const std::vector<double> peers = ModbusLatencies(argv[1], argv[2], std::min(changes, 300));
  const auto row = [&](const char* what, double fraction, Goal goal) {
    Report({.what = fmt::format("state to corrected point in the registers, 500 Hz, {} of {}", what,
                                changes),
            .ours = Quantile(ours, fraction),
            .unit = "ms",
            .goal = goal,
            .peer = "Modbus push, cycle of 2 ms",
            .peers = Quantile(peers, fraction)});
  };
  row("median", 0.5, {});
  row("99 %", 0.99, AtMost(3));
  row("longest", 1, {});
  return 0;
}
