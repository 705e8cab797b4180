#include "drivers/robot/robot_link.h"

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <functional>

#include "drivers/robot/registry.h"
#include "tests/drivers/robot/fake_controller.h"
#include "tests/drivers/robot/small_profile.h"
#include "tests/drivers/robot/test_time.h"

namespace plumbline::robot_link_test {

using namespace plumbline::robot;

namespace {

using std::chrono::steady_clock;

steady_clock::time_point Soon() {
  return steady_clock::now() + std::chrono::seconds(10);
}

/// Device controlled by the test that detects concurrent use by two threads.
class ScriptedRobot : public RobotDevice {
 public:
  struct Script {
    std::function<LinkResult(model::RobotState&)> read;
    std::function<LinkResult(std::span<const PushPoint>)> push;
    std::function<LinkResult()> withdraw{};
  };
  explicit ScriptedRobot(Script script) : script_(std::move(script)) {}
  LinkResult Read(model::RobotState& state) override { return script_.read(state); }
  LinkResult Push(std::span<const PushPoint> points) override { return script_.push(points); }
  LinkResult WithdrawAll(double /*within_s*/) override {
    return script_.withdraw ? script_.withdraw() : LinkResult::kOk;
  }
  std::string_view problem() const override { return "scripted"; }

 private:
  Script script_;
};

std::unique_ptr<RobotDevice> Scripted(ScriptedRobot::Script script) {
  return std::make_unique<ScriptedRobot>(std::move(script));
}

LinkResult Count(model::RobotState& state) {
  ++state.sequence;
  state.q.setConstant(6, static_cast<double>(state.sequence));
  state.timestamp_s = static_cast<double>(state.sequence);
  return LinkResult::kOk;
}

}  // namespace

TEST_CASE("each request is served by a reading that started after it") {
  RobotLink link(Scripted({Count, {}}));
  CHECK(link.Latest().sequence == 0);
  link.Start();
  std::uint64_t last = 0;
  for (int i = 0; i < 100; ++i) {
    link.RequestRead();
    REQUIRE(link.WaitForState(Soon()));
    const model::RobotState state = link.Latest();
    CHECK(state.sequence > last);
    CHECK(state.q[5] == static_cast<double>(state.sequence));
    last = state.sequence;
  }
  CHECK(link.Status().readings == last);
  link.Stop();
  CHECK_FALSE(link.Status().reconnects > 0);
}

TEST_CASE("the cycle continues while the controller does not answer") {
  std::mutex gate;
  gate.lock();
  std::atomic<int> readings{0};
  RobotLink link(Scripted({[&](model::RobotState& state) {
                             ++readings;
                             const std::lock_guard wait(gate);
                             return Count(state);
                           },
                           {}}));
  link.Start();
  link.RequestRead();
  while (readings == 0) std::this_thread::yield();
  CHECK_FALSE(link.WaitForState(steady_clock::now() + std::chrono::milliseconds(5)));
  link.RequestRead();
  CHECK_FALSE(link.WaitForState(steady_clock::now() + std::chrono::milliseconds(5)));
  CHECK(link.Latest().sequence == 0);
  gate.unlock();
  CHECK(link.WaitForState(Soon()));
  CHECK(link.Latest().sequence == 2);  // the second request was made while the first was served
}

TEST_CASE("transitions are counted once, and the last state is retained") {
  std::atomic<LinkResult> result{LinkResult::kTimeout};
  RobotLink link(Scripted({[&result](model::RobotState& state) {
                             if (result == LinkResult::kOk) return Count(state);
                             return result.load();
                           },
                           {}}));
  link.Start();
  const auto request_and_wait = [&link] {
    link.RequestRead();
    return link.WaitForState(Soon());
  };
  CHECK_FALSE(request_and_wait());
  CHECK_FALSE(request_and_wait());
  CHECK(link.Status().changes == 0);
  CHECK(link.Status().failures == 2);
  CHECK(link.Status().problem.view() == "scripted");
  result = LinkResult::kOk;
  CHECK(request_and_wait());
  CHECK(request_and_wait());
  CHECK(link.Status().changes == 1);
  CHECK(link.Status().connected);
  CHECK(link.Status().reconnects == 0);
  result = LinkResult::kLost;
  CHECK_FALSE(request_and_wait());
  CHECK_FALSE(request_and_wait());
  CHECK(link.Status().changes == 2);
  CHECK(link.Status().result == LinkResult::kLost);
  CHECK(link.Latest().sequence == 2);
  result = LinkResult::kOk;
  CHECK(request_and_wait());
  CHECK(link.Status().changes == 3);
  CHECK(link.Status().reconnects == 1);
}

TEST_CASE("queued points are pushed once, after a successful reading") {
  std::mutex mutex;
  std::vector<std::vector<int>> pushed;
  std::atomic<LinkResult> read_result{LinkResult::kLost};
  RobotLink link(Scripted({[&](model::RobotState& state) {
                             Count(state);
                             return read_result.load();
                           },
                           [&](std::span<const PushPoint> points) {
                             const std::lock_guard lock(mutex);
                             pushed.emplace_back();
                             for (const PushPoint& p : points) pushed.back().push_back(p.id);
                             return LinkResult::kPushRefused;
                           }}));
  link.Start();
  const auto request_and_wait = [&link] {
    link.RequestRead();
    return link.WaitForState(Soon());
  };
  std::vector<PushPoint> points(2);
  points[0].id = 1;
  points[1].id = 2;
  link.QueuePush(points);
  CHECK_FALSE(request_and_wait());
  points[1].id = 3;
  link.QueuePush(points);
  read_result = LinkResult::kOk;
  CHECK(request_and_wait());
  CHECK(request_and_wait());
  CHECK(request_and_wait());
  link.QueuePush(std::vector<PushPoint>(kMaxPushPoints + 1));
  CHECK(request_and_wait());
  CHECK(request_and_wait());  // the push after the previous reading is complete
  const RobotLinkStatus status = link.Status();
  link.Stop();
  REQUIRE(pushed.size() == 2);
  CHECK(pushed[0] == std::vector{1, 3});
  CHECK(pushed[1].size() == kMaxPushPoints);
  CHECK(status.push_result == LinkResult::kPushRefused);
  CHECK(status.push_changes == 1);
  CHECK(status.push_problem.view() == "scripted");
}

TEST_CASE("points are pushed at once while the link works, without another reading") {
  std::atomic<int> pushes{0}, readings{0};
  RobotLink link(Scripted({[&](model::RobotState& state) {
                             ++readings;
                             return Count(state);
                           },
                           [&](std::span<const PushPoint>) {
                             ++pushes;
                             return LinkResult::kOk;
                           }}));
  link.Start();
  link.RequestRead();
  REQUIRE(link.WaitForState(Soon()));
  const std::vector<PushPoint> points(1);
  link.QueuePush(points);
  while (pushes == 0) std::this_thread::yield();  // ends without a request
  CHECK(readings == 1);
}

TEST_CASE("Stop() ends a wait, and a link can be restarted") {
  RobotLink link(Scripted({Count, {}}));
  link.Stop();
  link.Start();
  link.Start();
  link.RequestRead();
  CHECK(link.WaitForState(Soon()));
  link.Stop();
  link.Stop();
  link.RequestRead();
  CHECK_FALSE(link.WaitForState(Soon()));
  link.Start();
  CHECK(link.WaitForState(Soon()));
}

TEST_CASE("Stop() withdraws the pushed points, and nothing is pushed afterwards") {
  std::vector<std::string> done;  // written by the link's thread, read after it has ended
  LinkResult withdrawn = LinkResult::kOk;
  std::mutex gate;
  std::atomic<int> readings{0};
  RobotLink link(Scripted({[&](model::RobotState& state) {
                             ++readings;
                             const std::lock_guard wait(gate);
                             return Count(state);
                           },
                           [&](std::span<const PushPoint>) {
                             done.emplace_back("push");
                             return LinkResult::kOk;
                           },
                           [&] {
                             done.emplace_back("withdraw");
                             return withdrawn;
                           }}));
  const std::vector<PushPoint> points(1);
  link.Start();
  link.QueuePush(points);
  link.RequestRead();
  REQUIRE(link.WaitForState(Soon()));
  withdrawn = LinkResult::kTimeout;
  link.Stop();
  CHECK(done.back() == "withdraw");
  CHECK(link.Status().push_result == LinkResult::kTimeout);
  CHECK(link.Status().push_problem.view() == "scripted");
  link.Stop();
  CHECK(std::count(done.begin(), done.end(), "withdraw") == 1);

  done.clear();  // a reading in progress at the stop pushes nothing
  gate.lock();
  link.Start();
  link.QueuePush(points);
  link.RequestRead();
  while (readings < 2) std::this_thread::yield();
  std::atomic<bool> began{false};
  std::thread stopping([&] {
    began = true;
    link.Stop();
  });
  while (!began) std::this_thread::yield();
  std::this_thread::sleep_for(
      std::chrono::milliseconds(300));  // until Stop() has signalled the thread
  gate.unlock();
  stopping.join();
  CHECK(done == std::vector<std::string>{"withdraw"});
}

TEST_CASE("many threads may read the status while the link works") {
  RobotLink link(Scripted({Count, [](std::span<const PushPoint>) { return LinkResult::kOk; }}));
  link.Start();
  std::atomic<bool> stop{false};
  std::atomic<int> torn{0};
  std::vector<std::thread> readers;
  readers.reserve(3);
  for (int i = 0; i < 3; ++i) {
    readers.emplace_back([&] {
      while (!stop) {
        const model::RobotState state = link.Latest();
        const auto expected = static_cast<double>(state.sequence);
        if (state.sequence > 0 && (state.q[0] != expected || state.timestamp_s != expected)) {
          ++torn;
        }
        if (link.Status().failures != 0) ++torn;
      }
    });
  }
  std::vector<PushPoint> points(4);
  for (int i = 0; i < 2000; ++i) {
    link.RequestRead();
    link.QueuePush(points);
    REQUIRE(link.WaitForState(Soon()));
  }
  stop = true;
  for (std::thread& reader : readers) reader.join();
  CHECK(torn == 0);
}

TEST_CASE("a link reconnects by itself after the controller resets") {
  FakeController controller;
  RobotConnection connection;
  connection.tcp = {"127.0.0.1", controller.port()};
  connection.profile = SmallProfile();
  connection.timeout_s = 1;
  connection.push.enabled = true;
  auto robot = MakeRobot("tcp", connection);
  REQUIRE(robot.ok());
  RobotLink link(std::move(robot).value());
  link.Start();
  link.RequestRead();
  REQUIRE(link.WaitForState(Soon()));
  controller.Behave([](FakeController::Exchange&) { return FakeController::Then::kClose; });
  link.RequestRead();
  CHECK_FALSE(link.WaitForState(Soon()));
  CHECK(link.Status().result == LinkResult::kLost);
  controller.Behave({});
  controller.Set(0, 77);
  bool found = false;
  for (int i = 0; i < 1000 && !found; ++i) {
    link.RequestRead();
    found = link.WaitForState(Soon());
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  REQUIRE(found);
  CHECK(link.Latest().q[0] == Approx(0.077));
  CHECK(link.Status().reconnects == 1);
}

TEST_CASE("a replay plays its rows at their rate and holds the last, or loops") {
  RobotConnection connection;
  connection.clock = TestTime;
  connection.replay.rows_per_s = 10;
  connection.replay.loop = false;
  for (int i = 0; i < 3; ++i) {
    ReplayRow row;
    row.q.setConstant(6, 0.1 * i);
    row.payload_kg = i;
    connection.replay.rows.push_back(row);
  }
  struct Row {
    double after_s;
    double held, looped;
  };
  const Row rows[] = {{0, 0, 0},     {0.05, 0, 0},    {0.06, 0.1, 0.1}, {0.1, 0.2, 0.2},
                      {0.1, 0.2, 0}, {0.1, 0.2, 0.1}, {10, 0.2, 0.2},   {0.1, 0.2, 0}};
  auto held = MakeRobot("replay", connection);
  connection.replay.loop = true;
  auto looped = MakeRobot("replay", connection);
  REQUIRE(held.ok());
  REQUIRE(looped.ok());
  model::RobotState state;
  std::uint64_t sequence = 0;
  for (const Row& row : rows) {
    Advance(row.after_s);
    CHECK(held.value()->Read(state) == LinkResult::kOk);
    CHECK(state.q[3] == Approx(row.held));
    CHECK(state.sequence == ++sequence);
    CHECK(state.timestamp_s == TestTime());
    CHECK(state.mode == model::RobotMode::kRunning);
    CHECK(looped.value()->Read(state) == LinkResult::kOk);
    CHECK(state.q[3] == Approx(row.looped));
    CHECK(state.payload_kg == Approx(10 * row.looped));
  }
  CHECK(held.value()->Push({}) == LinkResult::kPushRefused);
}

TEST_CASE("the remedy for a failed reading depends on its reason") {
  const auto names = [](LinkResult result, std::string_view words) {
    return LinkRemedy(result).find(words) != std::string_view::npos;
  };
  CHECK(names(LinkResult::kRefused, "robot.port"));
  CHECK(names(LinkResult::kNoRegisters, "robot.profile"));
  CHECK(names(LinkResult::kNoUnit, "robot.unit_id"));
  CHECK(names(LinkResult::kTimeout, "robot.timeout_ms"));
  CHECK(names(LinkResult::kLost, "cable"));
}

}  // namespace plumbline::robot_link_test
