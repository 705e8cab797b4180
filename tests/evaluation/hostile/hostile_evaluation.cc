// Evaluation: does a robot that misbehaves ever make a valid reading of something else?
//
// Polls ModbusRobot over TCP and on a serial line, and compares what each valid reading holds with
// what it claims: the unit asked, one refresh of both blocks, and nothing sampled before its time
// stamp. A reading is valid until it is older than 4 timeouts, also in the polls that fail.
//   hostile_evaluation [--polls N] [--kind TEXT]
//   hostile_evaluation --daemon PLUMBLINED [--seconds S]: some kinds through the daemon to a PLC
// The exit status is 1 if a reading is wrong.
#include <fmt/format.h>

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <optional>
#include <string_view>

#include "drivers/robot/registry.h"
#include "tests/evaluation/hostile/hostile_daemon.h"
#include "tests/evaluation/hostile/hostile_robot.h"

namespace {

using plumbline::model::RobotState;
using namespace plumbline::robot;  // NOLINT(google-build-using-namespace)

/// The device's clock runs faster, so that waits between attempts do not take hours.
constexpr double kFaster = 100;
constexpr double kStaleAfter_s = 4 * hostile::kTimeout_s * kFaster;
constexpr double kTick_s = 1e-4 * kFaster;
constexpr int kRuns = 20;  ///< at the same time: nearly all wait

const double g_start_s = plumbline::MonotonicSeconds();

double FastClock() {
  return kFaster * (plumbline::MonotonicSeconds() - g_start_s);
}

std::uint32_t Ticks() {
  return static_cast<std::uint32_t>(FastClock() / kTick_s);
}

enum class Wire { kTcp, kRtu, kRtuOneBlock };

RegisterValue Value(int address, RegisterType type, double scale) {
  RegisterValue value;
  value.address = address;
  value.type = type;
  value.scale = scale;
  return value;
}

/// The registers of hostile_robot.h: block 1 as joints, block 2 as payload.
RobotProfile ProfileOf(Wire wire, bool refreshes) {
  RobotProfile profile;
  profile.name = "hostile";
  profile.blocks = {{RegisterTable::kHolding, 0, 12}};
  const auto word = [](int address) { return Value(address, RegisterType::kUint16, 1); };
  profile.joints.push_back({Value(0, RegisterType::kUint32, 1), JointWrap::kNone, {}});
  for (int i = 2; i < 6; ++i) profile.joints.push_back({word(i), JointWrap::kNone, {}});
  if (refreshes) profile.sequence = word(4);
  if (wire == Wire::kRtuOneBlock) return profile;
  profile.blocks.push_back({RegisterTable::kHolding, 100, wire == Wire::kTcp ? 12 : 10});
  profile.payload_mass = Value(100, RegisterType::kUint32, 1);
  profile.tool_number = word(102);
  profile.payload_item = word(103);
  profile.payload_cog = {word(104), word(105), word(104)};
  return profile;
}

struct Block {
  double time = 0;  ///< [ticks]
  int unit = 0, number = 0, refresh = 0, check = 0;

  bool Genuine(int wanted) const {
    const auto ticks = static_cast<std::uint32_t>(time);
    const unsigned sum = (ticks >> 16) * 7 + (ticks & 0xFFFF) * 5 +
                         static_cast<unsigned>(refresh * 3 + unit * 11 + number * 13);
    return unit == 1 && number == wanted && check == static_cast<int>(sum & 0xFFFF);
  }
};

Block JointsOf(const RobotState& state) {
  const auto word = [&](int i) { return static_cast<int>(state.q[i]); };
  return {state.q[0], word(1), word(2), word(3), word(4)};
}

Block PayloadOf(const RobotState& state) {
  return {*state.payload_kg, *state.tool_number, *state.payload_item,
          static_cast<int>(state.payload_cog_F->x()), static_cast<int>(state.payload_cog_F->y())};
}

struct Count {
  long polls = 0, read = 0, valid = 0, foreign = 0, torn = 0, older = 0;
  long wrong() const { return foreign + torn + older; }
};

/// One robot, one client.
class Run {
 public:
  Run(const hostile::Kind& kind, Wire wire, unsigned seed)
      : kind_(kind), wire_(wire), robot_(kind, wire != Wire::kTcp, Ticks, seed) {}

  Count Poll(long polls) {
    RobotConnection connection;
    connection.tcp = {"127.0.0.1", robot_.port()};
    connection.serial = {robot_.device(), 921600, 'N', 1};
    connection.timeout_s = hostile::kTimeout_s;
    connection.profile = ProfileOf(wire_, Refreshes());
    connection.clock = FastClock;
    auto device = MakeRobot(wire_ == Wire::kTcp ? "tcp" : "rtu", connection);
    if (!device) throw std::runtime_error(device.error());
    RobotState state;
    while (count_.polls < polls) {
      const LinkResult result = device.value()->Read(state);
      if (result == LinkResult::kWaiting) {
        plumbline::SleepSeconds(2e-4);
        continue;
      }
      ++count_.polls;
      count_.read += result == LinkResult::kOk ? 1 : 0;
      if (state.sequence > 0 && FastClock() - state.timestamp_s <= kStaleAfter_s) Judge(state);
    }
    return count_;
  }

