#include "firmware-like/machine.h"

#include <catch2/catch.hpp>

#include "tests/firmware-like/test_cell.h"

using namespace plumbline;

namespace {

constexpr double kPeriod_s = 0.01;

/// A machine with two points, and a robot that is read every cycle.
struct Cell {
  MachineConfig config;
  JointVector taught{6};
  std::optional<Machine> machine;
  MachineInput input;

  Cell() {
    taught << 0.2, 0.4, 0.3, 0.5, 0.8, -0.4;
    config.cell = test::HeavyArm();
    for (int id : {7, 9}) {
      JointVector q = taught;
      q[0] += 0.1 * id;
      AssemblyPoint point;
      point.id = id;
      point.near_q = q;
      point.X_WP = config.cell.robot.X_WB * LoadedArm(config.cell).UnloadedTip(q);
      config.points.push_back(point);
    }
    input.robot.q = taught;
    input.robot.payload_kg = 60;
    input.now_s = 50;
  }

  const Snapshot& Next() {
    if (!machine) {
      machine.emplace(config);
      machine->Prepare();
    }
    input.now_s += kPeriod_s;
    input.robot.timestamp_s = input.now_s;
    ++input.robot.sequence;
    return machine->Cycle(input);
  }
  const Snapshot& Silent() {
    input.now_s += kPeriod_s;
    return machine->Cycle(input);
  }
  const Snapshot& Running() {
    for (int k = 0; k < 4; ++k) Next();
    return Next();
  }
};

}  // namespace

TEST_CASE("with a trusted robot every point is corrected and refreshed each cycle") {
  Cell cell;
  const Snapshot& snapshot = cell.Running();
  CHECK(snapshot.alarms == 0);
  CHECK((snapshot.status & status::kReady) != 0);
  CHECK((snapshot.status & status::kRobotLink) != 0);
  CHECK((snapshot.status & status::kPayloadValid) != 0);
  REQUIRE(snapshot.points.size() == 2);
  CHECK(snapshot.points[0].valid);
  CHECK(snapshot.points[1].valid);
  CHECK(snapshot.points[0].correction.translation_B.norm() > 1e-3);
  const std::uint16_t sequence = snapshot.points[0].sequence;
  CHECK(cell.Next().points[0].sequence == sequence + 1);
}

TEST_CASE("a point without taught joints takes the branch nearest to the robot") {
  Cell cell;
  for (AssemblyPoint& point : cell.config.points) point.near_q.reset();
  const Snapshot& snapshot = cell.Running();
  CHECK(snapshot.points[0].valid);
  CHECK(snapshot.points[1].valid);
  CHECK((snapshot.points[0].correction.q - cell.taught).cwiseAbs().maxCoeff() < 0.75);
}

TEST_CASE("stale input withdraws validity; the values stay") {
  Cell cell;
  cell.Running();
  const Vec3 before = cell.machine->Cycle(cell.input).points[0].correction.X_BP_command.p;
  for (int k = 0; k < 11; ++k) cell.Silent();
  const Snapshot& snapshot = cell.Silent();
  CHECK((snapshot.alarms & alarm::kRobotStale) != 0);
  CHECK((snapshot.status & status::kReady) == 0);
  CHECK_FALSE(snapshot.points[0].valid);
  CHECK(snapshot.points[0].code == CorrectionCode::kNoRobot);
  CHECK((snapshot.points[0].correction.X_BP_command.p - before).norm() < 1e-8);
  CHECK(cell.Running().points[0].valid);
}

TEST_CASE("the payload comes from the robot, a table, or is fixed") {
  Cell cell;
  const auto correction_of = [](const Snapshot& s) {
    return s.points[0].correction.translation_B.norm();
  };
  const double at_60 = correction_of(cell.Running());
  SECTION("nothing known: refused, with its own code and alarm") {
    cell.input.robot.payload_kg.reset();
    const Snapshot& snapshot = cell.Next();
    CHECK(snapshot.points[0].code == CorrectionCode::kPayloadUnknown);
    CHECK((snapshot.alarms & alarm::kPayloadUnknown) != 0);
  }
  SECTION("nonsense is not believed") {
    for (const double mass_kg : {-1.0, 1e6, std::nan("")}) {
      cell.input.robot.payload_kg = mass_kg;
      CHECK(cell.Next().points[0].code == CorrectionCode::kPayloadUnknown);
    }
  }
  SECTION("fixed") {
    cell.config.payload.source = PayloadPolicy::Source::kFixed;
    cell.config.payload.fixed.mass_kg = 60;
    cell.machine.reset();
    cell.input.robot.payload_kg.reset();
    CHECK(correction_of(cell.Running()) == Approx(at_60));
  }
  SECTION("by tool number") {
    cell.config.payload.source = PayloadPolicy::Source::kTable;
    cell.config.payload.table = {{1, 0.0, {}}, {2, 60.0, {}}};
    cell.machine.reset();
    cell.input.robot.tool_number = 2;
    CHECK(correction_of(cell.Running()) == Approx(at_60));
    cell.input.robot.tool_number = 1;
    CHECK(correction_of(cell.Next()) < 0.9 * at_60);
    cell.input.robot.tool_number = 3;
    CHECK(cell.Next().points[0].code == CorrectionCode::kPayloadUnknown);
  }
  SECTION("a point may name its own") {
    cell.config.points[0].payload_kg = 60;
    cell.machine.reset();
    cell.input.robot.payload_kg = 10;
    const Snapshot& snapshot = cell.Running();
    CHECK(correction_of(snapshot) == Approx(at_60));
    CHECK(snapshot.points[1].correction.translation_B.norm() < at_60);
  }
}

