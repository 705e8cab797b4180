// The whole daemon beside a virtual Universal Robots controller that shares no code with it.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/app/cell/daemon/daemon_process.h"
#include "tests/app/cell/daemon/demo_config.h"
#include "tests/virtual_cell/running_cell.h"
#include "tests/virtual_ur/running_ur.h"

using namespace plumbline::test;
using virtual_cell::DemoCell;
using virtual_cell::DemoProgram;
using virtual_cell::Eventually;
using virtual_cell::RegisterClient;
using virtual_cell::World;
using virtual_ur::Running;
using virtual_ur::UrState;
using virtual_ur::VirtualUr;

namespace {

using Robot = Running<VirtualUr>;

int PortOf(Robot& robot) {
  return robot.With([](VirtualUr& ur) { return ur.rtde().port(); });
}

UrState StateOf(Robot& robot) {
  return robot.With([](VirtualUr& ur) { return ur.rtde().state(); });
}

std::string RtdeConfig(int port) {
  std::string text = PatientConfig(fmt::format("127.0.0.1:{}", port), "universal-robots");
  text = WithLine(text, "robot", "transport", "\"rtde\"");
  text = WithLine(text, "robot", "timeout_ms", "1000");
  text = WithLine(text, "push", "enabled", "true");
  return WithLine(text, "push", "max_step_mm", "50.0");
}

/// A controller with the payload attached.
struct Station {
  Robot robot;

  Station()
      : robot(World(DemoCell()), DemoProgram(), virtual_cell::VirtualCellOptions{.idle = true}) {
    REQUIRE(robot.Execute("payload 60") == "ok");
  }
  bool Written(int slot) {
    const UrState state = StateOf(robot);
    return state.input_int[static_cast<std::size_t>(25 + 3 * slot)] != 0;
  }
};

}  // namespace

TEST_CASE("the daemon reads over RTDE and writes the corrected points into the input registers") {
  Station station;
  DaemonProcess daemon(RtdeConfig(PortOf(station.robot)));
  RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
  CHECK(daemon.Awaits("robot input trusted"));
  REQUIRE(Eventually([&] { return station.Written(0) && station.Written(1); }));
  INFO(daemon.Log());
  const UrState state = StateOf(station.robot);
  CHECK(state.input_int[26] == 1);
  CHECK(state.input_int[29] == 2);
  // The same point as the PLC reads: millimetres and the rotation vector as float32.
  const auto point = plc.Read(2000, 20);
  for (int k = 0; k < 3; ++k) {
    CAPTURE(k);
    CHECK(std::abs(1e3 * state.input_double[static_cast<std::size_t>(24 + k)] -
                   point.Float(3 + 2 * k)) < 1e-3);
  }
  const int heartbeat = state.input_int[24];
  CHECK(Eventually([&] { return StateOf(station.robot).input_int[24] > heartbeat; }));

  daemon.Signal(SIGTERM);
  CHECK(daemon.Wait() == 0);
  CHECK(Eventually([&] { return !station.Written(0) && !station.Written(1); }));
}

TEST_CASE("a killed daemon leaves its points behind with a heartbeat that stands") {
  Station station;
  DaemonProcess daemon(RtdeConfig(PortOf(station.robot)));
  REQUIRE(Eventually([&] { return station.Written(0); }));
  daemon.Signal(SIGKILL);
  daemon.Wait();
  CHECK(Eventually(
      [&] { return station.robot.With([](VirtualUr& ur) { return ur.rtde().clients(); }) == 0; }));
  const int heartbeat = StateOf(station.robot).input_int[24];
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  CHECK(station.Written(0));
  CHECK(StateOf(station.robot).input_int[24] == heartbeat);

  DaemonProcess next(RtdeConfig(PortOf(station.robot)));
  CHECK(Eventually([&] { return StateOf(station.robot).input_int[24] != heartbeat; }));
  INFO(next.Log());
  CHECK(Eventually([&] { return station.Written(0) && station.Written(1); }));
}

TEST_CASE("a lost connection and a restarted controller are logged, and the points come back") {
  Station station;
  DaemonProcess daemon(RtdeConfig(PortOf(station.robot)));
  REQUIRE(Eventually([&] { return station.Written(0); }));
  REQUIRE(station.robot.Execute("fault restart") == "ok");
  CHECK(daemon.Awaits("robot link lost"));
  CHECK(daemon.Awaits("robot link restored"));
  INFO(daemon.Log());
  CHECK(Eventually([&] { return station.Written(0) && station.Written(1); }));
}

TEST_CASE("registers in use, missing fields and texts of the controller are logged with a remedy") {
  Station station;
  station.robot.Execute("fault in-use input_double_register_24");
  station.robot.Execute("fault missing tcp_offset");
  station.robot.Execute("fault text-between on");
  DaemonProcess daemon(RtdeConfig(PortOf(station.robot)));
  CHECK(daemon.Awaits("input_double_register_24 is in use by another client of the controller"));
  CHECK(daemon.Awaits("has no tcp_offset: read without"));
  CHECK(daemon.Awaits("SafetySetup has not been confirmed yet"));
  CHECK(daemon.Awaits("robot input trusted"));
  INFO(daemon.Log());
  CHECK_FALSE(station.Written(0));
  station.robot.Execute("fault free input_double_register_24");
  CHECK(daemon.Awaits("push to the controller works again"));
  CHECK(Eventually([&] { return station.Written(0); }));
}
