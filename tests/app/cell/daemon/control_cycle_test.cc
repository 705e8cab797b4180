#include "app/cell/daemon/control_cycle.h"

#include <sched.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <filesystem>
#include <numeric>

#include "drivers/real_time.h"
#include "tests/file_text.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::control_cycle_test {

using namespace plumbline::cell;

namespace {

/// A controller that never answers, and blocks for a while each time.
class SilentRobot : public robot::RobotDevice {
 public:
  robot::LinkResult Read(model::RobotState&) override {
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    return robot::LinkResult::kTimeout;
  }
  robot::LinkResult Push(std::span<const robot::PushPoint>) override {
    return robot::LinkResult::kOk;
  }
  robot::LinkResult WithdrawAll(double) override { return robot::LinkResult::kOk; }
  std::string_view problem() const override { return "silent"; }
};

/// A controller of a robot at standstill that answers at once.
class SteadyRobot : public robot::RobotDevice {
 public:
  explicit SteadyRobot(model::JointVector q) : q_(std::move(q)) {}
  robot::LinkResult Read(model::RobotState& state) override {
    state.q = q_;
    state.payload_kg = 60;
    state.timestamp_s = MonotonicSeconds();
    ++state.sequence;
    return robot::LinkResult::kOk;
  }
  robot::LinkResult Push(std::span<const robot::PushPoint>) override {
    return robot::LinkResult::kOk;
  }
  robot::LinkResult WithdrawAll(double) override { return robot::LinkResult::kOk; }
  std::string_view problem() const override { return ""; }

 private:
  model::JointVector q_;
};

/// Eight points that the arm reaches, half of them without the posture in which they were taught.
config::DaemonConfig ReachableConfig() {
  config::DaemonConfig config;
  config.machine.cell = test::HeavyArm();
  config.machine.plausibility.stale_after_s = 5;  // also on a busy machine
  config.cycle_period_s = 0.005;
  model::JointVector taught(6);
  taught << 0.2, 0.4, 0.3, 0.5, 0.8, -0.4;
  const deflection::LoadedArm arm(config.machine.cell);
  for (int id = 1; id <= 8; ++id) {
    correction::AssemblyPoint& point = config.machine.points.emplace_back();
    point.id = id;
    model::JointVector q = taught;
    q[0] += 0.05 * id;
    point.X_WP = config.machine.cell.robot.X_WB * arm.UnloadedTip(q);
    if (id % 2 == 0) point.near_q = q;
  }
  return config;
}

std::unique_ptr<CycleParts> PartsWith(int points) {
  config::DaemonConfig config;
  config.machine.cell = test::HeavyArm();
  config.cycle_period_s = 0.1;
  for (int id = 1; id <= points; ++id) config.machine.points.emplace_back().id = id;
  return std::make_unique<CycleParts>(config, std::make_unique<SilentRobot>(), 1);
}

/// A running control cycle with its surroundings.
struct RunningCycle {
  std::unique_ptr<CycleParts> parts = PartsWith(1);
  Latest<modbus::RegisterImage> images{1, FirstImage()};
  modbus::ImageHandler handler{images, EmptyCommandArea(), {}};
  CycleMailboxes mailboxes;
  ControlCycle cycle{std::move(parts), handler, images, mailboxes, 1, nullptr};

  RunningCycle() { cycle.Start(); }
  modbus::RegisterImage FirstImage() const {
    modbus::RegisterImage image;
    image.readable = parts->readable;
    return image;
  }
};

/// Policies of this process's threads of that name.
std::vector<int> PoliciesOf(const std::string& name) {
  std::vector<int> policies;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    if (test::FileText(task.path() / "comm") != name + "\n") continue;
    policies.push_back(sched_getscheduler(std::stoi(task.path().filename())));
  }
  return policies;
}

/// Whether a thread of this process may become real-time at all.
bool MayBeRealTime() {
  bool may = false;
  std::thread([&may] {
    SetRealTimePriority(kCyclePriority, "probe");
    may = sched_getscheduler(0) == SCHED_FIFO;
  }).join();
  return may;
}

/// Waits for a number of cycles, at most a minute.
void AwaitCycles(const ControlCycle& cycle, std::uint64_t count) {
  for (int k = 0; k < 6000 && cycle.counters().cycles < count; ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  REQUIRE(cycle.counters().cycles >= count);
}

}  // namespace

TEST_CASE("the control cycle and the robot thread run at real-time priority") {
  if (!MayBeRealTime()) {
    WARN("SKIPPED: no real-time priority here (ulimit -r)");
    return;
  }
  const RunningCycle running;
  AwaitCycles(running.cycle, 2);
  CHECK(PoliciesOf("cycle") == std::vector{SCHED_FIFO});
  CHECK(PoliciesOf("robot") == std::vector{SCHED_FIFO});
}

