#include "app/cell/daemon/reporter.h"

#include <catch2/catch.hpp>

#include "app/cell/daemon/state_storage.h"
#include "tests/app/cell/daemon/daemon_process.h"

namespace plumbline::reporter_test {

using namespace plumbline::cell;

namespace {

struct Desk {
  Desk() {
    snapshot.points.resize(1);
    link.connected = true;
    link.readings = 1;
  }
  std::vector<std::string> lines;
  Reporter reporter{{{7, "left"}},
                    [this](const log::LogEntry& entry) { lines.push_back(entry.text); }};
  Snapshot snapshot;
  robot::RobotLinkStatus link;

  std::vector<std::string> Observe(std::uint16_t raised = 0) {
    lines.clear();
    snapshot.now_s += 0.05;
    reporter.Observe(snapshot, raised, link);
    return lines;
  }
};

}  // namespace

TEST_CASE("a point's radius is logged with its basis") {
  const auto logged = [](model::RadiusBasis basis) {
    Desk desk;
    desk.snapshot.input_fault = InputFault::kOk;
    desk.snapshot.points[0].code = correction::CorrectionCode::kOk;
    desk.snapshot.points[0].valid = true;
    desk.snapshot.points[0].correction.uncertainty_m = 0.002;
    desk.snapshot.points[0].correction.basis = basis;
    return desk.Observe().back();
  };
  CHECK_THAT(logged(model::RadiusBasis::kAssumed), Catch::EndsWith("±2.00 mm (95 %, assumed)"));
  CHECK_THAT(logged(model::RadiusBasis::kMeasured), Catch::EndsWith("±2.00 mm (95 %, measured)"));
}

TEST_CASE("an undeclared tool or item is named where a point has no correction") {
  Desk desk;
  model::CellModel cell;
  cell.tool.number = 4;
  cell.further_tools = {model::Tool()};
  cell.further_tools[0].number = 7;
  cell.payload_items = {{2, 1, Vec3::Zero()}};
  desk.reporter.SetCell(cell);
  desk.snapshot.input_fault = InputFault::kOk;
  desk.snapshot.points[0].code = correction::CorrectionCode::kPayloadUnknown;
  desk.snapshot.undeclared = {UndeclaredNumber::Kind::kTool, 5};
  CHECK_THAT(
      desk.Observe().back(),
      Catch::EndsWith("has no correction: payload unknown: tool 5 is not declared (declared: "
                      "4, 7); correct the number in the controller, or add a [[tool]] with "
                      "number = 5"));
  CHECK(desk.Observe().empty());
  desk.snapshot.undeclared = {UndeclaredNumber::Kind::kItem, 9};
  CHECK_THAT(desk.Observe().back(),
             Catch::Contains("payload item 9 is not declared (declared: 2, 0 for none)"));
  desk.snapshot.undeclared = {UndeclaredNumber::Kind::kItem, std::nullopt};
  CHECK_THAT(desk.Observe().back(),
             Catch::Contains("the controller reports no payload item number"));
}

TEST_CASE("each transition of the motion link is one line, with the reason and the remedy") {
  using status::MotionLinkState;
  Desk desk;
  status::MotionLinkStatus motion;
  double now_s = 0;
  const auto observe = [&](MotionLinkState state, motion_offset::Obstacle obstacle) {
    desk.lines.clear();
    motion.state = state;
    motion.obstacle = obstacle;
    now_s += 0.1;
    desk.reporter.ObserveMotion(motion, "127.0.0.1:59152: in use", now_s);
    return desk.lines;
  };
  using motion_offset::Obstacle;
  using Lines = std::vector<std::string>;
  CHECK(observe(MotionLinkState::kOff, Obstacle::kOff).empty());
  CHECK(observe(MotionLinkState::kNoSocket, Obstacle::kNoPackets) ==
        Lines{"motion link: 127.0.0.1:59152: in use"});
  CHECK(observe(MotionLinkState::kWaiting, Obstacle::kNoPackets).empty());
  CHECK(observe(MotionLinkState::kAnswering, Obstacle::kNotEnabled) ==
        Lines{"motion link: the controller is answered",
              "motion not corrected: not enabled by the PLC; set coil 1002 while motions may be "
              "corrected; after a lost heartbeat clear it first"});
  CHECK(observe(MotionLinkState::kAnswering, Obstacle::kNotEnabled).empty());
  motion.wanted_m = 0.00125;
  CHECK(observe(MotionLinkState::kCorrecting, Obstacle::kNone) ==
        Lines{"motion corrected: 1.25 mm wanted"});
  CHECK_THAT(observe(MotionLinkState::kAnswering, Obstacle::kRadiusTooWide).back(),
             Catch::StartsWith("motion not corrected: the stated radius is wider than allowed; "));
  CHECK_THAT(observe(MotionLinkState::kNotAnswering, Obstacle::kNotAnswered).back(),
             Catch::StartsWith("motion link: not answered: "));
  CHECK(observe(MotionLinkState::kWaiting, Obstacle::kNoPackets) ==
        Lines{"motion link: the controller sends nothing any more"});
  motion.foreign = 3;
  motion.foreign_address = 0x0100007F;
  CHECK(observe(MotionLinkState::kWaiting, Obstacle::kNoPackets) ==
        Lines{"motion link: 3 packets ignored: from 127.0.0.1, which is not the controller"});
  motion.foreign = 9;  // within seconds: counted, and logged later
  CHECK(observe(MotionLinkState::kWaiting, Obstacle::kNoPackets).empty());
  now_s += 11;
  CHECK_THAT(observe(MotionLinkState::kWaiting, Obstacle::kNoPackets).back(),
             Catch::StartsWith("motion link: 6 packets ignored"));
  now_s += 11;
  motion.foreign = 10;
  motion.malformed = 2;
  CHECK(
      observe(MotionLinkState::kWaiting, Obstacle::kNoPackets) ==
      Lines{"motion link: 3 packets ignored: 1 from 127.0.0.1, which is not the controller; 2 not "
            "of the form that the configured interface sends"});
}

TEST_CASE("the tip of another tool than the reported one is named with both numbers") {
  Desk desk;
  desk.snapshot.input_fault = InputFault::kTcpMismatch;
  desk.snapshot.tip_of_tool = 7;
  desk.snapshot.reading.tool_number = 4;
  CHECK_THAT(desk.Observe().back(),
             Catch::Contains("it is the tip of tool 7, but the tool number is "
                             "4; set both in the controller"));
}

TEST_CASE("a point outside the domain says which item was not measured") {
  Desk desk;
  model::CellModel cell;
  cell.payload_items = {{2, 1, Vec3::Zero()}, {3, 1, Vec3::Zero()}};
  cell.domain.emplace();
  cell.domain->payload_items = {0, 2};
  desk.reporter.SetCell(cell);
  desk.snapshot.input_fault = InputFault::kOk;
  PointResult& point = desk.snapshot.points[0];
  point.code = correction::CorrectionCode::kOk;
  point.valid = point.correction.extrapolated = true;
  desk.snapshot.payload.item = 3;
  CHECK_THAT(desk.Observe().back(),
             Catch::EndsWith(", outside the calibrated range: payload item 3 was not measured "
                             "(measured: 0, 2)"));
}

TEST_CASE("each transition is logged once") {
  Desk desk;
  CHECK(desk.Observe() == std::vector<std::string>{"robot link up"});
  CHECK(desk.Observe().empty());
  desk.snapshot.input_fault = InputFault::kOk;
  CHECK(desk.Observe() == std::vector<std::string>{"robot input trusted"});
  desk.snapshot.points[0].code = correction::CorrectionCode::kUnreachable;
  CHECK(desk.Observe() ==
        std::vector<std::string>{"point 7 (left) has no correction: out of reach"});
  CHECK(desk.Observe().empty());
  desk.link.connected = false;
  desk.link.result = robot::LinkResult::kLost;
  desk.link.problem.Assign("no answer in time");
  CHECK(desk.Observe() ==
        std::vector<std::string>{"robot link lost: no answer in time; check the cable and that "
                                 "the controller is on"});
  desk.snapshot.now_s += 3.95;
  desk.link.connected = true;
  CHECK(desk.Observe() == std::vector<std::string>{"robot link restored after 4.0 s"});
}

TEST_CASE("a new reason for a lost robot link is logged once it has persisted") {
  Desk desk;
  desk.Observe();
  desk.link.connected = false;
  desk.link.result = robot::LinkResult::kLost;
  desk.link.problem.Assign("no answer in time");
  CHECK(desk.Observe().size() == 1);
  desk.link.problem.Assign("connection refused");
  for (int k = 0; k < 20; ++k) CHECK(desk.Observe().empty());  // a second
  desk.link.problem.Assign("no answer in time");
  for (int k = 0; k < 80; ++k) CHECK(desk.Observe().empty());
  desk.link.problem.Assign("connection refused");
  std::vector<std::string> logged;
  for (int k = 0; k < 200; ++k) {
    for (const std::string& line : desk.Observe()) logged.push_back(line);
  }
  CHECK(logged ==
        std::vector<std::string>{"robot link lost: connection refused (before: no answer in time); "
                                 "check the cable and that the controller is on"});
  desk.link.problem.Assign("no answer in time");  // alternating reasons are logged once each
  for (int k = 0; k < 200; ++k) CHECK(desk.Observe().empty());
  desk.link.connected = true;
  CHECK(desk.Observe().size() == 1);
  desk.link.connected = false;  // another outage
  CHECK(desk.Observe() ==
        std::vector<std::string>{"robot link lost: no answer in time; check the cable and that "
                                 "the controller is on"});
}

TEST_CASE("notices of the controller are logged once each, the newest ones if there are many") {
  Desk desk;
  desk.Observe();
  const auto add = [&desk](int number) {
    auto& link = desk.link;
    link.notices[link.notice_count++ % robot::RobotLinkStatus::kKeptNotices].Assign(
        "text " + std::to_string(number));
  };
  add(1);
  add(2);
  CHECK(desk.Observe() == std::vector<std::string>{"text 1", "text 2"});
  CHECK(desk.Observe().empty());
  for (int k = 3; k <= 9; ++k) add(k);
  CHECK(desk.Observe() == std::vector<std::string>{"text 6", "text 7", "text 8", "text 9"});
  desk.link = {};
  desk.link.connected = true;
  desk.link.readings = 1;
  add(10);
  CHECK(desk.Observe() == std::vector<std::string>{"text 10"});
}

TEST_CASE("an emergency stop ends when the controller reports so, not when its link drops") {
  Desk desk;
  desk.snapshot.input_fault = InputFault::kOk;
  desk.snapshot.alarms = alarm::kEmergencyStop;
  desk.Observe();
  desk.snapshot.input_fault = InputFault::kStale;
  desk.snapshot.alarms = alarm::kRobotStale;
  CHECK_THAT(desk.Observe().front(),
             Catch::StartsWith("robot input not trusted: stale; corrected points withdrawn; check "
                               "the link"));
  desk.snapshot.input_fault = InputFault::kOk;
  desk.snapshot.alarms = 0;
  CHECK(desk.Observe().front() == "the emergency stop is released");
}

TEST_CASE("points withdrawn for a lens are logged once for all, and so is their return") {
  Desk desk;
  desk.snapshot.input_fault = InputFault::kOk;
  desk.Observe();
  desk.snapshot.lenses_missing = 1;
  desk.snapshot.points[0].code = correction::CorrectionCode::kLensStale;
  CHECK(desk.Observe() == std::vector<std::string>{"corrected points withdrawn: the lens of camera "
                                                   "1 is not valid, and required_for demands it"});
  CHECK(desk.Observe().empty());
  desk.snapshot.input_fault = InputFault::kStale;
  desk.Observe();
  desk.snapshot.input_fault = InputFault::kOk;
  CHECK(desk.Observe().size() == 1);  // the robot is trusted again
  desk.snapshot.lenses_missing = 3;
  CHECK_THAT(desk.Observe().back(), Catch::Contains("the lenses of cameras 1 and 2 are not valid"));
  desk.snapshot.lenses_missing = 0;
  desk.snapshot.now_s += 3.75;
  CHECK(desk.Observe().front() ==
        "corrected points are served again after 4.0 s: the required lens is valid");
}

TEST_CASE("a fault between two observations is not missed") {
  Desk desk;
  desk.snapshot.input_fault = InputFault::kOk;
  desk.Observe();
  CHECK(desk.Observe(alarm::kRobotImplausible) ==
        std::vector<std::string>{"robot input was not trusted for a few cycles"});
}

TEST_CASE("the boot counter counts, and tolerates an invalid file") {
  test::TemporaryFolder folder;
  const std::string state = folder.path() + "/state";
  for (const std::uint16_t start : std::initializer_list<std::uint16_t>{1, 2}) {
    CHECK(NextBootCount(state) == start);
    CHECK(NextBootCount(state) == start);  // a start that failed does not count
    CHECK(StoreBootCount(state, start).ok());
  }
  std::ofstream(state + "/boot_count") << "nonsense";
  CHECK(NextBootCount(state) == 1);
  CHECK_FALSE(StoreBootCount("/proc/no/such/folder", 1).ok());
}

TEST_CASE(
    "refused probes are logged once per reason, with a remedy, and when they are accepted again") {
  Desk desk;
  desk.snapshot.input_fault = InputFault::kOk;
  desk.Observe();
  ProbeIntake& probes = desk.snapshot.probes;
  probes.reach_m = 4.9;
  const auto refuse = [&](ProbeFault fault, const Vec3& measured_W) {
    ++probes.refused;
    probes.fault = fault;
    probes.measured_W = measured_W;
    const auto lines = desk.Observe();
    return lines.empty() ? std::string() : lines.front();
  };
  CHECK_THAT(refuse(ProbeFault::kZero, Vec3::Zero()),
             Catch::StartsWith("probe refused and not recorded: it is 0, 0, 0"));
  CHECK(refuse(ProbeFault::kZero, Vec3::Zero()).empty());
  CHECK_THAT(refuse(ProbeFault::kInMetres, Vec3(1.2e-3, -4e-4, 9e-4)),
             Catch::Contains("(1.2, -0.4, 0.9) mm") && Catch::Contains("is it given in metres?"));
  CHECK_THAT(refuse(ProbeFault::kBeyondReach, Vec3::Constant(2147483.647)),
             Catch::Contains("farther from the base than the 4.90 m reach of arm and tool"));
  CHECK_THAT(refuse(ProbeFault::kRobotMoving, Vec3(1, 0, 1)), Catch::Contains("the robot moved"));
  probes.fault = ProbeFault::kNone;
  CHECK(desk.Observe() == std::vector<std::string>{"probes are accepted again; 5 were refused"});
  CHECK(desk.Observe().empty());
}

TEST_CASE("a replaced robot link is reported again, an earlier refused probe is not") {
  const bool link_kept = GENERATE(false, true);
  Desk desk;
  desk.snapshot.input_fault = InputFault::kOk;
  desk.snapshot.points[0].code = correction::CorrectionCode::kUnreachable;
  desk.snapshot.probes.refused = 3;
  desk.snapshot.probes.fault = ProbeFault::kZero;
  desk.link.changes = desk.link.push_changes = 1;
  REQUIRE(desk.Observe().size() > 3);
  REQUIRE(desk.Observe().empty());
  if (!link_kept) desk.link.changes = desk.link.push_changes = 0;  // a new link has its own counts
  desk.reporter.Configure({{8, "right"}}, link_kept);
  std::vector<std::string> expected = {"robot link up", "robot input trusted"};
  if (link_kept) expected.clear();
  expected.emplace_back("point 8 (right) has no correction: out of reach");
  CHECK(desk.Observe() == expected);
  desk.snapshot.probes.fault = ProbeFault::kNone;
  CHECK(desk.Observe() == std::vector<std::string>{"probes are accepted again; 3 were refused"});
}

TEST_CASE(
    "a single master is reported here; two masters are reported with their addresses elsewhere") {
  Desk desk;
  desk.snapshot.input_fault = InputFault::kOk;
  desk.Observe();
  desk.snapshot.warnings = warning::kTwoMasters;
  CHECK(desk.Observe().empty());
  desk.snapshot.warnings = 0;
  CHECK(desk.Observe() ==
        std::vector<std::string>{"one client alone writes the command window again"});
}

}  // namespace plumbline::reporter_test