TEST_CASE("commands: executed once by sequence, frozen until acknowledged") {
  Cell cell;
  cell.input.command.sequence = 41;  // left over from before the start
  cell.input.command.code = PlcCommandCode::kCorrectPoint;
  cell.input.command.point_id = 9;
  CHECK_FALSE(cell.Running().result.valid);
  CHECK(cell.Next().result.sequence == 41);

  cell.input.command.sequence = 42;
  const CommandResult first = cell.Next().result;
  REQUIRE(first.valid);
  CHECK(first.sequence == 42);
  CHECK(first.point_id == 9);
  const PointResult& block = cell.Next().points[1];
  CHECK((first.correction.X_BP_command.p - block.correction.X_BP_command.p).norm() < 1e-8);

  SECTION("frozen while the payload changes, and a repeated sequence changes nothing") {
    cell.input.robot.payload_kg = 10;
    cell.input.command.point_id = 7;
    const CommandResult later = cell.Next().result;
    CHECK(later.point_id == 9);
    CHECK(later.correction.X_BP_command.p == first.correction.X_BP_command.p);
  }
  SECTION("acknowledged") {
    cell.input.command.code = PlcCommandCode::kAcknowledge;
    cell.input.command.sequence = 43;
    const CommandResult later = cell.Next().result;
    CHECK_FALSE(later.valid);
    CHECK(later.sequence == 43);
    CHECK(later.correction.X_BP_command.p == first.correction.X_BP_command.p);
  }
  SECTION("stale input clears the valid bit, the values stay") {
    for (int k = 0; k < 12; ++k) cell.Silent();
    const CommandResult later = cell.Silent().result;
    CHECK_FALSE(later.valid);
    CHECK(later.correction.X_BP_command.p == first.correction.X_BP_command.p);
  }
  SECTION("a pose by command, with a payload of its own") {
    cell.input.command.code = PlcCommandCode::kCorrectPose;
    cell.input.command.pose_valid = true;
    cell.input.command.X_BP = cell.config.cell.robot.X_WB.Inverse() * cell.config.points[1].X_WP;
    cell.input.command.payload_kg = 60;
    cell.input.robot.payload_kg = 5;
    cell.input.command.sequence = 44;
    const CommandResult asked = cell.Next().result;
    REQUIRE(asked.valid);
    CHECK((asked.correction.X_BP_command.p - first.correction.X_BP_command.p).norm() < 1e-8);
    CHECK(asked.point_id == 0);
  }
  SECTION("refusals") {
    std::uint16_t sequence = 100;
    const auto refused = [&](auto change) {
      cell.input.command = {};
      cell.input.command.code = PlcCommandCode::kCorrectPoint;
      cell.input.command.point_id = 9;
      change(cell.input.command);
      cell.input.command.sequence = ++sequence;
      const CommandResult result = cell.Next().result;
      CHECK_FALSE(result.valid);
      CHECK(result.sequence == sequence);
      return result.code;
    };
    CHECK(refused([](PlcCommand& c) { c.point_id = 8; }) == CorrectionCode::kUnknownPoint);
    CHECK(refused([](PlcCommand& c) { c.code = static_cast<PlcCommandCode>(77); }) ==
          CorrectionCode::kBadCommand);
    CHECK(refused([](PlcCommand& c) { c.code = PlcCommandCode::kCorrectPose; }) ==
          CorrectionCode::kBadCommand);
    CHECK(refused([](PlcCommand& c) { c.payload_kg = std::nan(""); }) ==
          CorrectionCode::kPayloadUnknown);
    CHECK(refused([](PlcCommand& c) { c.payload_kg = 1e9; }) == CorrectionCode::kPayloadUnknown);
  }
}

TEST_CASE("the PLC's heartbeat is seen while it changes") {
  Cell cell;
  CHECK((cell.Running().status & status::kPlcHeartbeatSeen) == 0);
  ++cell.input.command.heartbeat;
  CHECK((cell.Next().status & status::kPlcHeartbeatSeen) != 0);
  for (int k = 0; k < 201; ++k) cell.Next();
  const Snapshot& snapshot = cell.Next();
  CHECK((snapshot.status & status::kPlcHeartbeatSeen) == 0);
  CHECK((snapshot.warnings & warning::kPlcHeartbeatLost) != 0);
}

TEST_CASE("coarse joint registers are told with what they cost") {
  Cell cell;
  cell.input.robot.q_resolution = 1e-3;
  const Snapshot& snapshot = cell.Running();
  CHECK((snapshot.warnings & warning::kCoarseJoints) != 0);
  CHECK(snapshot.reading_radius_m > 0.5e-3);
  CHECK(snapshot.reading_radius_m < 5e-3);
}
