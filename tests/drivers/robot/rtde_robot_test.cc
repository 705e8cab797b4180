#include "drivers/robot/rtde_robot.h"

#include <fmt/format.h>

#include <array>
#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <thread>

#include "drivers/robot/registry.h"
#include "firmware-like/geometry/rotation.h"
#include "tests/virtual_ur/running_ur.h"

namespace plumbline::rtde_robot_test {

using namespace plumbline::robot;
using virtual_ur::BareUr;
using virtual_ur::RunningUr;
using virtual_ur::UrState;

namespace {

constexpr auto kPatience = std::chrono::seconds(60);  // a busy machine; a test that passes is quick

struct Options {
  double hz = 500;
  int slots = 0;
  std::optional<int> tool_register{};
  std::vector<std::string> fields = RtdeSettings().fields;
};

/// A device over RTDE with a patient timeout.
std::unique_ptr<RobotDevice> Robot(RunningUr& ur, const Options& options = {}) {
  RobotConnection connection;
  connection.tcp = {"127.0.0.1", ur.port()};
  connection.timeout_s = 2;
  connection.rtde.frequency_hz = options.hz;
  connection.rtde.tool_number_register = options.tool_register;
  connection.rtde.fields = options.fields;
  connection.push = {.enabled = options.slots > 0, .max_step_m = 0.005, .min_period_s = 0.02};
  connection.pushed_points = options.slots;
  auto robot = MakeRobot("rtde", connection);
  REQUIRE(robot.ok());
  return std::move(robot).value();
}

/// Reads until `holds`, at the pace of a control cycle.
bool ReadUntil(RobotDevice& robot, model::RobotState& state, const std::function<bool()>& holds) {
  const auto give_up = std::chrono::steady_clock::now() + kPatience;
  while (std::chrono::steady_clock::now() < give_up) {
    robot.Read(state);
    if (holds()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return false;
}

/// Reads until the result differs from kOk and kWaiting. @return  the problem
std::string ProblemOf(RobotDevice& robot, LinkResult expected) {
  model::RobotState state;
  LinkResult result = LinkResult::kOk;
  const auto give_up = std::chrono::steady_clock::now() + kPatience;
  while (result != expected && std::chrono::steady_clock::now() < give_up) {
    result = robot.Read(state);
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  CHECK(result == expected);
  return std::string(robot.problem());
}

void SetPosture(RunningUr& ur, double q1) {
  ur.With([&](BareUr& server) { server.state().actual_q[0] = q1; });
}

PushPoint PointAt(int slot, double x, bool valid = true) {
  PushPoint point{slot, 10 + slot, {}, valid, 250e-6};
  point.X_BT.p = Vec3(x, 0.2, 0.3);
  point.X_BT.R = RotationFromVector({0.1, 0.2, 0.3});
  return point;
}

std::string AllNotices(RobotDevice& robot) {
  std::string all;
  for (auto one = robot.TakeNotice(); !one.empty(); one = robot.TakeNotice())
    all += fmt::format("{}{}", all.empty() ? "" : "; ", one);
  return all;
}

}  // namespace

TEST_CASE("a reading has everything that the controller reports, as doubles") {
  RunningUr ur;
  ur.With([](BareUr& server) {
    UrState& state = server.state();
    state.actual_q = {0.123456789012, -1.5, 1.0, 0.5, 0.25, 6.1};
    state.tcp_pose = {0.4, -0.2, 0.6, 0, 3.1, 0};
    state.tcp_offset = {0, 0, 0.2, 0, 0, 0};
    state.payload = 3.5;
    state.payload_cog = {0.01, 0.0, 0.05};
    state.joint_temperatures = {30, 30, 30, 36, 36, 36};
    state.output_int[24] = 2;
  });
  const auto robot = Robot(ur, {.tool_register = 24});
  model::RobotState state;
  REQUIRE(robot->Read(state) == LinkResult::kOk);
  CHECK(state.q[0] == 0.123456789012);
  CHECK(state.q[5] == 6.1);
  CHECK(state.q_resolution == 0);
  CHECK(state.X_BT->p == Vec3(0.4, -0.2, 0.6));
  CHECK(state.X_FT->p == Vec3(0, 0, 0.2));
  CHECK(state.payload_kg == 3.5);
  CHECK(state.payload_cog_F == Vec3(0.01, 0.0, 0.05));
  CHECK(state.temp_C == 33.0);
  CHECK(state.tool_number == 2);
  CHECK(state.mode == model::RobotMode::kRunning);
  CHECK(state.sequence > 0);
  CHECK(AllNotices(*robot).empty());
}

TEST_CASE("a reading takes the newest package, and repeats it while there is no other") {
  RunningUr ur;
  const auto robot = Robot(ur);
  model::RobotState state;
  REQUIRE(robot->Read(state) == LinkResult::kOk);
  SetPosture(ur, 1);
  std::this_thread::sleep_for(std::chrono::milliseconds(60));  // thirty packages wait
  REQUIRE(robot->Read(state) == LinkResult::kOk);
  CHECK(state.q[0] == 1);
  const std::uint64_t sequence = state.sequence;
  const double timestamp_s = state.timestamp_s;
  ur.Fault("silent on");
  REQUIRE(ReadUntil(*robot, state, [&, last = std::uint64_t{0}]() mutable {
    const bool same = state.sequence == last;
    last = state.sequence;
    return same;
  }));
  CHECK(state.sequence >= sequence);
  CHECK(state.timestamp_s >= timestamp_s);
}

TEST_CASE("both versions of the protocol are spoken, in whatever segments they arrive") {
  const auto words = GENERATE("version 2", "version 1", "split on", "merge 5", "text-between on",
                              "text-every 0.004", "drop 3", "jitter 0.01");
  CAPTURE(words);
  RunningUr ur;
  REQUIRE(ur.Fault(words).empty());
  const auto robot = Robot(ur);
  model::RobotState state;
  REQUIRE(robot->Read(state) == LinkResult::kOk);
  double last_s = state.timestamp_s;
  for (const double q1 : {0.5, -0.5, 1.5}) {
    SetPosture(ur, q1);
    REQUIRE(ReadUntil(*robot, state, [&] { return state.q[0] == q1; }));
    CHECK(state.timestamp_s > last_s);
    last_s = state.timestamp_s;
  }
  CHECK(ur.With([](BareUr& server) { return server.connections(); }) == 1);
}

TEST_CASE("messages of the controller are passed on") {
  RunningUr ur;
  ur.Fault("text-between on");
  const auto robot = Robot(ur);
  model::RobotState state;
  REQUIRE(robot->Read(state) == LinkResult::kOk);
  CHECK(AllNotices(*robot) ==
        "message of the controller: Controller: SafetySetup has not been confirmed yet");
  CHECK(AllNotices(*robot).empty());
}

TEST_CASE("optional fields that the controller lacks are left out and named once") {
  RunningUr ur;
  ur.Fault("missing payload_cog");
  ur.Fault("missing tcp_offset");
  const auto robot = Robot(ur);
  model::RobotState state;
  REQUIRE(robot->Read(state) == LinkResult::kOk);
  CHECK_FALSE(state.payload_cog_F);
  CHECK_FALSE(state.X_FT);
  CHECK(state.payload_kg);
  CHECK(AllNotices(*robot) ==
        "controller software 5.11 has no tcp_offset, payload_cog: read without");
  ur.Fault("close");
  const std::uint64_t before = state.sequence;
  REQUIRE(ReadUntil(*robot, state, [&] {
    return state.sequence > before + 1 &&
           ur.With([](BareUr& server) { return server.connections(); }) == 2;
  }));
  CHECK(AllNotices(*robot).empty());
}

TEST_CASE("only the fields of the settings are requested") {
  RunningUr ur;
  const auto robot = Robot(ur, {.fields = {"payload"}});
  model::RobotState state;
  REQUIRE(robot->Read(state) == LinkResult::kOk);
  CHECK(state.payload_kg);
  CHECK_FALSE(state.X_BT);
  CHECK(state.mode == model::RobotMode::kUnknown);
}

TEST_CASE("a setup that the controller refuses is named with its field") {
  struct Row {
    const char* fault;
    LinkResult result;
    const char* text;
  };
  const auto row = GENERATE(
      Row{"missing actual_q", LinkResult::kNotAccepted, "has no output field actual_q"},
      Row{"missing output_int_register_24", LinkResult::kNotAccepted,
          "has no output field output_int_register_24: use another register"},
      Row{"type actual_q VECTOR6INT32", LinkResult::kProtocol,
          "actual_q is of type \"VECTOR6INT32\" instead of VECTOR6D"},
      Row{"refuse-recipe on", LinkResult::kNotAccepted, "refuses the output fields"},
      Row{"refuse-start on", LinkResult::kNotAccepted, "refuses to start sending"},
      Row{"version 0", LinkResult::kNotAccepted, "neither version 2 nor 1"},
      Row{"garbage", LinkResult::kProtocol, "is not RTDE: is robot.port"},
      Row{"foreign-recipe on", LinkResult::kTimeout, "no data package that fits its recipe"});
  CAPTURE(row.fault);
  RunningUr ur;
  REQUIRE(ur.Fault(row.fault).empty());
  const auto robot = Robot(ur, {.tool_register = 24});
  const std::string problem = ProblemOf(*robot, row.result);
  CAPTURE(problem);
  CHECK(problem.find(row.text) != std::string::npos);
  CHECK(problem.find("127.0.0.1:" + std::to_string(ur.port())) == 0);
}

TEST_CASE("no controller, an unknown name and a port of another service are told apart") {
  RobotConnection connection;
  connection.timeout_s = 0.5;
  connection.tcp = {"127.0.0.1", 1};
  model::RobotState state;
  auto robot = MakeRobot("rtde", connection);
  CHECK(robot.value()->Read(state) == LinkResult::kRefused);
  CHECK(robot.value()->Read(state) == LinkResult::kWaiting);
  connection.tcp.host = "no-such-host.invalid";
  robot = MakeRobot("rtde", connection);
  CHECK(robot.value()->Read(state) == LinkResult::kUnknownName);
  CHECK(std::string(robot.value()->problem()).find("robot.host") != std::string::npos);
}

TEST_CASE("a connection that is lost or silent is replaced, and readings go on") {
  const auto words = GENERATE("close", "restart", "silent on");
  CAPTURE(words);
  RunningUr ur;
  RobotConnection connection;
  connection.tcp = {"127.0.0.1", ur.port()};
  connection.timeout_s = 0.3;
  auto robot = MakeRobot("rtde", connection);
  model::RobotState state;
  REQUIRE(ReadUntil(*robot.value(), state, [&] { return state.sequence > 0; }));
  ur.Fault(words);
  ProblemOf(*robot.value(),
            std::string(words) == "silent on" ? LinkResult::kTimeout : LinkResult::kLost);
  ur.Fault("silent off");
  const std::uint64_t before = state.sequence;
  SetPosture(ur, 0.75);
  REQUIRE(ReadUntil(*robot.value(), state, [&] { return state.q[0] == 0.75; }));
  CHECK(state.sequence > before);
}

TEST_CASE("a controller whose clock goes back was restarted: the reading continues") {
  RunningUr ur;
  const auto robot = Robot(ur);
  model::RobotState state;
  ur.With([](BareUr& server) { server.state().timestamp = 5000; });
  REQUIRE(robot->Read(state) == LinkResult::kOk);
  const double before_s = state.timestamp_s;
  ur.Fault("clock-back");
  SetPosture(ur, 0.75);
  REQUIRE(ReadUntil(*robot, state, [&] { return state.q[0] == 0.75; }));
  CHECK(state.timestamp_s > before_s);
  CHECK(AllNotices(*robot).find("the controller was restarted") != std::string::npos);
}

TEST_CASE("the time of a sample is that of the fastest package, corrected for clock drift") {
  SampleTime time;
  CHECK(time.Note(10.0, 100.0) == 100.0);
  CHECK(time.Note(10.1, 100.09) == Approx(100.09));              // 10 ms faster than the first
  CHECK(time.Note(10.2, 100.5) == Approx(100.19).margin(1e-3));  // waited 0.3 s in the network
  double offset_s = 90;
  for (int k = 1; k <= 10000; ++k) {  // a clock that is 100 ppm slow is followed
    const double timestamp_s = 10.2 + 0.01 * k;
    offset_s += 1e-6;
    CHECK(time.Note(timestamp_s, timestamp_s + offset_s) <= timestamp_s + offset_s);
  }
  CHECK(time.Note(200, 290 + 0.0189) > 290);
}

TEST_CASE("a slow reader is disconnected by the controller, and the device connects again") {
  RunningUr ur;
  const auto robot = Robot(ur);
  model::RobotState state;
  REQUIRE(robot->Read(state) == LinkResult::kOk);
  // A receive buffer of the kernel holds megabytes; nothing is read until the server gives up.
  ur.With([](BareUr& server) {
    for (int k = 0; k < 60000 && server.slow_readers() == 0; ++k) server.Advance();
  });
  REQUIRE(ur.With([](BareUr& server) { return server.slow_readers(); }) == 1);
  SetPosture(ur, 0.75);
  CHECK(ReadUntil(*robot, state, [&] { return state.q[0] == 0.75; }));
}

TEST_CASE("points are written with sequence, id, radius and pose, and the heartbeat counts") {
  RunningUr ur;
  const auto robot = Robot(ur, {.slots = 2});
  model::RobotState state;
  REQUIRE(robot->Read(state) == LinkResult::kOk);
  const std::array points{PointAt(0, 0.5), PointAt(1, 0.6)};
  REQUIRE(robot->Push(points) == LinkResult::kOk);
  REQUIRE(ReadUntil(*robot, state, [&] { return ur.State().input_int[24] == 1; }));
  REQUIRE(robot->Push(points) == LinkResult::kOk);
  REQUIRE(ReadUntil(*robot, state, [&] { return ur.State().input_int[24] == 2; }));
  const UrState written = ur.State();
  CHECK(written.input_int[25] != 0);
  CHECK(written.input_int[26] == 10);
  CHECK(written.input_int[27] == 250);
  CHECK(written.input_int[28] != 0);
  CHECK(written.input_int[29] == 11);
  CHECK(written.input_double[24] == 0.5);
  CHECK(written.input_double[30] == 0.6);
  CHECK(written.input_double[25] == 0.2);
  CHECK(std::abs(written.input_double[29] - 0.3) < 1e-14);
  CHECK(written.input_double[36] == 0);

  const std::array invalid{PointAt(0, 0.5, false), PointAt(1, 0.6)};
  REQUIRE(robot->Push(invalid) == LinkResult::kOk);
  REQUIRE(ReadUntil(*robot, state, [&] { return ur.State().input_int[25] == 0; }));
  CHECK(ur.State().input_int[28] != 0);
  CHECK(robot->WithdrawAll(1) == LinkResult::kOk);
  CHECK(ur.State().input_int[28] == 0);  // taken before WithdrawAll() returns
  CHECK(robot->WithdrawAll(1) == LinkResult::kWaiting);
  const std::uint64_t sequence = state.sequence;
  CHECK(ReadUntil(*robot, state, [&] { return state.sequence > sequence; }));
}

TEST_CASE("a point with a rotation that is no number is withdrawn, not written") {
  RunningUr ur;
  const auto robot = Robot(ur, {.slots = 1});
  model::RobotState state;
  REQUIRE(robot->Read(state) == LinkResult::kOk);
  std::array points{PointAt(0, 0.5)};
  REQUIRE(robot->Push(points) == LinkResult::kOk);
  REQUIRE(ReadUntil(*robot, state, [&] { return ur.State().input_int[25] != 0; }));
  points[0].X_BT.R(0, 0) = std::numeric_limits<double>::quiet_NaN();
  REQUIRE(robot->Push(points) == LinkResult::kOk);
  REQUIRE(ReadUntil(*robot, state, [&] { return ur.State().input_int[24] == 2; }));
  CHECK(ur.State().input_int[25] == 0);
  CHECK(std::isfinite(ur.State().input_double[27]));
}

TEST_CASE("a point that jumps is withdrawn, and written again once it is steady") {
  RunningUr ur;
  const auto robot = Robot(ur, {.slots = 1});
  model::RobotState state;
  REQUIRE(robot->Read(state) == LinkResult::kOk);
  REQUIRE(robot->Push(std::array{PointAt(0, 0.5)}) == LinkResult::kOk);
  CHECK(robot->Push(std::array{PointAt(0, 0.52)}) == LinkResult::kPushRefused);
  CHECK(std::string(robot->problem()).find("moved by 20.000 mm") != std::string::npos);
  REQUIRE(ReadUntil(*robot, state, [&] { return ur.State().input_int[25] == 0; }));
  CHECK(ur.State().input_double[24] == 0.5);
  REQUIRE(ReadUntil(*robot, state, [&] {
    return robot->Push(std::array{PointAt(0, 0.52)}) == LinkResult::kOk &&
           ur.State().input_double[24] == 0.52;
  }));
  CHECK(ur.State().input_int[25] != 0);
}

TEST_CASE("registers of another client disable the push, not the reading, and are tried again") {
  RunningUr ur;
  auto first = Robot(ur, {.slots = 1});
  model::RobotState state;
  REQUIRE(first->Read(state) == LinkResult::kOk);
  RobotConnection connection;
  connection.tcp = {"127.0.0.1", ur.port()};
  connection.timeout_s = 2;
  connection.push = {.enabled = true};
  connection.pushed_points = 1;
  static std::atomic<double> skipped_s;
  skipped_s = 0;
  connection.clock = [] { return MonotonicSeconds() + skipped_s; };
  auto second = MakeRobot("rtde", connection);
  REQUIRE(second.value()->Read(state) == LinkResult::kOk);
  const std::array points{PointAt(0, 0.5)};
  CHECK(second.value()->Push(points) == LinkResult::kPushRefused);
  CHECK(std::string(second.value()->problem()).find("input_int_register_24 is in use by another") ==
        0);
  REQUIRE(second.value()->Read(state) == LinkResult::kOk);

  REQUIRE(first->Push(std::array{PointAt(0, 0.9)}) == LinkResult::kOk);
  REQUIRE(ReadUntil(*first, state, [&] { return ur.State().input_double[24] == 0.9; }));
  // The first client disappears: its values stay, and the registers are free.
  first.reset();
  CHECK(second.value()->Push(points) == LinkResult::kPushRefused);
  CHECK(ur.State().input_double[24] == 0.9);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  skipped_s = RtdeRobot::kInputsRetry_s + 1;
  CHECK(ReadUntil(*second.value(), state, [&] {
    second.value()->Push(points);
    return ur.State().input_double[24] == 0.5;
  }));
}

TEST_CASE("impossible settings are refused when the device is made") {
  RobotConnection connection;
  connection.push.enabled = true;
  connection.pushed_points = 5;
  CHECK(MakeRobot("rtde", connection).error() ==
        "RTDE: 5 points do not fit into the registers; 4 do");
  connection.pushed_points = 1;
  connection.rtde.fields = {"payload", "target_q"};
  CHECK(MakeRobot("rtde", connection).error().find("\"target_q\" is not one of") !=
        std::string::npos);
  connection.rtde.fields.clear();
  connection.rtde.tool_number_register = 48;
  CHECK(MakeRobot("rtde", connection).error() == "RTDE: register 48 is outside 0..47");
}

}  // namespace plumbline::rtde_robot_test
