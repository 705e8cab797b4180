// Register profiles, commands, programs and tracker, through a Modbus client.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "tests/virtual_cell/running_cell.h"

namespace virtual_cell::registers_test {
namespace {

constexpr double kQuick = 50;  // time scale of the tests

double Signed(const RegisterBank& bank, int at) {
  return static_cast<std::int16_t>(bank.Word(at));
}

/// Sends a command and waits until the controller has completed it.
/// @return its fault.
int Command(RegisterClient& robot, const RegisterLayout& layout, int code,
            const Motion& target = Motion::Identity(), int parameter = 0) {
  const Vec3 p = target.translation() * 1e3, r = VectorFromRotation(target.linear());
  std::vector<std::uint16_t> words = WordsFromFloats({p.x(), p.y(), p.z(), r.x(), r.y(), r.z()});
  const int next = robot.Read(layout.command + kSequence, 1).Word(0) + 1;
  words.push_back(static_cast<std::uint16_t>(code));
  words.push_back(static_cast<std::uint16_t>(parameter));
  words.push_back(static_cast<std::uint16_t>(next));
  robot.Write(layout.command, words);
  int fault = -1;
  const bool ended = Eventually([&] {
    const RegisterBank block = robot.Read(layout.command, 20);
    fault = block.Word(kFault);
    return block.Word(kEcho) == next && (fault != 0 || block.Word(kDone) == 1);
  });
  REQUIRE(ended);
  return fault;
}

TEST_CASE("the UR profile reports joints, tool and load in its own scales") {
  RunningCell cell({.idle = true, .time_scale = kQuick});
  RegisterClient robot("robot", cell.robot(), 1, 5);
  const MotionProgram program = DemoProgram();
  const Motion wanted = program.Find("assembly 1")->TipInBase();
  REQUIRE(Command(robot, LayoutOf(Profile::kUr), kMove, wanted) == kNoFault);
  REQUIRE(Command(robot, LayoutOf(Profile::kUr), kAttach) == kNoFault);

  RegisterBank now(1);
  REQUIRE(Eventually([&] { return (now = robot.Read(140, 30)).Word(0) == 6000; }));
  CHECK(Signed(now, 1) == 0);
  CHECK(Signed(now, 2) == 400);
  CHECK(Signed(now, 3) == 13000);
  CHECK(now.Word(4) == 1);
  const RegisterBank coarse = robot.Read(258, 80);
  CHECK(coarse.Word(0) == 7);
  Joints q(6);
  for (int i = 0; i < 6; ++i) {
    q[i] = 1e-6 * static_cast<std::int32_t>(now.Long(10 + 2 * i));
    const double turns = Signed(coarse, 320 - 258 + i);
    const double by_registers = 1e-3 * coarse.Word(270 - 258 + i) + turns * 2 * std::numbers::pi;
    CHECK(by_registers == Approx(q[i]).margin(0.6e-3));
    CHECK((turns == 0 || turns == -1));
  }
  // Forward kinematics of the joints matches the tool pose in 400-405.
  const CellDescription description = DemoCell();
  const Motion tip = NominalTip(description, ArmFromDescription(description), q);
  CHECK((tip.translation() - wanted.translation()).norm() < 1e-5);
  const RegisterBank tcp = robot.Read(400, 26);
  for (int k = 0; k < 3; ++k) {
    CHECK(Signed(tcp, k) * 1e-4 == Approx(tip.translation()[k]).margin(0.6e-4));
    CHECK(Signed(tcp, 3 + k) * 1e-3 == Approx(VectorFromRotation(tip.linear())[k]).margin(0.6e-3));
    CHECK(Signed(tcp, 20 + k) * 1e-4 == Approx(description.tip_F[k]).margin(1e-6));
  }
  CHECK(Signed(robot.Read(769, 1), 0) == 22);
  REQUIRE(Command(robot, LayoutOf(Profile::kUr), kRelease) == kNoFault);
  CHECK(Eventually([&] { return robot.Read(140, 1).Word(0) == 0; }));
}

TEST_CASE("the generic profile reports everything in one block") {
  RunningCell cell({.profile = Profile::kGeneric, .idle = true, .time_scale = kQuick});
  RegisterClient robot("robot", cell.robot(), 1, 5);
  const Motion wanted = DemoProgram().Find("assembly 2")->TipInBase();
  REQUIRE(Command(robot, LayoutOf(Profile::kGeneric), kMove, wanted) == kNoFault);
  REQUIRE(Command(robot, LayoutOf(Profile::kGeneric), kAttach) == kNoFault);
  RegisterBank now(1);
  REQUIRE(Eventually([&] { return (now = robot.Read(0, 58)).Float(28) == 60.0F; }));
  Joints q(6);
  for (int i = 0; i < 6; ++i) q[i] = static_cast<double>(now.Float(2 * i));
  const CellDescription description = DemoCell();
  const Motion tip = NominalTip(description, ArmFromDescription(description), q);
  CHECK((tip.translation() - wanted.translation()).norm() < 2e-6);
  CHECK(now.Float(16) == Approx(wanted.translation().x()).margin(1e-6));
  CHECK(now.Float(34) == Approx(1.3F));
  CHECK(now.Float(36) == 22.0F);
  CHECK(now.Word(38) == 1);
  CHECK(now.Word(41) == 6);
  const int before = now.Word(39);
  CHECK(Eventually([&] { return robot.Read(39, 1).Word(0) != before; }));
}

TEST_CASE("commands that cannot be executed are refused with a fault") {
  RunningCell cell({.idle = true, .time_scale = kQuick});
  RegisterClient robot("robot", cell.robot(), 1, 5);
  const RegisterLayout ur = LayoutOf(Profile::kUr);
  CHECK(Command(robot, ur, kMove, MotionFromXyzVector({9, 0, 0}, Vec3::Zero())) ==
        kFaultUnreachable);
  CHECK(Command(robot, ur, 99) == kFaultUnknownCode);
  CHECK(Command(robot, ur, kMoveToPushed, Motion::Identity(), 7) == kFaultNoSuchPoint);
}

TEST_CASE("the robot moves to a pushed point") {
  RunningCell cell({.idle = true, .time_scale = kQuick});
  RegisterClient robot("robot", cell.robot(), 1, 5);
  const Motion wanted = DemoProgram().Find("approach 1")->TipInBase();
  const Vec3 p = wanted.translation() * 1e4, r = VectorFromRotation(wanted.linear()) * 1e3;
  const auto word = [](double value) {
    return static_cast<std::uint16_t>(static_cast<std::int16_t>(std::lround(value)));
  };
  robot.Write(208,
              {7, word(p.x()), word(p.y()), word(p.z()), word(r.x()), word(r.y()), word(r.z()), 0});
  const RegisterLayout ur = LayoutOf(Profile::kUr);
  CHECK(Command(robot, ur, kMoveToPushed, Motion::Identity(), 7) == kFaultNoSuchPoint);
  robot.Write(215, {1});
  CHECK(Command(robot, ur, kMoveToPushed, Motion::Identity(), 7) == kNoFault);
  const RegisterBank tcp = robot.Read(400, 3);
  for (int k = 0; k < 3; ++k) CHECK(Signed(tcp, k) == Approx(p[k]).margin(1.5));
}

TEST_CASE("only the open registers can be written") {
  RunningCell cell({.idle = true});
  RegisterClient robot("robot", cell.robot(), 1, 5);
  RegisterClient tracker("tracker", cell.tracker(), 1, 5);
  CHECK_NOTHROW(robot.Write(128, {1}));
  CHECK_THROWS(robot.Write(127, {1}));
  CHECK_THROWS(robot.Write(255, {1, 2}));
  CHECK_THROWS(robot.Write(270, {1}));
  CHECK_THROWS(tracker.Write(0, {1}));
  CHECK_FALSE(robot.ReadIfThere(795, 10));
}

TEST_CASE("the tracker measures the loaded tip of the world") {
  RunningCell cell(
      {.idle = true, .time_scale = kQuick, .reflectors_T = {{0, 0.424, 0}, {0, -0.424, 0}}});
  RegisterClient robot("robot", cell.robot(), 1, 5);
  RegisterClient tracker("tracker", cell.tracker(), 1, 5);
  const Motion wanted = DemoProgram().Find("assembly 1")->TipInBase();
  REQUIRE(Command(robot, LayoutOf(Profile::kUr), kAttach) == kNoFault);
  REQUIRE(Command(robot, LayoutOf(Profile::kUr), kMove, wanted) == kNoFault);

  Controller controller(DemoCell(), DemoProgram().home);
  REQUIRE(controller.MoveToPose(wanted) == MoveAnswer::kAccepted);
  controller.Advance(1e3);
  const Truth truth = World(DemoCell()).Settle({.q = controller.q(), .payload_kg = 60});
  RegisterBank seen(1);
  REQUIRE(Eventually([&] {
    seen = tracker.Read(0, 42);
    return seen.Word(13) == 1 && seen.Float(40) == 60.0F;
  }));
  const auto point = [&seen](int at) -> Vec3 {
    return {seen.Float(at), seen.Float(at + 2), seen.Float(at + 4)};
  };
  CHECK((point(0) - 1e3 * truth.X_WT.translation()).norm() < 2e-3);
  CHECK((point(6) - VectorFromRotation(truth.X_WT.linear())).norm() < 1e-6);
  CHECK((point(16) - 1e3 * (truth.X_WT * Vec3(0, 0.424, 0))).norm() < 2e-3);
  CHECK((point(16) - point(22)).norm() == Approx(848).margin(1e-3));
  const int counter = seen.Word(12);
  CHECK(Eventually([&] { return tracker.Read(12, 1).Word(0) != counter; }));
}

TEST_CASE("the tracker's noise has the requested standard deviation") {
  Tracker tracker(0.1, {});
  const Truth truth;
  double sum = 0;
  const int n = 4000;
  for (int i = 0; i < n; ++i) {
    tracker.Measure(truth, {}, true);
    const double x = static_cast<double>(tracker.bank().Float(0));
    sum += x * x;
  }
  CHECK(std::sqrt(sum / n) == Approx(0.1).epsilon(0.05));
}

TEST_CASE("the noise of a standstill is reproducible by seed, independent of the pose") {
  const auto readings = [](unsigned seed) {
    Tracker tracker(0.1, {}, true, seed);
    std::vector<float> x;
    for (const bool at_rest : {true, true, false, true, false, true}) {
      tracker.Measure(Truth{}, {}, at_rest);
      if (at_rest) x.push_back(tracker.bank().Float(0));
    }
    return x;
  };
  const std::vector<float> x = readings(3);
  CHECK(x[0] == x[1]);  // the same standstill
  CHECK(x[1] != x[2]);  // the same pose at another standstill
  CHECK(x[2] != x[3]);
  CHECK(readings(3) == x);
  CHECK(readings(4) != x);
}

TEST_CASE("the program picks and places the payload repeatedly") {
  Controller controller(DemoCell(), DemoProgram().home);
  ProgramRunner runner(DemoProgram(), "");
  std::vector<double> loads = {0};
  for (int i = 0; i < 8000 && runner.rounds() < 2; ++i) {
    controller.Advance(0.05);
    runner.Advance(0.05, controller);
    if (controller.payload_kg() != loads.back()) loads.push_back(controller.payload_kg());
  }
  CHECK(runner.rounds() == 2);
  CHECK(loads == std::vector<double>{0, 60, 0, 60, 0});
}

TEST_CASE("a program holds at a named point and then executes commands") {
  RunningCell cell({.hold_at = "assembly 1", .time_scale = kQuick});
  RegisterClient robot("robot", cell.robot(), 1, 5);
  const Vec3 p = DemoProgram().Find("assembly 1")->TipInBase().translation() * 1e4;
  REQUIRE(Eventually([&] {
    const RegisterBank tcp = robot.Read(400, 3);
    return std::abs(Signed(tcp, 0) - p.x()) < 2 && std::abs(Signed(tcp, 2) - p.z()) < 2;
  }));
  CHECK(robot.Read(140, 1).Word(0) == 6000);
  // The program may need one more cycle to enter the hold state.
  CHECK(Eventually([&] { return Command(robot, LayoutOf(Profile::kUr), kGoHome) == kNoFault; }));
}

TEST_CASE("commands are refused while a program runs") {
  RunningCell cell({});
  RegisterClient robot("robot", cell.robot(), 1, 5);
  CHECK(Command(robot, LayoutOf(Profile::kUr), kGoHome) == kFaultProgramRuns);
}

TEST_CASE("the built-in program moves any arm and loads it") {
  CellDescription seven;
  seven.joints.resize(7);
  Controller controller(seven, BuiltinProgram(seven).home);
  ProgramRunner runner(BuiltinProgram(seven), "");
  bool loaded = false;
  for (int i = 0; i < 2000 && runner.rounds() < 1; ++i) {
    controller.Advance(0.05);
    runner.Advance(0.05, controller);
    loaded = loaded || controller.payload_kg() > 0;
  }
  CHECK(runner.rounds() == 1);
  CHECK(loaded);
}

TEST_CASE("recorded rows stream through the registers") {
  const std::string path =
      (std::filesystem::temp_directory_path() / ("rows" + std::to_string(::getpid()) + ".csv"))
          .string();
  std::ofstream(path) << "session,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,payload_kg,x_mm\n"
                         "1,10,-90,100,0,20,0,5,1\n1,-20,-95,90,5,-30,7,12.5,2\n";
  VirtualCellOptions options;
  options.replay = ReadJointRows(path, 6);
  options.row_rate_hz = 20;
  REQUIRE(options.replay.size() == 2);
  {
    RunningCell cell(options);
    RegisterClient robot("robot", cell.robot(), 1, 5);
    RegisterBank now(1);
    REQUIRE(Eventually([&] { return (now = robot.Read(140, 30)).Word(0) == 1250; }));
    const double expected_deg[] = {-20, -95, 90, 5, -30, 7};
    for (int i = 0; i < 6; ++i) {
      CHECK(static_cast<std::int32_t>(now.Long(10 + 2 * i)) ==
            std::lround(RadFromDeg(expected_deg[i]) * 1e6));
    }
  }
  CHECK_THROWS_WITH(ReadJointRows(path, 7), Catch::Contains("q7_deg"));
  std::ofstream(path) << "q1_deg\n1\nx\n";
  CHECK_THROWS_WITH(ReadJointRows(path, 1), Catch::Contains(":3"));
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace virtual_cell::registers_test
