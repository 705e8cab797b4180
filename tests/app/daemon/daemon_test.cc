// The whole daemon from socket to socket, beside a virtual cell that shares no code with it.
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/app/daemon/daemon_process.h"
#include "tests/app/daemon/demo_config.h"
#include "tests/virtual_cell/assembly_client.h"
#include "tests/virtual_cell/running_cell.h"

using namespace plumbline::test;
using virtual_cell::AssemblyClient;
using virtual_cell::AssemblyClientOptions;
using virtual_cell::DemoProgram;
using virtual_cell::Eventually;
using virtual_cell::Profile;
using virtual_cell::RegisterClient;
using virtual_cell::RunningCell;
using virtual_cell::VirtualCellOptions;

namespace {

VirtualCellOptions Idle(Profile profile) {
  VirtualCellOptions options;
  options.profile = profile;
  options.idle = true;
  options.time_scale = 4;
  return options;
}

const char* MapOf(Profile profile) {
  return profile == Profile::kUr ? "universal-robots-fine" : "generic";
}

bool Valid(RegisterClient& plc) {
  return (plc.Read(2000, 20).Word(1) & 1) != 0;
}

/// A cell with the payload attached, and a daemon whose points are valid.
struct Station {
  RunningCell cell;
  DaemonProcess daemon;
  RegisterClient plc;

  explicit Station(Profile profile = Profile::kGeneric)
      : cell(Idle(profile)),
        daemon(DemoConfig(cell.robot(), MapOf(profile))),
        plc("plumblined", daemon.Plc(), 1, 10) {
    REQUIRE(cell.Tell("payload 60") == "ok");
    INFO(daemon.Log());
    REQUIRE(Eventually([&] { return Valid(plc) && plc.Read(330, 2).Float(0) == 60; }));
  }
};

}  // namespace

TEST_CASE("the loaded tip lands where it was wanted, in both profiles") {
  for (const Profile profile : {Profile::kUr, Profile::kGeneric}) {
    Station station(profile);
    AssemblyClientOptions options;
    options.robot = station.cell.robot();
    options.tracker = station.cell.tracker();
    options.daemon = station.daemon.Plc();
    options.profile = profile;
    AssemblyClient client(options, DemoProgram());
    client.AttachPayload();
    for (const int id : {1, 2}) {
      const auto program = DemoProgram();
      const auto point = std::find_if(program.points.begin(), program.points.end(),
                                      [&](const auto& p) { return p.id == id; });
      const virtual_cell::Landing landing = client.Visit(*point);
      CAPTURE(id);
      CHECK(landing.UncorrectedError() > 5);  // mm: otherwise there is nothing to correct
      CHECK(landing.CorrectedError() < 0.1);
    }
  }
}

TEST_CASE("what the model lacks stays as error: the world is not the product's own") {
  const virtual_cell::Effects effects({virtual_cell::EffectFromText("joint_compliance:q2=2e-6")});
  RunningCell cell(Idle(Profile::kGeneric), effects);
  DaemonProcess daemon(DemoConfig(cell.robot(), "generic"));
  AssemblyClientOptions options;
  options.robot = cell.robot();
  options.tracker = cell.tracker();
  options.daemon = daemon.Plc();
  options.profile = Profile::kGeneric;
  AssemblyClient client(options, DemoProgram());
  client.AttachPayload();
  CHECK(client.Visit(DemoProgram().points.front()).CorrectedError() > 1);
}

TEST_CASE("a command is answered once, with its echo, and frozen") {
  Station station;
  const auto command = [&](std::vector<std::uint16_t> head, std::uint16_t sequence) {
    head.resize(40);
    head[39] = sequence;
    station.plc.Write(1000, head);
    REQUIRE(Eventually([&] { return station.plc.Read(100, 40).Word(1) == sequence; }));
    return station.plc.Read(100, 40);
  };
  auto result = command({1, 2}, 7);
  CHECK(result.Word(0) == 7);
  CHECK(result.Word(39) == 7);
  CHECK(result.Word(2) == 0);
  REQUIRE((result.Word(3) & 1) != 0);
  CHECK(result.Word(30) == 2);
  CHECK(result.Float(4) == Approx(station.plc.Read(2020, 20).Float(3)).margin(0.01));
  const float x = result.Float(4);

  station.cell.Tell("payload 5");
  REQUIRE(Eventually([&] { return station.plc.Read(330, 2).Float(0) == 5; }));
  result = station.plc.Read(100, 40);
  CHECK(result.Float(4) == x);
  CHECK((result.Word(3) & 1) != 0);

  CHECK(command({1, 99}, 8).Word(2) == 9);  // no such point
  CHECK(command({42}, 9).Word(2) == 10);    // no such command
  CHECK(command({1, 1}, 10).Word(2) == 0);
  CHECK((command({5}, 11).Word(3) & 1) == 0);  // acknowledged
  // A small controller reads the same as scaled integers.
  const auto scaled = station.plc.Read(200, 20);
  CHECK(scaled.Word(0) == 11);
  CHECK(scaled.Word(19) == 11);
}

