// Corrections inside the motion by the real daemon: a PLC that allows them, a robot whose joints
// the daemon reads over Modbus, and a controller that sends packets and applies the answers.
#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <future>
#include <memory>
#include <thread>

#include "tests/app/cell/daemon/daemon_process.h"
#include "tests/app/cell/daemon/demo_config.h"
#include "tests/app/cell/daemon/status_command_output.h"
#include "tests/motion_robots/egm_robot.h"
#include "tests/motion_robots/rsi_robot.h"
#include "tests/motion_robots/udp_peer.h"
#include "tests/virtual_cell/running_cell.h"

namespace plumbline::motion_test {

using namespace plumbline::test;
using motion_robots::Length;
using virtual_cell::Eventually;
using virtual_cell::Profile;
using virtual_cell::RegisterClient;
using virtual_cell::RunningCell;

namespace {

constexpr double kMaxJump_mm = 2, kMaxOffset_mm = 20;

std::string MotionTable(const std::string& kind, int port, const std::string& more = "") {
  return "\n[motion]\nenabled = true\nkind = \"" + kind + "\"\nrobot = \"127.0.0.1\"\n" +
         "listen = \"127.0.0.1\"\nport = " + std::to_string(port) +
         "\nonly_taught_targets = true\ncycle_ms = 4\ntimeout_ms = 60\nmax_offset_mm = "
         "20\nrate_mm_per_s = 30\n"
         "max_jump_mm = 2\nramp_s = 0.3\nwidest_radius_mm = 100\nhold_ms = 2000\n"
         "max_lost_packets = 50\n" +
         more;
}

/// PLC, controller and daemon.
struct Plant {
  RunningCell cell{{.profile = Profile::kUr, .idle = true, .time_scale = 4}};
  int port = motion_robots::UdpPeer::FreePort();
  std::string config;
  std::unique_ptr<DaemonProcess> daemon;
  std::unique_ptr<RegisterClient> plc;
  motion_robots::UdpPeer wire;
  std::unique_ptr<motion_robots::Controller> controller;
  std::uint16_t heartbeat = 0;
  int missing = 0;  ///< cycles in a row without an answer

  explicit Plant(const std::string& kind,
                 const std::string& more = "weakest_basis = \"assumed\"\n") {
    motion_robots::AppliedOptions applied;
    applied.timeout = 15;
    applied.limit_mm = 50;
    if (kind == "egm") {
      controller = std::make_unique<motion_robots::EgmRobot>(motion_robots::EgmOptions{applied});
    } else {
      controller = std::make_unique<motion_robots::RsiRobot>(motion_robots::RsiOptions{applied});
    }
    config = PatientConfig(cell.robot(), "universal-robots-fine");
    daemon = std::make_unique<DaemonProcess>(config + MotionTable(kind, port, more));
    Connect();
  }
  void Connect() {
    plc = std::make_unique<RegisterClient>("PLC", daemon->Plc(), 1, 60);
    REQUIRE(Eventually([&] { return plc->Read(301, 1).Word(0) == 0; }));  // trusted
    const auto joints = plc->Read(304, 12);
    for (int k = 0; k < 6; ++k) {
      controller->joints_deg[static_cast<std::size_t>(k)] = joints.Float(2 * k);
    }
    // The stream must be younger than the daemon.
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
  }
  int State() { return plc->Read(660, 1).Word(0); }
  int Obstacle() { return plc->Read(661, 1).Word(0); }
  double Applied_mm() const { return Length(controller->offset().now()); }