TEST_CASE("the lateness of every cycle start is counted") {
  const RunningCycle running;
  AwaitCycles(running.cycle, 3);
  const CycleCounters counters = running.cycle.counters();
  const auto& counts = counters.starts.counts;
  const auto sum = std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
  CHECK(sum >= counters.cycles);  // one more if a cycle is in progress
  CHECK(sum <= counters.cycles + 2);
  CHECK(counters.starts.sum_s > 0);
}

TEST_CASE("a lateness is counted in the class of the first bound that it does not exceed") {
  LatenessRecorder recorder;
  for (const double late_s : {-1e-6, 20e-6, 21e-6, 5e-3, 0.5}) recorder.Add(late_s);
  const LatenessHistogram counts = recorder.Counts();
  CHECK(counts.counts[0] == 2);
  CHECK(counts.counts[1] == 1);
  CHECK(counts.counts.back() == 1);
  CHECK(std::accumulate(counts.counts.begin(), counts.counts.end(), std::uint64_t{0}) == 5);
  CHECK(counts.sum_s == Approx(0.505041));
}

TEST_CASE("after a replacement the newest snapshot is one of the new configuration") {
  RunningCycle running;
  ControlCycle& cycle = running.cycle;
  for (const int points : {2, 3, 1}) {
    cycle.Replace(PartsWith(points));
    CHECK(cycle.ReadSnapshot()->points.size() == static_cast<std::size_t>(points));
  }
}

TEST_CASE("another model over the same robot link withdraws no point and raises no alarm") {
  config::DaemonConfig config = ReachableConfig();
  const config::DaemonConfig softer = [&] {
    config::DaemonConfig other = config;
    other.machine.cell.robot.joints[1].compliance_rad_per_Nm = 1.2e-6;
    return other;
  }();
  auto parts = std::make_unique<CycleParts>(
      config, std::make_unique<SteadyRobot>(*config.machine.points[1].near_q), 1);
  Latest<modbus::RegisterImage> images{1, {}};
  modbus::ImageHandler handler{images, EmptyCommandArea(), {}};
  CycleMailboxes mailboxes;
  ControlCycle cycle(std::move(parts), handler, images, mailboxes, 1, nullptr);
  cycle.Start();
  const auto all_valid = [](const Snapshot& snapshot) {
    return std::all_of(snapshot.points.begin(), snapshot.points.end(),
                       [](const PointResult& point) { return point.valid; });
  };
  for (int k = 0; k < 6000 && !all_valid(*cycle.ReadSnapshot()); ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  const Snapshot first = *cycle.ReadSnapshot();
  REQUIRE(all_valid(first));
  static_cast<void>(cycle.TakeAlarms());

  std::atomic<bool> ended{false};
  std::uint64_t images_seen = 0, withdrawn = 0, alarmed = 0;
  std::thread reader([&] {
    std::uint16_t refreshed = 0;
    while (!ended) {
      const auto image = images.Read();
      if (image->registers.size() < plc::registers::kPoints + 8 * plc::registers::kPointSize)
        continue;
      const auto word = [&](std::size_t at) { return image->registers[at]; };
      images_seen += word(plc::registers::kPoints + 19) != refreshed ? 1 : 0;
      refreshed = word(plc::registers::kPoints + 19);
      for (std::size_t k = 0; k < 8; ++k) {
        withdrawn +=
            (word(plc::registers::kPoints + plc::registers::kPointSize * k + 1) & 1) == 0 ? 1 : 0;
      }
      alarmed += word(12) != 0 ? 1 : 0;
    }
  });
  Vec3 command_before = first.points[0].correction.X_BP_command.p;
  for (int version = 2; version <= 21; ++version) {
    auto next = std::make_unique<CycleParts>(version % 2 == 0 ? softer : config, cycle.parts().link,
                                             version);
    cycle.Replace(std::move(next));
    const Vec3 command = cycle.ReadSnapshot()->points[0].correction.X_BP_command.p;
    CHECK((command - command_before).norm() > 1e-4);  // in force at once
    command_before = command;
  }
  const Snapshot last = *cycle.ReadSnapshot();
  ended = true;
  reader.join();
  CHECK(images_seen > 20);
  CHECK(withdrawn == 0);
  CHECK(alarmed == 0);
  CHECK(cycle.TakeAlarms() == 0);
  // Each point was refreshed in each cycle, including those whose image was not read.
  for (std::size_t k = 0; k < 8; ++k) {
    CHECK(static_cast<std::uint16_t>(last.points[k].sequence - first.points[k].sequence) ==
          static_cast<std::uint16_t>(last.cycle - first.cycle));
  }
}

}  // namespace plumbline::control_cycle_test