TEST_CASE("every fault of the link withdraws the points, is told once, and heals by itself") {
  struct Fault {
    const char* name;
    const char* begin;
    const char* end;
    const char* told;
  };
  const Fault faults[] = {
      {"a controller that stalls", "fault stall 1.5", nullptr, "robot link lost"},
      {"not a number", "fault nan on", "fault nan off", "not trusted"},
      {"the tool 10 m away", "fault jump on", "fault jump off", "not trusted"},
      {"a joint outside its limits", "fault joint 5 9.0", "fault joint off", "not trusted"},
      {"answers that come too late", "fault delay 0.4", "fault delay 0", "robot link lost"},
      {"every request refused", "fault exception on", "fault exception off", "robot link lost"},
  };
  for (const Fault& fault : faults) {
    CAPTURE(fault.name);
    Station station;
    REQUIRE(station.cell.Tell(fault.begin) == "ok");
    CHECK(Eventually([&] { return !Valid(station.plc); }));
    const auto block = station.plc.Read(2000, 20);
    CHECK(std::abs(block.Float(3)) > 100);  // the values stay
    CHECK(station.daemon.Awaits(fault.told));
    if (fault.end != nullptr) REQUIRE(station.cell.Tell(fault.end) == "ok");
    INFO(station.daemon.Log());
    CHECK(Eventually([&] { return Valid(station.plc); }));
    CHECK(station.daemon.Count(fault.told) == 1);
  }
}

TEST_CASE("connections that are reset or half closed are made again") {
  for (const char* fault : {"fault reset", "fault half-close"}) {
    CAPTURE(fault);
    Station station;
    REQUIRE(station.cell.Tell(fault) == "ok");
    CHECK(station.daemon.Awaits("restored"));
    CHECK(station.daemon.Count("robot link lost") == 1);
    CHECK(Eventually([&] { return Valid(station.plc); }));
  }
}

TEST_CASE("SIGHUP takes a checked configuration; a faulty one changes nothing") {
  Station station;
  const std::string good = DemoConfig(station.cell.robot(), "generic");
  station.daemon.Write(WithLine(good, "correction", "max_translation_mm", "-5.0"));
  station.daemon.Signal(SIGHUP);
  CHECK(station.daemon.Awaits("not reloaded"));
  CHECK(station.daemon.Says("correction.max_translation_mm"));
  CHECK(Valid(station.plc));

  station.daemon.Write(good +
                       "\n[[point]]\nid = 3\nname = \"third\"\nframe = \"body\"\n"
                       "xyz_mm = [400.0, 0.0, 0.0]\nrpy_deg = [0.0, 90.0, 0.0]\n");
  station.daemon.Signal(SIGHUP);
  REQUIRE(station.daemon.Awaits("reloaded"));
  CHECK(Eventually([&] {
    const auto third = station.plc.ReadIfThere(2040, 20);
    return third && third->Word(0) == 3 && (third->Word(1) & 1) != 0;
  }));
}

TEST_CASE("SIGTERM ends it cleanly") {
  Station station;
  station.daemon.Signal(SIGTERM);
  CHECK(station.daemon.Wait() == 0);
  CHECK(station.daemon.Says("ending on SIGTERM"));
}

TEST_CASE("a faulty configuration is told in full, and nothing starts") {
  std::string config = DemoConfig("127.0.0.1:1", "generic");
  config = WithLine(config, "robot", "timeout_ms", "-3");
  config = WithLine(config, "plc", "orientation", "\"upside_down\"");
  DaemonProcess daemon(config + "\nsurprise = 1\n");
  CHECK(daemon.Wait() == 1);
  CHECK(daemon.Says("robot.timeout_ms"));
  CHECK(daemon.Says("plc.orientation"));
  CHECK(daemon.Says("surprise"));
  CHECK(daemon.Says("not started"));
}

TEST_CASE("without a robot the daemon serves, and says what is missing") {
  DaemonProcess daemon(DemoConfig("127.0.0.1:1", "generic"));
  RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
  CHECK(daemon.Awaits("robot link not there yet"));
  CHECK_FALSE(Valid(plc));
  CHECK((plc.Read(12, 1).Word(0) & 1) != 0);
}

TEST_CASE("pushed points stand in the controller's registers, and it can go there") {
  RunningCell cell(Idle(Profile::kGeneric));
  std::string config = DemoConfig(cell.robot(), "generic");
  config = WithLine(config, "push", "enabled", "true");
  DaemonProcess daemon(config);
  REQUIRE(cell.Tell("payload 60") == "ok");
  RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
  RegisterClient robot("robot", cell.robot(), 1, 10);
  REQUIRE(Eventually([&] {
    const auto slots = robot.Read(300, 16);
    return slots.Word(0) == 1 && slots.Word(7) != 0 && slots.Word(8) == 2 && slots.Word(15) != 0;
  }));
  REQUIRE(Eventually([&] { return Valid(plc) && plc.Read(330, 2).Float(0) == 60; }));
  // Once the corrected point has settled the slot holds it to its rounding of 0.1 mm.
  CHECK(Eventually([&] {
    const auto slot = robot.Read(300, 8);
    const auto block = plc.Read(2000, 20);
    const double x_mm = 0.1 * static_cast<std::int16_t>(slot.Word(1));
    return slot.Word(7) != 0 && std::abs(x_mm - static_cast<double>(block.Float(3))) < 0.06;
  }));
}