  /// A cycle of the controller, and every so often one of the PLC.
  void Cycle(bool enabled) {
    if (++heartbeat % 25 == 1 && plc != nullptr) {
      plc->Write(1030, {heartbeat, static_cast<std::uint16_t>(enabled ? 2 : 0)});
    }
    wire.Send(controller->BeginCycle(), port);
    const std::string answer = wire.Receive(4);
    if (!answer.empty()) controller->Receive(answer);
    controller->EndCycle();
    missing = answer.empty() ? missing + 1 : 0;
    std::this_thread::sleep_for(std::chrono::milliseconds(answer.empty() ? 0 : 3));
  }
  bool Until(bool enabled, const std::function<bool()>& condition) {
    return Eventually([&] {
      for (int k = 0; k < 10; ++k) Cycle(enabled);
      return condition();
    });
  }
  /// If a busy machine made the controller stop: its next stream, after the silence.
  bool UntilWithRestarts(bool enabled, const std::function<bool()>& condition) {
    return Eventually([&] {
      if (controller->offset().stopped()) {
        std::this_thread::sleep_for(std::chrono::milliseconds(300));
        controller->Start();
      }
      // A heartbeat that a busy machine has lost: the permission must be given anew.
      if (enabled && plc != nullptr && Obstacle() == 5) plc->Write(1031, {0});
      for (int k = 0; k < 10; ++k) Cycle(enabled);
      return condition();
    });
  }
  void CheckNoJump() const {
    CHECK(controller->offset().largest_jump_mm() <= kMaxJump_mm + 1e-5);
    CHECK(controller->offset().largest_mm() <= kMaxOffset_mm + 1e-5);
  }
};

}  // namespace

TEST_CASE(
    "nothing moves until the PLC allows it, then the motion is corrected, and ends in peace") {
  for (const std::string kind : {"rsi", "egm"}) {
    CAPTURE(kind);
    Plant plant(kind);
    INFO(plant.daemon->Log());
    REQUIRE(plant.UntilWithRestarts(false, [&] { return plant.State() == 2; }));
    CHECK(plant.Applied_mm() == 0);
    CHECK(plant.Obstacle() == 5);
    REQUIRE(plant.UntilWithRestarts(true,
                                    [&] { return plant.State() == 3 && plant.Applied_mm() > 1; }));
    // The controller's cycles go on while the command runs.
    auto status = std::async(std::launch::async, StatusText, plant.daemon->Plc());
    plant.UntilWithRestarts(true, [&] {
      return status.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
    });
    CHECK_THAT(status.get(), Catch::Contains("motion link  "));
    // The coil goes off: back to 0.
    REQUIRE(plant.UntilWithRestarts(false,
                                    [&] { return plant.State() == 2 && plant.Applied_mm() == 0; }));
    REQUIRE(plant.UntilWithRestarts(true, [&] { return plant.Applied_mm() > 1; }));
    plant.plc.reset();
    plant.daemon->Signal(SIGTERM);
    const auto ended = [&] {
      for (int k = 0; k < 10 && plant.missing < 100; ++k) plant.Cycle(true);
      return plant.missing >= 100;
    };
    CHECK(Eventually(ended));
    CHECK(plant.daemon->Wait() == 0);
    plant.CheckNoJump();
    CHECK(plant.daemon->Says("motion link: the controller is answered"));
    CHECK(plant.daemon->Says("motion corrected: "));
    CHECK(plant.daemon->Says("motion not corrected: not enabled by the PLC; set coil 1002"));
  }
}

TEST_CASE("a daemon that is killed and started again answers only the next stream") {
  Plant plant("rsi");
  REQUIRE(plant.UntilWithRestarts(true, [&] { return plant.Applied_mm() > 1; }));
  plant.plc.reset();
  plant.daemon->Signal(SIGKILL);
  plant.daemon->Wait();
  // The controller keeps its offset, until it stops by itself.
  REQUIRE(Eventually([&] {
    plant.Cycle(true);
    return plant.controller->offset().stopped();
  }));
  CHECK(plant.Applied_mm() > 1);
  plant.CheckNoJump();
  plant.daemon = std::make_unique<DaemonProcess>(
      plant.config + MotionTable("rsi", plant.port, "weakest_basis = \"assumed\"\n"));
  plant.Connect();
  plant.controller->Start();
  REQUIRE(plant.UntilWithRestarts(true, [&] { return plant.Applied_mm() > 1; }));
  plant.CheckNoJump();
}

TEST_CASE("a radius without measurements corrects nothing") {
  Plant plant("rsi", "");
  REQUIRE(
      plant.UntilWithRestarts(true, [&] { return plant.State() == 2 && plant.Obstacle() == 15; }));
  CHECK(plant.Applied_mm() == 0);
  CHECK(plant.controller->offset().corrected() == 0);
}

TEST_CASE("a reload that ends the correction returns the offset to 0") {
  Plant plant("rsi");
  REQUIRE(plant.UntilWithRestarts(true, [&] { return plant.Applied_mm() > 1; }));
  plant.daemon->Write(plant.config);
  plant.daemon->Signal(SIGHUP);
  REQUIRE(plant.Until(true, [&] { return plant.State() == 0; }));
  plant.CheckNoJump();
}

}  // namespace plumbline::motion_test