 private:
  bool Refreshes() const { return kind_.refresh != hostile::Refresh::kAtRequest; }

  void Judge(const RobotState& state) {
    ++count_.valid;
    if (!first_s_) first_s_ = state.timestamp_s;
    const Block joints = JointsOf(state);
    const std::optional<Block> payload =
        wire_ == Wire::kRtuOneBlock ? std::nullopt : std::optional(PayloadOf(state));
    if (!joints.Genuine(1) || (payload && !payload->Genuine(2))) {
      ++count_.foreign;
    } else if (Refreshes() && payload && payload->refresh != joints.refresh) {
      ++count_.torn;
    } else if (kind_.refresh == hostile::Refresh::kNever) {
      count_.older += state.timestamp_s > *first_s_ ? 1 : 0;
    } else if (!Refreshes()) {
      const double oldest = std::min(joints.time, payload ? payload->time : joints.time);
      count_.older += kTick_s * (oldest + 1) < state.timestamp_s ? 1 : 0;
    }
  }

  hostile::Kind kind_;
  Wire wire_;
  hostile::HostileRobot robot_;
  Count count_;
  std::optional<double> first_s_;
};

struct Task {
  hostile::Kind kind;
  Wire wire;
  std::optional<Count> count;
};

std::string_view NameOf(Wire wire) {
  return wire == Wire::kTcp ? "TCP" : wire == Wire::kRtu ? "RTU" : "RTU, one block";
}

void PrintTable(const std::vector<Task>& tasks) {
  fmt::print("{:<53} {:<14} {:>6} {:>6} {:>6} {:>7} {:>6} {:>6}\n", "the robot", "line", "polls",
             "read", "valid", "foreign", "torn", "older");
  for (const Task& task : tasks) {
    const Count& c = *task.count;
    fmt::print("{:<53} {:<14} {:>6} {:>6} {:>6} {:>7} {:>6} {:>6}{}\n", task.kind.name,
               NameOf(task.wire), c.polls, c.read, c.valid, c.foreign, c.torn, c.older,
               task.kind.limit ? "  cannot be told apart" : "");
  }
}

int Evaluate(long polls, std::string_view wanted) {
  std::vector<Task> tasks;
  for (const hostile::Kind& kind : hostile::Kinds()) {
    if (std::string_view(kind.name).find(wanted) == std::string_view::npos) continue;
    if (kind.tcp) tasks.push_back({kind, Wire::kTcp, {}});
    if (!kind.rtu) continue;
    tasks.push_back({kind, Wire::kRtu, {}});
    if (kind.refresh == hostile::Refresh::kAtRequest)
      tasks.push_back({kind, Wire::kRtuOneBlock, {}});
  }
  std::atomic<std::size_t> next = 0;
  std::vector<std::thread> threads;
  for (int i = 0; i < kRuns; ++i) {
    threads.emplace_back([&] {
      for (std::size_t k = next++; k < tasks.size(); k = next++) {
        tasks[k].count = Run(tasks[k].kind, tasks[k].wire, static_cast<unsigned>(k)).Poll(polls);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  PrintTable(tasks);
  long wrong = 0, valid = 0, correct = 0;
  for (const Task& task : tasks) {
    if (!task.kind.limit) wrong += task.count->wrong();
    valid += task.count->valid;
    // A robot that answers correctly must be read, or the zeros above mean nothing.
    if (task.kind.name == hostile::Kinds().front().name) correct += task.count->valid;
  }
  fmt::print("valid readings {}, of these foreign, torn or older than they claim: {} (goal 0)\n",
             valid, wrong);
  const bool vacuous = wanted.empty() && correct < polls;
  if (vacuous) fmt::print("too few readings of the robot that answers correctly: {}\n", correct);
  return wrong == 0 && !vacuous ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace

int main(int argc, char** argv) {
  long polls = 10000;
  double seconds = 60;
  std::string_view kind;
  std::string daemon;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::strcmp(argv[i], "--polls") == 0) polls = std::atol(argv[i + 1]);
    if (std::strcmp(argv[i], "--kind") == 0) kind = argv[i + 1];
    if (std::strcmp(argv[i], "--daemon") == 0) daemon = argv[i + 1];
    if (std::strcmp(argv[i], "--seconds") == 0) seconds = std::atof(argv[i + 1]);
  }
  if (!daemon.empty())
    return hostile::EvaluateDaemon(daemon, seconds) == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
  return Evaluate(polls, kind);
}
