#include "firmware-like/machine.h"

#include <catch2/catch.hpp>
#include <limits>

#include "firmware-like/correction/taught_tool.h"
#include "firmware-like/statistics/statistics.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::machine_test {

namespace {

constexpr double kPeriod_s = 0.01;

/// A machine with two points and a robot that is read in every cycle.
struct Cell {
  MachineConfig config;
  model::JointVector taught{6};
  std::optional<Machine> machine;
  MachineInput input;

  Cell() {
    taught << 0.2, 0.4, 0.3, 0.5, 0.8, -0.4;
    config.cell = test::HeavyArm();
    for (int id : {7, 9}) {
      model::JointVector q = taught;
      q[0] += 0.1 * id;
      correction::AssemblyPoint point;
      point.id = id;
      point.near_q = q;
      point.X_WP = config.cell.robot.X_WB * deflection::LoadedArm(config.cell).UnloadedTip(q);
      config.points.push_back(point);
    }
    input.robot.q = taught;
    input.robot.payload_kg = 60;
    input.now_s = 50;
  }

  /// Predicted loaded tip with the robot at its taught joints.
  Vec3 PredictedTip() const {
    deflection::LoadedState state;
    REQUIRE(deflection::LoadedArm(config.cell)
                .AtCommanded(taught, {60, *config.cell.payload_cog_F}, {}, state));
    return state.p_read_W;
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

TEST_CASE("a point without taught joints uses the branch nearest to the robot") {
  Cell cell;
  for (correction::AssemblyPoint& point : cell.config.points) point.near_q.reset();
  const Snapshot& snapshot = cell.Running();
  CHECK(snapshot.points[0].valid);
  CHECK(snapshot.points[1].valid);
  CHECK((snapshot.points[0].correction.q - cell.taught).cwiseAbs().maxCoeff() < 0.75);
}

TEST_CASE("posture of a point: difference from the taught one, nearest limit, singular value") {
  Cell cell;
  cell.config.points[1].near_q = cell.taught;
  (*cell.config.points[1].near_q)[3] += 1.0;  // joint 4 differs by 57 degrees
  const Snapshot& snapshot = cell.Running();
  REQUIRE(snapshot.points[0].valid);
  REQUIRE(snapshot.points[1].valid);
  const correction::PointPosture& taught = snapshot.points[0].posture;
  CHECK(taught.taught);
  CHECK_FALSE(taught.differs);
  CHECK(snapshot.points[1].posture.differs);
  // Joint 3 is at 0.3 of -120..110 degrees, joint 2 at 0.4 of -70..80: joint 2 has less margin.
  CHECK(taught.limit.joint == 1);
  CHECK(taught.limit.distance ==
        Approx(80 * test::kDegree - snapshot.points[0].correction.q[1]).margin(1e-9));
  CHECK(snapshot.points[0].correction.singular_value > cell.config.limits.min_singular_value);
  // The joints change only together with the solution counter.
  const std::uint32_t solutions = snapshot.points[0].solutions;
  CHECK(cell.Next().points[0].solutions == solutions);
  cell.input.robot.payload_kg = 30;
  CHECK(cell.Next().points[0].solutions == solutions + 1);
}

TEST_CASE(
    "joints without limits are ignored for the nearest limit; without any limits there is none") {
  Cell cell;
  constexpr double kNone = std::numeric_limits<double>::infinity();
  for (model::Joint& joint : cell.config.cell.robot.joints) {
    joint.min = -kNone;
    joint.max = kNone;
  }
  CHECK(cell.Running().points[0].posture.limit.joint == -1);
}

TEST_CASE("a preview returns what the cycle will find") {
  Cell cell;
  Machine preview(cell.config);
  const correction::Correction seen =
      preview.Preview(cell.config.points[0], {60, *cell.config.cell.payload_cog_F},
                      *cell.config.points[0].near_q, correction::BranchSearch::kThorough);
  const PointResult& found = cell.Running().points[0];
  REQUIRE(found.valid);
  CHECK(seen.code == correction::CorrectionCode::kOk);
  CHECK(seen.X_BP_command.p.isApprox(found.correction.X_BP_command.p, 1e-9));
  CHECK(seen.uncertainty_m == Approx(found.correction.uncertainty_m));
  CHECK(seen.basis == found.correction.basis);
}

TEST_CASE("unreachable points do not block the branch search of later ones") {
  Cell cell;
  for (correction::AssemblyPoint& point : cell.config.points) point.near_q.reset();
  for (const int id : {1, 2, 3}) {
    correction::AssemblyPoint far;
    far.id = id;
    far.X_WP.p = Vec3(50, 0, 0);
    cell.config.points.insert(cell.config.points.begin(), far);
  }
  const Snapshot& snapshot = cell.Running();
  CHECK(snapshot.points[3].valid);
  CHECK(snapshot.points[4].valid);
  // The result of a failed search is reported until the next search is due.
  for (int k = 0; k < 300; ++k) {
    cell.Next();
    for (const std::size_t far : {0, 1, 2}) {
      REQUIRE(snapshot.points[far].code == correction::CorrectionCode::kUnreachable);
    }
    REQUIRE((snapshot.alarms & alarm::kPointRefused) != 0);
    REQUIRE(snapshot.first_error == correction::CorrectionCode::kUnreachable);
  }
}

TEST_CASE("a refused point without a branch is retried within about a second") {
  Cell cell;
  for (correction::AssemblyPoint& point : cell.config.points) point.near_q.reset();
  const double loaded_m = cell.Running().points[0].correction.translation_B.norm();
  cell.input.robot.payload_kg = 0;
  const double empty_m = cell.Next().points[0].correction.translation_B.norm();
  cell.config.limits.max_translation_m = (loaded_m + empty_m) / 2;
  cell.machine.reset();
  cell.input.robot.payload_kg = 60;
  for (int k = 0; k < 1000; ++k) cell.Next();
  REQUIRE(cell.Next().points[0].code == correction::CorrectionCode::kTooLarge);
  cell.input.robot.payload_kg = 0;
  for (int k = 0; k < 101; ++k) cell.Next();
  CHECK(cell.Next().points[0].valid);
}

TEST_CASE(
    "after a payload change that made the point valid, the next failure is searched without "
    "delay") {
  Cell cell;
  cell.config.payload.source = PayloadPolicy::Source::kRobot;
  cell.config.limits.max_translation_m = 0.5;
  cell.Running();
  const auto with = [&](double payload_kg, int cycles) {
    cell.input.robot.payload_kg = payload_kg;
    for (int k = 0; k < cycles; ++k) cell.Next();
    return cell.Next().points[0].code;
  };
  REQUIRE(with(60, 1) == correction::CorrectionCode::kOk);
  REQUIRE(
      with(3000, 100) !=
      correction::CorrectionCode::kOk);  // unreachable under this load; the search interval grows
  REQUIRE(with(60, 0) == correction::CorrectionCode::kOk);
  CHECK(with(61, 2) == correction::CorrectionCode::kOk);
}

TEST_CASE("stale input withdraws validity; the values remain") {
  Cell cell;
  cell.Running();
  const Vec3 before = cell.machine->Cycle(cell.input).points[0].correction.X_BP_command.p;
  for (int k = 0; k < 11; ++k) cell.Silent();
  const Snapshot& snapshot = cell.Silent();
  CHECK((snapshot.alarms & alarm::kRobotStale) != 0);
  CHECK((snapshot.status & status::kReady) == 0);
  CHECK_FALSE(snapshot.points[0].valid);
  CHECK(snapshot.points[0].code == correction::CorrectionCode::kNoRobot);
  CHECK((snapshot.points[0].correction.X_BP_command.p - before).norm() < 1e-8);
  CHECK(cell.Running().points[0].valid);
}

TEST_CASE("the payload comes from the robot, from a table, or is fixed") {
  Cell cell;
  const auto correction_of = [](const Snapshot& s) {
    return s.points[0].correction.translation_B.norm();
  };
  const double at_60 = correction_of(cell.Running());
  SECTION("unknown payload: refused with its own code and alarm") {
    cell.input.robot.payload_kg.reset();
    const Snapshot& snapshot = cell.Next();
    CHECK(snapshot.points[0].code == correction::CorrectionCode::kPayloadUnknown);
    CHECK((snapshot.alarms & alarm::kPayloadUnknown) != 0);
  }
  SECTION("implausible values are rejected") {
    for (const double mass_kg : {-1.0, 1e6, std::nan("")}) {
      cell.input.robot.payload_kg = mass_kg;
      CHECK(cell.Next().points[0].code == correction::CorrectionCode::kPayloadUnknown);
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
    CHECK(cell.Next().points[0].code == correction::CorrectionCode::kPayloadUnknown);
  }
  SECTION("tool and payload item by the numbers that the controller reports") {
    model::CellModel& declared = cell.config.cell;
    declared.tool.number = 1;
    model::Tool heavy = declared.tool;
    heavy.number = 2;
    heavy.mount_mass_kg += 50;
    declared.further_tools = {heavy};
    declared.payload_items = {{5, 20, *declared.payload_cog_F}};
    cell.machine.reset();
    model::RobotState& robot = cell.input.robot;
    robot.tool_number = 1;
    robot.payload_item = 5;
    robot.payload_kg = 40;
    CHECK(correction_of(cell.Running()) == Approx(at_60));
    CHECK(cell.Next().payload.mass_kg == 60);
    robot.payload_item = 0;
    CHECK(correction_of(cell.Next()) < 0.95 * at_60);
    robot.tool_number = 2;
    robot.payload_item = 5;
    CHECK(correction_of(cell.Next()) > 1.02 * at_60);
    CHECK(cell.Next().undeclared == UndeclaredNumber{});
    const auto undeclared = [&](UndeclaredNumber::Kind kind, std::optional<int> number) {
      const Snapshot& next = cell.Next();
      CHECK(next.points[0].code == correction::CorrectionCode::kPayloadUnknown);
      CHECK(next.undeclared == UndeclaredNumber{kind, number});
    };
    robot.payload_item = 6;
    undeclared(UndeclaredNumber::Kind::kItem, 6);
    robot.payload_item.reset();
    undeclared(UndeclaredNumber::Kind::kItem, std::nullopt);
    robot.payload_item = 0;
    robot.tool_number = 3;
    undeclared(UndeclaredNumber::Kind::kTool, 3);
    robot.tool_number.reset();
    undeclared(UndeclaredNumber::Kind::kTool, std::nullopt);
  }
  SECTION("a number that is not that of the only tool") {
    cell.config.cell.tool.number = 1;
    cell.machine.reset();
    cell.input.robot.tool_number = 2;
    CHECK(cell.Running().points[0].code == correction::CorrectionCode::kPayloadUnknown);
    cell.input.robot.tool_number = 1;
    CHECK(correction_of(cell.Next()) == Approx(at_60));
    cell.input.robot.tool_number.reset();
    CHECK(correction_of(cell.Next()) == Approx(at_60));
  }
  SECTION("an item that makes the payload implausible") {
    cell.config.cell.payload_items = {{5, loads::kMaxPayload_kg, *cell.config.cell.payload_cog_F}};
    cell.machine.reset();
    cell.input.robot.payload_item = 5;
    CHECK(cell.Running().points[0].code == correction::CorrectionCode::kPayloadUnknown);
  }
  SECTION("a point may state its own payload") {
    cell.config.points[0].payload_kg = 60;
    cell.machine.reset();
    cell.input.robot.payload_kg = 10;
    const Snapshot& snapshot = cell.Running();
    CHECK(correction_of(snapshot) == Approx(at_60));
    CHECK(snapshot.points[1].correction.translation_B.norm() < at_60);
    // Its centre of gravity is that of the cell, regardless of the robot's present load.
    cell.input.robot.payload_cog_F = Vec3(0.5, 0.5, 3.0);
    CHECK(correction_of(cell.Next()) == Approx(at_60));
  }
  SECTION(
      "a point's own payload uses the present centre of gravity only if the cell declares none") {
    cell.input.robot.payload_cog_F = cell.config.cell.payload_cog_F;
    cell.config.cell.payload_cog_F.reset();
    cell.config.points[0].payload_kg = 60;
    cell.machine.reset();
    cell.input.robot.payload_kg = 10;
    CHECK(correction_of(cell.Running()) == Approx(at_60));
  }
}

TEST_CASE(
    "a command is executed once per sequence number; its result is frozen until acknowledged") {
  Cell cell;
  // Registers are 0 at start-up; without a new sequence number there is no command.
  cell.input.command.code = model::PlcCommandCode::kCorrectPoint;
  cell.input.command.point_id = 9;
  CHECK_FALSE(cell.Running().result.valid);
  CHECK(cell.Next().result.code == correction::CorrectionCode::kPending);

  cell.input.command.sequence = 42;
  const CommandResult first = cell.Next().result;
  REQUIRE(first.valid);
  CHECK(first.sequence == 42);
  CHECK(cell.machine->snapshot().command_executed);
  CHECK(first.point_id == 9);
  const PointResult& block = cell.Next().points[1];
  CHECK_FALSE(cell.machine->snapshot().command_executed);
  CHECK((first.correction.X_BP_command.p - block.correction.X_BP_command.p).norm() < 1e-8);

  SECTION("frozen while the payload changes; a repeated sequence number has no effect") {
    cell.input.robot.payload_kg = 10;
    cell.input.command.point_id = 7;
    const CommandResult later = cell.Next().result;
    CHECK(later.point_id == 9);
    CHECK(later.correction.X_BP_command.p == first.correction.X_BP_command.p);
  }
  SECTION("acknowledged") {
    cell.input.command.code = model::PlcCommandCode::kAcknowledge;
    cell.input.command.sequence = 43;
    const CommandResult later = cell.Next().result;
    CHECK_FALSE(later.valid);
    CHECK(later.sequence == 43);
    CHECK(later.correction.X_BP_command.p == first.correction.X_BP_command.p);
  }
  SECTION("stale input clears the valid bit; the values remain") {
    for (int k = 0; k < 12; ++k) cell.Silent();
    const CommandResult later = cell.Silent().result;
    CHECK_FALSE(later.valid);
    CHECK(later.correction.X_BP_command.p == first.correction.X_BP_command.p);
  }
  SECTION("a pose command with its own payload") {
    cell.input.command.code = model::PlcCommandCode::kCorrectPose;
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
      cell.input.command.code = model::PlcCommandCode::kCorrectPoint;
      cell.input.command.point_id = 9;
      change(cell.input.command);
      cell.input.command.sequence = ++sequence;
      const CommandResult result = cell.Next().result;
      CHECK_FALSE(result.valid);
      CHECK(result.sequence == sequence);
      return result.code;
    };
    CHECK(refused([](model::PlcCommand& c) { c.point_id = 8; }) ==
          correction::CorrectionCode::kUnknownPoint);
    CHECK(refused([](model::PlcCommand& c) { c.code = static_cast<model::PlcCommandCode>(77); }) ==
          correction::CorrectionCode::kBadCommand);
    CHECK(refused([](model::PlcCommand& c) { c.code = model::PlcCommandCode::kCorrectPose; }) ==
          correction::CorrectionCode::kBadCommand);
    CHECK(refused([](model::PlcCommand& c) { c.payload_kg = std::nan(""); }) ==
          correction::CorrectionCode::kBadCommand);
    CHECK(refused([](model::PlcCommand& c) { c.payload_kg = 1e9; }) ==
          correction::CorrectionCode::kBadCommand);
    CHECK(refused([](model::PlcCommand& c) {
            c.code = model::PlcCommandCode::kProbe;
            c.payload_kg = std::nan("");
          }) == correction::CorrectionCode::kBadCommand);
  }
}

TEST_CASE("a probe is recorded once, together with the model's prediction") {
  Cell cell;
  cell.input.probes_recorded = true;
  cell.Running();
  model::PlcCommand& command = cell.input.command;
  command.code = model::PlcCommandCode::kProbe;
  const deflection::LoadedArm arm(cell.config.cell);
  deflection::LoadedState state;
  REQUIRE(arm.AtCommanded(cell.taught, {60, *cell.config.cell.payload_cog_F}, {}, state));
  const Vec3 predicted_W = state.X_WT.p;
  const Vec3 miss_W(1e-3, -2e-3, 3e-3);
  command.probe_W = predicted_W + miss_W;
  command.sequence = 1;
  cell.input.unix_ms = 1800000000123;
  cell.input.utc_s = 1800000000.125;
  cell.input.robot.temp_C = 24.5;

  const Snapshot& taken = cell.Next();
  REQUIRE(taken.probe_taken);
  CHECK(taken.result.valid);
  CHECK(taken.probe.sequence == 1);
  CHECK(taken.probe.unix_ms == 1800000000123);
  CHECK(taken.probe.utc_s == cell.input.utc_s);
  CHECK(taken.probe.q == cell.taught);
  CHECK(taken.probe.payload_kg == 60);
  CHECK(taken.probe.temp_C == 24.5);
  CHECK((taken.probe.predicted_W - predicted_W).norm() < 1e-12);
  CHECK((*taken.probe.measured_W - predicted_W - miss_W).norm() < 1e-12);
  CHECK((taken.result.correction.X_BP_command.p - state.X_BT.p).norm() < 1e-12);
  CHECK((arm.X_WB().R * taken.result.correction.translation_B - miss_W).norm() < 1e-12);
  CHECK_FALSE(cell.Next().probe_taken);  // the same sequence number

  SECTION("with the mass stated in the command") {
    command.payload_kg = 20;
    command.sequence = 2;
    CHECK(cell.Next().probe.payload_kg == 20);
    CHECK((cell.Next().probe.predicted_W - predicted_W).norm() > 1e-4);
  }
  struct Refusal {
    const char* name;
    void (*spoil)(Cell& cell);
    correction::CorrectionCode code;
  };
  const Refusal refusals[] = {
      {"probes not recorded", [](Cell& c) { c.input.probes_recorded = false; },
       correction::CorrectionCode::kNotRecorded},
      {"not a number", [](Cell& c) { c.input.command.probe_W.reset(); },
       correction::CorrectionCode::kBadCommand},
      {"no payload", [](Cell& c) { c.input.robot.payload_kg.reset(); },
       correction::CorrectionCode::kPayloadUnknown},
      {"robot not trusted", [](Cell& c) { c.input.robot.q[0] = 99; },
       correction::CorrectionCode::kNoRobot},
  };
  for (const Refusal& refusal : refusals) {
    DYNAMIC_SECTION(refusal.name) {
      refusal.spoil(cell);
      command.sequence = 3;
      const Snapshot& refused = cell.Next();
      CHECK_FALSE(refused.probe_taken);
      CHECK_FALSE(refused.result.valid);
      CHECK(refused.result.code == refusal.code);
    }
  }
  SECTION("a monitor restart is forwarded once") {
    command.code = model::PlcCommandCode::kRestartMonitor;
    command.sequence = 4;
    CHECK(cell.Next().monitor_restart);
    CHECK_FALSE(cell.Next().monitor_restart);
  }
  SECTION("background warnings are merged with the machine's own") {
    cell.input.background_warnings = warning::kDrift;
    CHECK((cell.Next().warnings & warning::kDrift) != 0);
    CHECK((cell.Next().status & status::kWarning) != 0);
    cell.input.background_warnings = 0;
    CHECK((cell.Next().warnings & warning::kDrift) == 0);
  }
}

TEST_CASE("a camera probe uses the measured tip and its covariance while the lens is valid") {
  Cell cell;
  cell.Running();
  cell.input.probes_recorded = true;
  model::PlcCommand& command = cell.input.command;
  command.code = model::PlcCommandCode::kProbeByCamera;
  command.sequence = 1;
  CHECK(cell.Next().result.code == correction::CorrectionCode::kNoCamera);
  CHECK((cell.Next().status & status::kLensCalibrated) == 0);

  CameraInput& camera = cell.input.cameras[0];
  camera.configured = camera.lens_valid = camera.tip_valid = true;
  camera.tip.p_W = cell.PredictedTip() + Vec3(1e-3, 2e-3, 3e-3);
  camera.tip.covariance_W = 1e-8 * Mat3::Identity();
  camera.tip_time_s = cell.input.now_s;
  command.sequence = 2;
  const Snapshot taken = cell.Next();
  REQUIRE(taken.probe_taken);
  CHECK(taken.result.valid);
  CHECK(*taken.probe.measured_W == camera.tip.p_W);
  REQUIRE(taken.probe.covariance_W);
  CHECK(*taken.probe.covariance_W == camera.tip.covariance_W);
  CHECK((taken.status & status::kLensCalibrated) != 0);
  CHECK_FALSE(cell.Next().probe_taken);

  SECTION("a probe with the second tool, which is much longer, and an item") {
    model::CellModel& declared = cell.config.cell;
    declared.tool.number = 1;
    model::Tool pole = declared.tool;
    pole.number = 2;
    pole.tcp_F.z() += 5;
    declared.further_tools = {pole};
    declared.payload_items = {{5, 20, *declared.payload_cog_F}};
    cell.machine.reset();
    cell.input.robot.payload_kg = 40;
    cell.input.robot.tool_number = 2;
    cell.input.robot.payload_item = 5;
    cell.Running();
    loads::Payload payload{60, *declared.payload_cog_F};
    payload.tool = 1;
    deflection::LoadedState state;
    REQUIRE(deflection::LoadedArm(declared).AtCommanded(cell.taught, payload, {}, state));
    command.code = model::PlcCommandCode::kProbe;
    command.probe_W = state.p_read_W;
    command.sequence += 1;
    const Snapshot& probed = cell.Next();
    REQUIRE(probed.probe_taken);
    CHECK_FALSE(probed.probe.quarantined);
    CHECK(probed.probe.tool_number == 2);
    CHECK(probed.probe.payload_item == 5);
    CHECK(probed.probe.payload_kg == Approx(40));
    CHECK((probed.probe.predicted_W - state.p_read_W).norm() < 1e-9);
  }
  SECTION("a probe measured by the PLC has no covariance") {
    command.code = model::PlcCommandCode::kProbe;
    command.probe_W = cell.PredictedTip();
    command.sequence = 3;
    REQUIRE(cell.Next().probe_taken);
    CHECK_FALSE(cell.Next().probe.covariance_W);
  }
  struct Refusal {
    const char* name;
    void (*spoil)(Cell& cell);
    correction::CorrectionCode code;
  };
  const Refusal refusals[] = {
      {"stale", [](Cell& c) { c.input.cameras[0].lens_valid = false; },
       correction::CorrectionCode::kLensStale},
      {"moving", [](Cell& c) { c.input.cameras[0].tip_valid = false; },
       correction::CorrectionCode::kTipNotSeen},
      {"old", [](Cell& c) { c.input.cameras[0].tip_time_s -= 1; },
       correction::CorrectionCode::kTipNotSeen},
      {"no number", [](Cell& c) { c.input.cameras[0].tip.p_W.x() = NAN; },
       correction::CorrectionCode::kTipNotSeen},
      {"probes not recorded", [](Cell& c) { c.input.probes_recorded = false; },
       correction::CorrectionCode::kNotRecorded},
  };
  for (const Refusal& refusal : refusals) {
    DYNAMIC_SECTION(refusal.name) {
      refusal.spoil(cell);
      command.sequence = 4;
      const Snapshot& refused = cell.Next();
      CHECK_FALSE(refused.probe_taken);
      CHECK(refused.result.code == refusal.code);
    }
  }
  SECTION("a calibration is started and cancelled once each") {
    command.code = model::PlcCommandCode::kStartCalibration;
    command.sequence = 5;
    CHECK(cell.Next().calibration_requests[0] == CalibrationRequest::kStart);
    CHECK(cell.Next().calibration_requests[0] == CalibrationRequest::kNone);
    command.code = model::PlcCommandCode::kCancelCalibration;
    command.sequence = 6;
    CHECK(cell.Next().calibration_requests[0] == CalibrationRequest::kCancel);
    camera.configured = false;
    command.sequence = 7;
    const Snapshot& refused = cell.Next();
    CHECK(refused.calibration_requests[0] == CalibrationRequest::kNone);
    CHECK(refused.result.code == correction::CorrectionCode::kNoCamera);
  }
}

TEST_CASE("points that require a camera are withdrawn while its lens is not valid") {
  Cell cell;
  cell.config.required_lenses[0] = true;
  const Snapshot& snapshot = cell.Running();  // the camera has not reported yet
  CHECK(snapshot.lenses_missing == 1);
  CHECK_FALSE(snapshot.points[0].valid);
  CHECK_FALSE(snapshot.points[0].ever_valid);
  CHECK(snapshot.first_error == correction::CorrectionCode::kLensStale);
  CHECK(snapshot.health.reason == HealthReason::kRequiredLens);
  CHECK((snapshot.alarms & alarm::kPointRefused) != 0);

  CameraInput& camera = cell.input.cameras[0];
  camera.configured = camera.lens_valid = true;
  cell.Running();
  REQUIRE(snapshot.points[0].valid);
  CHECK(snapshot.lenses_missing == 0);
  CHECK(snapshot.alarms == 0);

  model::PlcCommand& command = cell.input.command;
  command.code = model::PlcCommandCode::kCorrectPoint;
  command.point_id = 7;
  command.sequence = 1;
  cell.Next();
  REQUIRE(snapshot.result.valid);

  // The zoom is turned: within one cycle nothing is valid, and the values remain.
  camera.lens_valid = false;
  const Vec3 position = snapshot.points[0].correction.X_BP_command.p;
  const std::uint16_t sequence = snapshot.points[0].sequence;
  cell.input.robot.payload_kg = 30;
  cell.Next();
  CHECK_FALSE(snapshot.points[0].valid);
  CHECK(snapshot.points[0].code == correction::CorrectionCode::kLensStale);
  CHECK(snapshot.points[0].correction.X_BP_command.p == position);
  CHECK(snapshot.points[0].sequence == sequence);
  CHECK((snapshot.status & status::kReady) == 0);
  CHECK_FALSE(snapshot.result.valid);
  CHECK(snapshot.result.correction.X_BP_command.p == position);

  SECTION("the robot's own fault is reported first") {
    for (int k = 0; k < 100; ++k) cell.Silent();
    CHECK(snapshot.points[0].code == correction::CorrectionCode::kNoRobot);
  }
  SECTION("commands for a corrected point or pose are refused, predictions are not") {
    command.payload_kg = 40;
    command.sequence = 2;
    CHECK(cell.Next().result.code == correction::CorrectionCode::kLensStale);
    command.X_BP = snapshot.points[0].correction.X_BP_command;
    command.pose_valid = true;
    command.code = model::PlcCommandCode::kCorrectPose;
    command.sequence = 3;
    CHECK(cell.Next().result.code == correction::CorrectionCode::kLensStale);
    CHECK_FALSE(snapshot.result.valid);
    command.code = model::PlcCommandCode::kPredictLanding;
    command.sequence = 4;
    CHECK(cell.Next().result.code == correction::CorrectionCode::kOk);
    CHECK(cell.Next().result.valid);
  }
  SECTION("once the lens is valid again, the points are those of the present payload") {
    camera.lens_valid = true;
    cell.Next();
    CHECK(snapshot.points[0].valid);
    CHECK(snapshot.points[0].correction.X_BP_command.p != position);
  }
}

TEST_CASE("points require only the cameras that are configured so") {
  Cell cell;
  for (CameraInput& camera : cell.input.cameras) camera.configured = true;
  cell.input.cameras[1].lens_valid = true;
  CHECK(cell.Running().points[0].valid);  // none: as without a camera
  Cell second;
  second.config.required_lenses[1] = true;
  second.input.cameras = cell.input.cameras;
  CHECK(second.Running().points[0].valid);
  second.input.cameras[1].lens_valid = false;
  CHECK(second.Next().lenses_missing == 2);
  CHECK_FALSE(second.Next().points[0].valid);
}

TEST_CASE("two cameras: mean of both, selection of one, contradiction") {
  Cell cell;
  cell.Running();
  cell.input.probes_recorded = true;
  model::PlcCommand& command = cell.input.command;
  command.code = model::PlcCommandCode::kProbeByCamera;
  for (CameraInput& camera : cell.input.cameras) {
    camera.configured = camera.lens_valid = camera.tip_valid = true;
    camera.tip_time_s = cell.input.now_s;
  }
  CameraInput& side = cell.input.cameras[0];
  CameraInput& rear = cell.input.cameras[1];
  const Vec3 tip_W = cell.PredictedTip();
  side.tip = {tip_W, 1e-8 * Mat3::Identity(), Mat3::Zero()};
  rear.tip = {tip_W + Vec3(3e-4, 0, 0), 3e-8 * Mat3::Identity(), Mat3::Zero()};
  command.sequence = 1;
  Snapshot taken = cell.Next();
  REQUIRE(taken.probe_taken);
  CHECK(taken.probe.cameras == 3);
  CHECK((*taken.probe.measured_W - tip_W - Vec3(7.5e-5, 0, 0)).norm() < 1e-12);
  CHECK((*taken.probe.covariance_W - 0.75e-8 * Mat3::Identity()).norm() < 1e-20);
  CHECK((taken.status & status::kLensCalibrated) != 0);

  SECTION("one is stale: the other is used, and the status shows it") {
    side.lens_valid = false;
    command.sequence = 2;
    taken = cell.Next();
    REQUIRE(taken.probe_taken);
    CHECK(taken.probe.cameras == 2);
    CHECK(*taken.probe.measured_W == rear.tip.p_W);
    CHECK((taken.status & status::kLensCalibrated) == 0);
    command.camera = 1;
    command.sequence = 3;
    CHECK(cell.Next().result.code == correction::CorrectionCode::kLensStale);
  }
  SECTION("one is selected; a third does not exist") {
    command.camera = 1;
    command.sequence = 2;
    CHECK(*cell.Next().probe.measured_W == side.tip.p_W);
    command.camera = 3;
    command.sequence = 3;
    CHECK(cell.Next().result.code == correction::CorrectionCode::kNoCamera);
  }
  SECTION("they contradict each other") {
    rear.tip.p_W.x() += 0.002;
    command.sequence = 2;
    taken = cell.Next();
    CHECK_FALSE(taken.probe_taken);
    CHECK(taken.result.code == correction::CorrectionCode::kCamerasDisagree);
    rear.tip.tag_covariance_W =
        4e-7 * Mat3::Identity();  // explained by errors in the tag positions
    command.sequence = 3;
    CHECK(cell.Next().probe_taken);
  }
  SECTION("calibration of the requesting camera, of all if none requests it, of the selected one") {
    using Order = CalibrationRequest;
    const auto orders = [&](model::PlcCommandCode code, std::uint16_t camera) {
      command.code = code;
      command.camera = camera;
      ++command.sequence;
      return cell.Next().calibration_requests;
    };
    using Orders = std::array<Order, model::kMaxCameras>;
    CHECK(orders(model::PlcCommandCode::kStartCalibration, 0) ==
          Orders{Order::kStart, Order::kStart});
    CHECK(orders(model::PlcCommandCode::kStartCalibration, 2) ==
          Orders{Order::kNone, Order::kStart});
    rear.board_wanted = true;
    CHECK(orders(model::PlcCommandCode::kStartCalibration, 0) ==
          Orders{Order::kNone, Order::kStart});
    CHECK(orders(model::PlcCommandCode::kStartCalibration, 1) ==
          Orders{Order::kStart, Order::kNone});
    CHECK(orders(model::PlcCommandCode::kCancelCalibration, 0) ==
          Orders{Order::kCancel, Order::kCancel});
    CHECK(orders(model::PlcCommandCode::kCancelCalibration, 3) ==
          Orders{Order::kNone, Order::kNone});
  }
}

TEST_CASE("points whose branches are searched in the background are pending individually") {
  Cell cell;
  cell.machine.emplace(cell.config);
  Machine searching(cell.config);
  cell.machine->MarkTaughtBranchesPending();
  const Snapshot& snapshot = cell.Running();
  CHECK(snapshot.input_fault == InputFault::kOk);
  for (const PointResult& point : snapshot.points) {
    CHECK_FALSE(point.valid);
    CHECK(point.code == correction::CorrectionCode::kPending);
  }
  CHECK(snapshot.alarms == 0);  // nothing is refused
  CHECK((snapshot.status & status::kReady) == 0);
  cell.machine->SetTaughtBranch(1, searching.FindTaughtBranch(1));
  cell.Next();
  CHECK(snapshot.points[0].code == correction::CorrectionCode::kPending);
  CHECK(snapshot.points[1].valid);
  SECTION("the cycle continues from the branch found") {
    cell.machine->SetTaughtBranch(0, searching.FindTaughtBranch(0));
    CHECK(cell.Next().points[0].valid);
    Cell prepared;
    const Snapshot& same = prepared.Running();
    for (const std::size_t k : {0, 1}) {
      CHECK(snapshot.points[k].correction.X_BP_command.p ==
            same.points[k].correction.X_BP_command.p);
    }
  }
  SECTION("the cycle searches if no branch was found") {
    cell.machine->SetTaughtBranch(0, {});
    CHECK(cell.Next().points[0].valid);
  }
}

TEST_CASE("a point is solved with the tool that was mounted when it was taught") {
  Cell cell;
  model::CellModel& declared = cell.config.cell;
  const correction::AssemblyPoint& point = cell.config.points[0];
  REQUIRE(point.near_q);
  const std::optional<model::JointVector> alone = Machine(cell.config).FindTaughtBranch(0);
  REQUIRE(alone);
  declared.tool.number = 4;
  model::Tool taught = declared.tool;
  taught.number = 7;
  declared.tool.tcp_F.z() += 3;  // no posture reaches the point with it
  declared.tool.rigid = true;
  declared.tool.segments.clear();
  declared.further_tools = {taught};
  CHECK(correction::TaughtTool(deflection::LoadedArm(declared), point) == 1);
  Machine several(cell.config);
  const std::optional<model::JointVector> found = several.FindTaughtBranch(0);
  REQUIRE(found);
  CHECK((*found - *alone).norm() < 1e-9);
}

TEST_CASE("a probe is refused with kStorageUnavailable if the disk is not writable") {
  Cell cell;
  cell.Running();
  cell.input.storage_unavailable = GENERATE(false, true);
  const correction::CorrectionCode why = cell.input.storage_unavailable
                                             ? correction::CorrectionCode::kStorageUnavailable
                                             : correction::CorrectionCode::kNotRecorded;
  for (const model::PlcCommandCode code :
       {model::PlcCommandCode::kProbe, model::PlcCommandCode::kRestartMonitor}) {
    cell.input.command.code = code;
    cell.input.command.probe_W = Vec3(1, 2, 3);
    ++cell.input.command.sequence;
    const Snapshot& snapshot = cell.Next();
    CHECK(snapshot.result.code == why);
    CHECK_FALSE(snapshot.probe_taken);
    CHECK_FALSE(snapshot.monitor_restart);
    CHECK(snapshot.points[0].valid);
  }
}

TEST_CASE("a new configuration continues from the values of the previous one") {
  Cell cell;
  cell.Running();
  cell.input.command.sequence = 42;
  cell.input.command.code = model::PlcCommandCode::kCorrectPoint;
  cell.input.command.point_id = 9;
  cell.input.command.acknowledge = true;
  cell.input.command.heartbeat = 5;
  const Snapshot before = cell.Next();
  REQUIRE(before.result.valid);

  MachineConfig changed = cell.config;
  std::swap(changed.points[0], changed.points[1]);
  changed.points[1].id = 8;
  Machine next(changed);
  next.Prepare();
  next.ResumeFrom(*cell.machine, Machine::RobotLinkContinuity::kNew);
  cell.machine.emplace(std::move(next));
  SECTION("values remain, not valid until the robot is trusted; a new point has none") {
    const Snapshot& after = cell.Next();
    CHECK(after.result.sequence == 42);
    CHECK(after.result.point_id == 9);
    CHECK(after.result.unix_ms == before.result.unix_ms);
    CHECK(after.result.correction.X_BP_command.p == before.result.correction.X_BP_command.p);
    CHECK_FALSE(after.result.valid);
    CHECK_FALSE(after.points[0].valid);
    CHECK(after.points[0].ever_valid);
    CHECK(after.points[0].sequence == before.points[1].sequence);
    CHECK(after.points[0].correction.X_BP_command.p == before.points[1].correction.X_BP_command.p);
    CHECK_FALSE(after.points[1].ever_valid);
    CHECK((after.status & status::kPlcHeartbeatSeen) != 0);
    CHECK(cell.Running().points[0].valid);
  }
  SECTION("the level of the acknowledge coil is not a new edge, and a new command is executed") {
    cell.Next();
    cell.Next();
    cell.input.command.sequence = 43;
    const CommandResult result = cell.Next().result;
    CHECK(result.sequence == 43);
    CHECK(result.valid);
  }
  SECTION("a command that arrives with the first cycle is executed") {
    cell.input.command.sequence = 43;
    const CommandResult result = cell.Next().result;
    CHECK(result.sequence == 43);
    CHECK(result.code == correction::CorrectionCode::kNoRobot);
  }
}

TEST_CASE("with the same robot link, the points of a new model are valid in its first cycle") {
  Cell cell;
  // More points without taught joints than one cycle may search.
  for (int id = 20; id < 28; ++id) {
    correction::AssemblyPoint point = cell.config.points[0];
    point.id = id;
    point.near_q.reset();
    point.X_WP.p.z() += 0.005 * (id - 20);
    cell.config.points.push_back(point);
  }
  cell.input.robot.temp_C = 31.5;
  cell.input.robot.q_resolution = 1e-3;
  for (int k = 0; k < 20; ++k) cell.Next();
  const Snapshot before = cell.Next();
  REQUIRE(before.alarms == 0);
  REQUIRE((before.status & status::kReady) != 0);
  REQUIRE((before.warnings & warning::kCoarseJoints) != 0);

  MachineConfig changed = cell.config;
  changed.cell.robot.joints[1].compliance_rad_per_Nm = 1.2e-6;
  changed.points.erase(changed.points.begin() + 1);
  Machine next(changed);
  next.Prepare();
  next.Prepare(cell.config, before, 0);
  next.ResumeFrom(*cell.machine, Machine::RobotLinkContinuity::kKept);
  cell.machine.emplace(std::move(next));
  const bool new_reading = GENERATE(true, false);
  const Snapshot after = new_reading ? cell.Next() : cell.Silent();
  CHECK(after.alarms == 0);
  CHECK((after.status & status::kReady) != 0);
  CHECK(after.payload_valid);
  CHECK((after.warnings & warning::kCoarseJoints) != 0);
  for (std::size_t k = 0; k < after.points.size(); ++k) {
    const std::size_t former = k == 0 ? 0 : k + 1;
    CAPTURE(k);
    CHECK(after.points[k].valid);
    CHECK(after.points[k].sequence == before.points[former].sequence + 1);
    // The new model's value in the previous posture.
    const correction::Correction &now = after.points[k].correction,
                                 &was = before.points[former].correction;
    CHECK((now.X_BP_command.p - was.X_BP_command.p).norm() > 1e-4);
    CHECK((now.q - was.q).cwiseAbs().maxCoeff() < 0.05);
  }
  // It does not change afterwards.
  const Snapshot later = cell.Running();
  for (std::size_t k = 0; k < after.points.size(); ++k) {
    CHECK((later.points[k].correction.X_BP_command.p - after.points[k].correction.X_BP_command.p)
              .norm() < 1e-7);
  }
}

TEST_CASE("with the same link, a robot that was not trusted is not trusted under a new model") {
  Cell cell;
  cell.Running();
  for (int k = 0; k < 50; ++k) cell.Silent();
  const Snapshot before = cell.Silent();
  REQUIRE(before.input_fault == InputFault::kStale);
  Machine next(cell.config);
  next.Prepare();
  next.Prepare(cell.config, before, 0);
  next.ResumeFrom(*cell.machine, Machine::RobotLinkContinuity::kKept);
  cell.machine.emplace(std::move(next));
  CHECK(cell.Next().input_fault == InputFault::kStale);  // one reading is not enough
  CHECK_FALSE(cell.Next().points[0].valid);
  CHECK(cell.Next().points[0].valid);
}

TEST_CASE("results of probes and of a monitor restart survive a new configuration") {
  for (const model::PlcCommandCode code :
       {model::PlcCommandCode::kProbe, model::PlcCommandCode::kProbeFine,
        model::PlcCommandCode::kRestartMonitor}) {
    CAPTURE(static_cast<int>(code));
    Cell cell;
    cell.input.probes_recorded = true;
    cell.Running();
    cell.input.command.code = code;
    cell.input.command.probe_W = cell.PredictedTip();
    cell.input.command.sequence = 77;
    const Snapshot before = cell.Next();
    REQUIRE(before.result.code == correction::CorrectionCode::kOk);
    REQUIRE(before.probe_taken != before.monitor_restart);

    Machine next(cell.config);
    next.Prepare();
    next.ResumeFrom(*cell.machine, Machine::RobotLinkContinuity::kNew);
    cell.machine.emplace(std::move(next));
    for (int cycle = 0; cycle < 5; ++cycle) {
      const Snapshot& after = cell.Next();
      CHECK_FALSE(after.probe_taken);  // not a second time
      CHECK_FALSE(after.monitor_restart);
      CHECK(after.result.command == code);
      CHECK(after.result.sequence == 77);
      CHECK(after.result.code == correction::CorrectionCode::kOk);
      CHECK(after.result.unix_ms == before.result.unix_ms);
      CHECK(after.result.correction.translation_B == before.result.correction.translation_B);
      CHECK(after.probe.sequence == before.probe.sequence);
      CHECK(*after.probe.measured_W == *before.probe.measured_W);
    }
    cell.input.command.sequence = 78;
    const Snapshot& again = cell.Next();
    CHECK((again.probe_taken || again.monitor_restart));
  }
}

namespace {

/// A cell that sends probes with command 6, and the result of each.
struct ProbingCell : Cell {
  ProbingCell() {
    input.probes_recorded = true;
    input.command.code = model::PlcCommandCode::kProbe;
    Running();
  }
  const Snapshot& Probe(const Vec3& measured_W) {
    input.command.probe_W = measured_W;
    ++input.command.sequence;
    return Next();
  }
};

void CheckNoPose(const CommandResult& result) {
  CHECK_FALSE(result.valid);
  CHECK(result.correction.X_BP_command.p.isZero());
  CHECK(result.correction.X_BP_command.R.isIdentity());
  CHECK(result.correction.translation_B.isZero());
  CHECK(result.correction.rotation_B.isZero());
  CHECK(result.correction.uncertainty_m == 0);
  CHECK_FALSE(result.correction.extrapolated);
}

}  // namespace

TEST_CASE("an implausible probe is refused, counted and not forwarded") {
  ProbingCell cell;
  const Vec3 tip_W = cell.PredictedTip();
  struct Nonsense {
    const char* name;
    Vec3 measured_W;
    ProbeFault fault;
  };
  const Nonsense nonsense[] = {
      {"zero", Vec3::Zero(), ProbeFault::kZero},
      {"in metres", 1e-3 * tip_W, ProbeFault::kInMetres},
      {"in metres, with a model error", 1e-3 * (tip_W + Vec3(0, 0, -0.02)), ProbeFault::kInMetres},
      {"the largest integer, in mm", Vec3::Constant(2147483647e-3), ProbeFault::kBeyondReach},
      {"the largest integer, in um", Vec3::Constant(2147483647e-6), ProbeFault::kBeyondReach},
      {"beyond the arm's reach", tip_W + Vec3(0, 0, 6), ProbeFault::kBeyondReach},
  };
  std::uint32_t refused = 0;
  for (const Nonsense& one : nonsense) {
    CAPTURE(one.name);
    const Snapshot& snapshot = cell.Probe(one.measured_W);
    CHECK(snapshot.result.code == correction::CorrectionCode::kProbeImplausible);
    CHECK_FALSE(snapshot.probe_taken);
    CHECK(snapshot.probes.fault == one.fault);
    CHECK(snapshot.probes.measured_W == one.measured_W);
    CHECK(snapshot.probes.refused == ++refused);
    CheckNoPose(snapshot.result);
  }
  const Snapshot& taken = cell.Probe(tip_W + Vec3(0, 0, -0.02));
  CHECK(taken.probe_taken);
  CHECK(taken.result.code == correction::CorrectionCode::kOk);
  CHECK_FALSE(taken.probe.quarantined);
  CHECK(taken.probes.fault == ProbeFault::kNone);
  CHECK(taken.probes.refused == refused);
}

TEST_CASE("a probe on an artefact is recorded without a measured tip") {
  Cell cell;
  cell.config.cell.artefacts = {{"ball", model::ArtefactKind::kPoint, {}, {}, {}, 0, true},
                                {"table", model::ArtefactKind::kPlane, {}, {}, {}, 0, true},
                                {"dial", model::ArtefactKind::kGauge, {}, {}, {}, 0, false}};
  cell.input.probes_recorded = true;
  cell.Running();
  model::PlcCommand& command = cell.input.command;
  const auto probe = [&](model::PlcCommandCode code, std::uint16_t artefact,
                         std::optional<double> reading_m) -> const Snapshot& {
    command.code = code;
    command.point_id = artefact;
    command.reading_m = reading_m;
    ++command.sequence;
    return cell.Next();
  };
  const auto touch = model::PlcCommandCode::kProbeTouch;
  const auto reading = model::PlcCommandCode::kProbeReading;
  const Snapshot touched = probe(touch, 2, {});
  REQUIRE(touched.probe_taken);
  CHECK(touched.result.valid);
  CHECK(touched.result.point_id == 2);
  CHECK(touched.probe.artefact_number == 2);
  CHECK(touched.probe.q == cell.taught);
  CHECK_FALSE(touched.probe.measured_W);
  CHECK_FALSE(touched.probe.gauge_m);
  CHECK_FALSE(touched.probe.range_m);
  CHECK(probe(reading, 1, 0.8).probe.range_m == 0.8);
  CHECK(probe(reading, 3, -1.5e-4).probe.gauge_m == -1.5e-4);
  CHECK_FALSE(cell.Next().probe_taken);  // the same sequence number
  struct Refusal {
    model::PlcCommandCode code;
    std::uint16_t artefact;
    std::optional<double> reading_m;
  };
  for (const Refusal& refused : {Refusal{touch, 0, {}},
                                 {touch, 4, {}},
                                 {touch, 3, {}},
                                 {reading, 2, 0.1},
                                 {reading, 1, 0.0},
                                 {reading, 1, -0.8},
                                 {reading, 3, {}},
                                 {reading, 3, 1.2}}) {
    CAPTURE(refused.artefact, refused.reading_m.value_or(-1));
    const Snapshot& snapshot = probe(refused.code, refused.artefact, refused.reading_m);
    CHECK_FALSE(snapshot.probe_taken);
    CHECK(snapshot.result.code == correction::CorrectionCode::kBadCommand);
  }
}

TEST_CASE("the press of a gauge's button is a probe, and leaves the PLC's result as it is") {
  Cell cell;
  cell.config.cell.artefacts = {{"ball", model::ArtefactKind::kPoint, {}, {}, {}, 0, true},
                                {"dial", model::ArtefactKind::kGauge, {}, {}, {}, 0, false}};
  cell.input.probes_recorded = true;
  cell.Running();
  const auto press = [&](std::uint16_t artefact, double reading_m) -> const Snapshot& {
    cell.input.gauge = GaugePress{1, artefact, reading_m, cell.input.now_s, 2e-6};
    return cell.Next();
  };
  const CommandResult before = cell.Next().result;
  const Snapshot pressed = press(2, -1.5e-4);
  REQUIRE(pressed.gauge_code == correction::CorrectionCode::kOk);
  REQUIRE(pressed.probe_taken);
  CHECK(pressed.probe.by_gauge);
  CHECK(pressed.probe.artefact_number == 2);
  CHECK(pressed.probe.gauge_m == -1.5e-4);
  CHECK(pressed.probe.sigma_m == 2e-6);
  CHECK(pressed.probe.q == cell.taught);
  CHECK_FALSE(pressed.probe.measured_W);
  CHECK(pressed.result.sequence == before.sequence);
  CHECK(pressed.result.code == before.code);
  CHECK(pressed.result.valid == before.valid);

  CHECK(press(1, 1e-4).gauge_code == correction::CorrectionCode::kBadCommand);  // no gauge
  CHECK(press(3, 1e-4).gauge_code == correction::CorrectionCode::kBadCommand);  // no artefact
  CHECK(press(2, 0.6).gauge_code == correction::CorrectionCode::kBadCommand);
  CHECK(press(2, std::nan("")).gauge_code == correction::CorrectionCode::kBadCommand);
  CHECK_FALSE(cell.Next().probe_taken);

  // A probe of the PLC in the same cycle goes first; the press waits, and its sigma stays its own.
  model::PlcCommand& command = cell.input.command;
  command.code = model::PlcCommandCode::kProbeTouch;
  command.point_id = 1;
  ++command.sequence;
  const Snapshot touched = press(2, 2e-4);
  CHECK_FALSE(touched.gauge_code);
  CHECK(touched.probe.artefact_number == 1);
  CHECK_FALSE(touched.probe.by_gauge);
  CHECK_FALSE(touched.probe.sigma_m);
  CHECK(cell.Next().gauge_code == correction::CorrectionCode::kOk);

  cell.input.probes_recorded = false;
  CHECK(cell.Next().gauge_code == correction::CorrectionCode::kNotRecorded);
  cell.input.probes_recorded = true;
  cell.input.robot.q[1] += 0.01;
  CHECK(cell.Next().gauge_code == correction::CorrectionCode::kRobotMoving);
}

TEST_CASE("fine-integer and camera probes are checked against the same bounds") {
  ProbingCell cell;
  cell.input.command.code = model::PlcCommandCode::kProbeFine;
  CHECK(cell.Probe(Vec3::Zero()).result.code == correction::CorrectionCode::kProbeImplausible);
  cell.input.command.code = model::PlcCommandCode::kProbeByCamera;
  CameraInput& camera = cell.input.cameras[0];
  camera.configured = camera.lens_valid = camera.tip_valid = true;
  camera.tip.covariance_W = 1e-8 * Mat3::Identity();
  camera.tip_time_s = cell.input.now_s;
  camera.tip.p_W = Vec3(0, 0, 40);
  CHECK(cell.Probe({}).result.code == correction::CorrectionCode::kProbeImplausible);
  camera.tip.p_W = cell.PredictedTip() + Vec3(0.4, 0, 0);
  const Snapshot& kept = cell.Probe({});
  CHECK(kept.result.code == correction::CorrectionCode::kProbeQuarantined);
  CHECK(kept.probe.quarantined);
  REQUIRE(kept.probe.covariance_W);
  CHECK(kept.probe.cameras == 1);
}

TEST_CASE("a probe that contradicts the model is forwarded as quarantined") {
  ProbingCell cell;
  const Vec3 tip_W = cell.PredictedTip();
  const double bound_m = cell.Next().probes.contradiction_m;
  // The largest allowed correction plus half a degree over about four metres.
  CHECK(bound_m > cell.config.limits.max_translation_m + 0.03);
  CHECK(bound_m < cell.config.limits.max_translation_m + 0.06);
  CHECK_FALSE(cell.Probe(tip_W + Vec3(0.99 * bound_m, 0, 0)).probe.quarantined);
  const Vec3 miss_W(0, 1.01 * bound_m, 0);
  const Snapshot& kept = cell.Probe(tip_W + miss_W);
  REQUIRE(kept.probe_taken);
  CHECK(kept.probe.quarantined);
  CHECK(kept.result.code == correction::CorrectionCode::kProbeQuarantined);
  CHECK_FALSE(kept.result.valid);
  const Mat3 R_WB = cell.config.cell.robot.X_WB.R;
  CHECK((R_WB * kept.result.correction.translation_B - miss_W).norm() < 1e-12);
  CHECK(kept.result.correction.X_BP_command.p.norm() > 0.1);
}

TEST_CASE("a probe is refused while a joint moves, and recorded at standstill") {
  ProbingCell cell;
  const Vec3 tip_W = cell.PredictedTip();
  const auto code = [&] { return cell.Probe(tip_W).result.code; };
  REQUIRE(code() == correction::CorrectionCode::kOk);
  const auto stand = [&](double seconds) {
    for (double t = 0; t < seconds; t += kPeriod_s) cell.Next();
  };
  SECTION("a motion, and its end") {
    for (int k = 0; k < 10; ++k) {
      cell.input.robot.q[1] += 1e-3;
      CHECK(code() == correction::CorrectionCode::kRobotMoving);
    }
    CHECK_FALSE(cell.Next().probes.standstill);
    CHECK(cell.Next().probes.fault == ProbeFault::kRobotMoving);
    CHECK(cell.Next().probes.refused == 10);
    CheckNoPose(cell.Next().result);
    cell.input.robot.q[1] -= 10e-3;
    stand(0.25);
    CHECK(cell.Next().probes.standstill);
    CHECK(code() == correction::CorrectionCode::kOk);
  }
  SECTION("slow creep accumulates") {
    int moving = 0;
    for (int k = 0; k < 100; ++k) {
      cell.input.robot.q[0] += 1e-5;  // 1 mrad/s, a tenth of the threshold per reading
      moving += code() == correction::CorrectionCode::kRobotMoving ? 1 : 0;
    }
    CHECK(moving > 85);
  }
  SECTION("jitter of a servo that holds its position is tolerated") {
    for (int k = 0; k < 50; ++k) {
      cell.input.robot.q[2] += k % 2 == 0 ? 4e-5 : -4e-5;
      CHECK(code() == correction::CorrectionCode::kOk);
    }
  }
  SECTION("coarse registers: one step is no motion, two are") {
    cell.input.robot.q_resolution = 1e-3;
    cell.input.robot.q[3] += 1e-3;
    CHECK(code() == correction::CorrectionCode::kOk);
    cell.input.robot.q[3] += 1e-3;
    CHECK(code() == correction::CorrectionCode::kRobotMoving);
  }
  SECTION("motion is detected on a controller that refreshes every 0.1 s") {
    int refused = 0;
    for (int k = 0; k < 100; ++k) {
      if (k % 10 == 0) cell.input.robot.q[0] += 5e-3;
      refused += code() == correction::CorrectionCode::kRobotMoving ? 1 : 0;
    }
    CHECK(refused == 100);
  }
}

TEST_CASE("with the same link, standstill detection continues under a new model") {
  ProbingCell cell;
  const Vec3 tip_W = cell.PredictedTip();
  const bool moving = GENERATE(true, false);
  if (moving) cell.input.robot.q[1] += 1e-3;
  REQUIRE(cell.Next().probes.standstill != moving);
  Machine next(cell.config);
  next.Prepare();
  next.ResumeFrom(*cell.machine, Machine::RobotLinkContinuity::kKept);
  CHECK(next.snapshot().probes.standstill != moving);
  cell.machine.emplace(std::move(next));
  CHECK((cell.Probe(tip_W).result.code == correction::CorrectionCode::kRobotMoving) == moving);
  for (double t = 0; t < 0.25; t += kPeriod_s) cell.Next();
  CHECK(cell.Next().probes.standstill);
}

TEST_CASE("before the journal is open a probe is pending; without a journal it is not recorded") {
  ProbingCell cell;
  cell.input.probes_recorded = false;
  cell.input.probes_pending = true;
  CHECK(cell.Probe(cell.PredictedTip()).result.code == correction::CorrectionCode::kPending);
  cell.input.command.code = model::PlcCommandCode::kRestartMonitor;
  CHECK(cell.Probe({}).result.code == correction::CorrectionCode::kPending);
  CHECK_FALSE(cell.Next().monitor_restart);
  cell.input.probes_pending = false;
  CHECK(cell.Probe({}).result.code == correction::CorrectionCode::kNotRecorded);
}

TEST_CASE("a refused command does not return the pose of the previous one") {
  Cell cell;
  cell.Running();
  model::PlcCommand& command = cell.input.command;
  const auto good = [&] {
    command = {};
    command.code = model::PlcCommandCode::kCorrectPoint;
    command.point_id = 9;
    command.sequence = static_cast<std::uint16_t>(cell.Next().result.sequence + 1);
    const CommandResult result = cell.Next().result;
    REQUIRE(result.valid);
    REQUIRE(result.correction.uncertainty_m > 0);
    ++command.sequence;
  };
  const auto refused = [&](correction::CorrectionCode code) {
    const CommandResult result = cell.Next().result;
    CHECK(result.sequence == command.sequence);
    CHECK(result.command == command.code);
    CHECK(result.code == code);
    CheckNoPose(result);
  };
  good();
  command.point_id = 8;
  refused(correction::CorrectionCode::kUnknownPoint);
  good();
  command.code = static_cast<model::PlcCommandCode>(77);
  refused(correction::CorrectionCode::kBadCommand);
  good();
  command.payload_kg = 1e9;
  refused(correction::CorrectionCode::kBadCommand);
  good();
  command.code = model::PlcCommandCode::kCorrectPose;
  command.pose_valid = true;
  command.X_BP.p = Vec3(50, 0, 0);
  refused(correction::CorrectionCode::kUnreachable);
  good();
  command.code = model::PlcCommandCode::kProbe;
  refused(correction::CorrectionCode::kNotRecorded);
  good();
  command.code = model::PlcCommandCode::kStartCalibration;
  refused(correction::CorrectionCode::kNoCamera);
  good();
  cell.input.robot.q[0] = 99;
  refused(correction::CorrectionCode::kNoRobot);
}

TEST_CASE("a pose command in metres or with an empty position is refused") {
  Cell cell;
  cell.Running();
  const Pose X_BP = cell.config.cell.robot.X_WB.Inverse() * cell.config.points[1].X_WP;
  model::PlcCommand& command = cell.input.command;
  std::uint16_t sequence = 200;
  for (const model::PlcCommandCode code :
       {model::PlcCommandCode::kCorrectPose, model::PlcCommandCode::kCorrectPoseScaled,
        model::PlcCommandCode::kPredictLanding}) {
    CAPTURE(static_cast<int>(code));
    const auto result_of = [&](const Vec3& p_B) {
      command = {};
      command.code = code;
      command.pose_valid = true;
      command.X_BP = {X_BP.R, p_B};
      command.payload_kg = 60;
      command.sequence = ++sequence;
      return cell.Next().result;
    };
    CHECK(result_of(X_BP.p).code == correction::CorrectionCode::kOk);
    for (const Vec3& p_B : {Vec3(1e-3 * X_BP.p), Vec3(Vec3::Zero())}) {
      const CommandResult refused = result_of(p_B);
      CHECK(refused.code == correction::CorrectionCode::kBadCommand);
      CheckNoPose(refused);
    }
  }
}

TEST_CASE("a gantry pose near the base origin is not mistaken for metres") {
  const Vec3 near_origin(1e-3, 2e-3, -1e-3);
  ProbeBounds bounds;
  bounds.reach_m = 3;
  model::Robot robot;
  robot.joints.resize(3);
  robot.joints[0].type = model::JointType::kRevolute;
  CHECK(IsZeroOrInMetres(robot, bounds, near_origin));
  CHECK_FALSE(IsZeroOrInMetres(robot, bounds, Vec3(0.01, 0, 0)));
  robot.joints[0].type = model::JointType::kPrismatic;
  CHECK_FALSE(IsZeroOrInMetres(robot, bounds, near_origin));
}

TEST_CASE("the PLC heartbeat is present while it changes") {
  Cell cell;
  CHECK((cell.Running().status & status::kPlcHeartbeatSeen) == 0);
  ++cell.input.command.heartbeat;
  CHECK((cell.Next().status & status::kPlcHeartbeatSeen) != 0);
  for (int k = 0; k < 201; ++k) cell.Next();
  const Snapshot& snapshot = cell.Next();
  CHECK((snapshot.status & status::kPlcHeartbeatSeen) == 0);
  CHECK((snapshot.warnings & warning::kPlcHeartbeatLost) != 0);
}

TEST_CASE("an untrusted reading is shown but not used") {
  Cell cell;
  cell.input.robot.X_BT = Pose();
  cell.input.robot.X_BT->p.x() = 10;
  const Snapshot& snapshot = cell.Running();
  CHECK(snapshot.input_fault == InputFault::kTcpMismatch);
  CHECK(snapshot.reading.q == cell.taught);
  CHECK(snapshot.reading.X_BT->p.x() == 10);
  CHECK(snapshot.robot.q.isZero());
}

TEST_CASE("a temperature of NaN counts as absent") {
  Cell cell;
  cell.input.robot.temp_C = 21;
  CHECK((cell.Running().status & status::kTemperatureValid) != 0);
  cell.input.robot.temp_C = std::nan("");
  CHECK((cell.Next().status & status::kTemperatureValid) == 0);
  CHECK(cell.Next().points[0].valid);
}

TEST_CASE("a missing centre of mass is a warning for a compliant joint, not for a rigid arm") {
  Cell cell;
  for (model::Joint& joint : cell.config.cell.robot.joints) joint.link_com_m.reset();
  CHECK((cell.Running().warnings & warning::kMassCentresGuessed) != 0);
  for (model::Joint& joint : cell.config.cell.robot.joints) joint.compliance_rad_per_Nm.reset();
  cell.machine.reset();
  CHECK((cell.Running().warnings & warning::kMassCentresGuessed) == 0);
}

TEST_CASE("coarse joint registers are reported with their 95 % radius") {
  Cell cell;
  cell.input.robot.q_resolution = 1e-3;
  const Snapshot& snapshot = cell.Running();
  CHECK((snapshot.warnings & warning::kCoarseJoints) != 0);
  CHECK(snapshot.reading_radius_m > 0.5e-3);
  CHECK(snapshot.reading_radius_m < 5e-3);
}

TEST_CASE("an identified model states its own uncertainty, not the declared deviation") {
  Cell cell;
  const double declared_m = cell.Running().points[0].correction.uncertainty_m;
  cell.machine.reset();
  model::WrittenEffect effect;
  effect.id = "joint_compliance";
  effect.scope = {"q2"};
  effect.parameters = {{"q2", 2e-7, 3e-9, "rad/(N m)", ""}};
  cell.config.cell.effects = {effect};
  cell.config.cell.domain.emplace();
  for (const model::Joint& joint : cell.config.cell.robot.joints) {
    cell.config.cell.domain->q.push_back({joint.min, joint.max});
  }
  cell.config.cell.domain->payload_kg = model::MeasuredRange{{{0, 60}}, {}};
  cell.config.cell.domain->residual_sigma_m = 3e-5;
  const deflection::LoadedArm arm(cell.config.cell);
  const loads::Payload payload{60, *cell.config.cell.payload_cog_F};
  const auto expected_m = [&](const model::JointVector& q) {
    return statistics::RadiusHolding95Percent(deflection::EffectCovariance(arm, q, payload, {}) +
                                              9e-10 * Mat3::Identity());
  };
  const Snapshot& snapshot = cell.Running();
  for (const PointResult& point : snapshot.points) {
    CHECK(point.correction.uncertainty_m == Approx(expected_m(point.correction.q)).epsilon(1e-6));
    CHECK(point.correction.basis == model::RadiusBasis::kMeasured);
  }
  CHECK(snapshot.points[0].correction.uncertainty_m < 0.2 * declared_m);
  CHECK(snapshot.points[0].correction.uncertainty_m > 2 * 3e-5);

  cell.input.probes_recorded = true;
  cell.input.command.code = model::PlcCommandCode::kProbe;
  cell.input.command.probe_W = cell.PredictedTip();
  cell.input.command.sequence = 5;
  CHECK(cell.Next().result.correction.uncertainty_m ==
        Approx(expected_m(cell.taught)).epsilon(1e-6));
  CHECK(cell.Next().result.correction.basis == model::RadiusBasis::kMeasured);
}

TEST_CASE(
    "contradicting probes withdraw the basis of every radius, and the stated radius is kept") {
  Cell cell;
  cell.input.probes_recorded = true;
  cell.Running();
  for (int k = 0; k < 100; ++k) cell.Next();
  REQUIRE(cell.Next().points[0].correction.basis == model::RadiusBasis::kAssumed);
  cell.input.command.code = model::PlcCommandCode::kProbe;
  cell.input.command.probe_W = cell.PredictedTip();
  cell.input.command.sequence = 5;
  const Snapshot& taken = cell.Next();
  REQUIRE(taken.probe_taken);
  CHECK(taken.probe.radius_m > 0);
  CHECK(taken.probe.radius_m == taken.result.correction.uncertainty_m);

  cell.input.compensated_twice = true;
  const Snapshot& twice = cell.Next();
  CHECK(twice.points[0].valid);  // a warning withdraws nothing
  CHECK((twice.status & status::kCompensatedTwice) != 0);
  CHECK((twice.status & status::kWarning) != 0);
  CHECK(twice.health.reason == HealthReason::kCompensatedTwice);
  cell.input.compensated_twice = false;
  CHECK((cell.Next().status & status::kCompensatedTwice) == 0);

  const std::uint64_t changes = cell.Next().point_changes;
  cell.input.radius_contradicted = true;
  const Snapshot& withdrawn = cell.Next();
  CHECK(withdrawn.point_changes > changes);  // so that display and page learn of it
  for (const PointResult& point : withdrawn.points) {
    CHECK(point.valid);
    CHECK(point.correction.uncertainty_m > 0);
    CHECK(point.correction.basis == model::RadiusBasis::kUnknown);
  }
  CHECK(withdrawn.result.correction.basis == model::RadiusBasis::kUnknown);
  CHECK(withdrawn.health.reason == HealthReason::kRadiusContradicted);
  ++cell.input.command.sequence;
  CHECK(cell.Next().probe.radius_m > 0);  // what the model states is still compared

  const std::uint64_t unchanged = cell.Next().point_changes;
  CHECK(cell.Next().point_changes == unchanged);
  cell.input.radius_contradicted = false;
  CHECK(cell.Next().points[0].correction.basis == model::RadiusBasis::kAssumed);
  CHECK(cell.Next().point_changes > unchanged);
}

TEST_CASE("the radius of one payload is not reported for another") {
  Cell cell;
  cell.config.points.resize(1);
  const correction::AssemblyPoint point = cell.config.points[0];
  for (int id = 2; id <= 100; ++id) {
    cell.config.points.push_back(point);
    cell.config.points.back().id = id;
  }
  const double light_m = cell.Running().points[50].correction.uncertainty_m;
  for (int k = 0; k < 100; ++k) cell.Next();
  CHECK(cell.Next().points[50].correction.basis == model::RadiusBasis::kAssumed);
  cell.input.robot.payload_kg = *cell.input.robot.payload_kg + 60;
  const Snapshot& changed = cell.Next();  // before all radii can be refreshed
  int waiting = 0;
  for (const PointResult& one : changed.points) {
    waiting += one.correction.basis == model::RadiusBasis::kUnknown ? 1 : 0;
  }
  CHECK(waiting > 50);
  CHECK(changed.health.reason == HealthReason::kRadiusUnknown);
  for (int k = 0; k < 10; ++k) cell.Next();
  CHECK(cell.Next().points[50].correction.basis == model::RadiusBasis::kAssumed);
  CHECK(cell.Next().points[50].correction.uncertainty_m > 1.2 * light_m);
}

TEST_CASE("time-dependent effects start at the model's time zero and hold their last value") {
  Cell cell;
  cell.input.probes_recorded = true;
  cell.input.command.code = model::PlcCommandCode::kProbe;
  cell.input.command.probe_W = cell.PredictedTip();
  model::WrittenEffect effect;
  effect.id = "empirical";
  effect.parameters = {{"base_x", 1, std::nullopt, "1", ""}};
  effect.drivers = {"t_s"};
  effect.nodes.resize(2, 2);
  effect.nodes << 0, 0, 1000, 10;  // 10 mm in 1000 s
  effect.seen_t_s = model::Interval{100, 600};
  cell.config.cell.effects = {effect};
  cell.config.cell.domain.emplace();
  cell.config.cell.domain->payload_kg = model::MeasuredRange{{{0, 60}}, {}};
  for (const model::Joint& joint : cell.config.cell.robot.joints) {
    cell.config.cell.domain->q.push_back({joint.min, joint.max});
  }
  cell.config.cell.domain->time_zero_s = 1.8e9;
  cell.Running();
  const auto probed = [&](double utc_s) {
    cell.input.utc_s = utc_s;
    ++cell.input.command.sequence;
    const Snapshot& snapshot = cell.Next();
    CHECK(snapshot.result.code == correction::CorrectionCode::kOk);
    return std::pair(snapshot.probe.predicted_W.x(), snapshot.result.correction.extrapolated);
  };
  const auto [at_200, outside_200] = probed(1.8e9 + 200);
  const auto [at_500, outside_500] = probed(1.8e9 + 500);
  const auto [at_900, outside_900] = probed(1.8e9 + 900);
  CHECK(at_500 - at_200 == Approx(3e-3).epsilon(1e-9));
  CHECK(at_900 - at_200 == Approx(4e-3).epsilon(1e-9));  // held at 600 s
  CHECK_FALSE(outside_200);
  CHECK_FALSE(outside_500);
  CHECK(outside_900);
}

TEST_CASE("a point is recomputed whenever one of its inputs has changed") {
  Cell cell;
  cell.config.payload.source = PayloadPolicy::Source::kRobot;
  model::WrittenEffect time, warmth;
  time.id = warmth.id = "empirical";
  time.parameters = {{"base_x", 1, 0.05, "1", ""}};
  warmth.parameters = {{"base_y", 1, 0.05, "1", ""}};
  time.drivers = {"t_s"};
  warmth.drivers = {"temp_C"};
  time.nodes.resize(2, 2);
  time.nodes << 0, 0, 1000, 10;  // 10 mm in 1000 s
  warmth.nodes.resize(2, 2);
  warmth.nodes << 20, 0, 40, 4;  // 0.2 mm a kelvin
  cell.config.cell.effects = {time, warmth};
  cell.config.cell.domain.emplace();
  for (const model::Joint& joint : cell.config.cell.robot.joints) {
    cell.config.cell.domain->q.push_back({joint.min, joint.max});
  }
  cell.config.cell.domain->time_zero_s = 1.8e9;
  cell.input.utc_s = 1.8e9 + 200;
  cell.input.robot.temp_C = 25.0;
  cell.Running();

  const auto as_if_new = [&] {
    Cell fresh;
    fresh.config = cell.config;
    fresh.input = cell.input;
    fresh.input.robot.sequence = 0;
    for (int k = 0; k < 4; ++k) fresh.Running();  // the radius of each point has been refreshed
    for (int k = 0; k < 4; ++k) cell.Next();
    for (std::size_t k = 0; k < 2; ++k) {
      const PointResult& one = cell.machine->Cycle(cell.input).points[k];
      const PointResult& other = fresh.machine->Cycle(fresh.input).points[k];
      CHECK(one.valid);
      CHECK(other.valid);
      CHECK((one.correction.X_BP_command.p - other.correction.X_BP_command.p).norm() < 1e-8);
      CHECK(one.correction.uncertainty_m == Approx(other.correction.uncertainty_m).epsilon(1e-6));
    }
    return cell.machine->Cycle(cell.input).points[0].correction.X_BP_command.p;
  };
  std::vector<Vec3> commands = {as_if_new()};
  const auto changed = [&] {
    commands.push_back(as_if_new());
    return (commands.back() - commands[commands.size() - 2]).norm() > 1e-4;
  };
  cell.input.robot.payload_kg = 40;
  CHECK(changed());
  cell.input.robot.payload_cog_F = Vec3(0.1, 0, 0.3);
  CHECK(changed());
  cell.input.robot.temp_C = 30.0;
  CHECK(changed());
  cell.input.utc_s += 100;
  CHECK(changed());
  cell.input.robot.q[0] += 0.01;  // the robot's position is not an input
  CHECK_FALSE(changed());
  cell.input.robot.temp_C.reset();  // one effect fewer
  CHECK(changed());
}

TEST_CASE("the deflection by motion is reported and changes no point") {
  Cell still, moving;
  still.Running();
  CHECK(moving.Running().motion.state == motion::MotionState::kStandstill);
  double largest_m = 0;
  for (int k = 1; k <= 100; ++k) {
    const double t_s = kPeriod_s * k;
    moving.input.robot.q[0] = moving.taught[0] + 0.2 * (1 - std::cos(4 * t_s));  // 3.2 rad/s^2
    const Snapshot& a = still.Next();
    const Snapshot& b = moving.Next();
    REQUIRE(b.points[0].valid);
    CHECK(a.points[0].correction.X_BP_command.p == b.points[0].correction.X_BP_command.p);
    CHECK(a.points[0].correction.uncertainty_m == b.points[0].correction.uncertainty_m);
    if (b.motion.state == motion::MotionState::kMoving) {
      largest_m = std::max(largest_m, b.motion.deflection.tip_W.norm());
      CHECK(b.motion.age_s < 0.08);
    } else {
      CHECK(k < 20);  // until the window is filled
    }
  }
  CHECK(largest_m > 1e-3);
  CHECK(largest_m < 0.05);
  CHECK(moving.machine->snapshot().motion.resolved());
  for (int k = 0; k < 30; ++k) moving.Next();
  CHECK(moving.machine->snapshot().motion.state == motion::MotionState::kStandstill);
}

TEST_CASE("without a payload the deflection by motion is unknown; after a fault too") {
  Cell cell;
  cell.Running();
  cell.input.robot.payload_kg.reset();
  for (int k = 1; k <= 20; ++k) {
    cell.input.robot.q[0] += 0.01;
    cell.Next();
  }
  CHECK(cell.machine->snapshot().motion.state == motion::MotionState::kLoadUnknown);
  for (int k = 0; k < 20; ++k) cell.Silent();
  CHECK(cell.machine->snapshot().motion.state == motion::MotionState::kUnknown);
}

}  // namespace plumbline::machine_test
