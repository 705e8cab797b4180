// The watch on the controller's model, with snapshots of a robot that moves from posture to
// posture.
#include "app/cell/daemon/controller_watch.h"

#include <catch2/catch.hpp>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "app/measure/urdf/chain_difference.h"
#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::controller_watch_test {
namespace {

model::CellModel Cell() {
  constexpr double kRows[6][4] = {{0, 90, 180.7, 7.4},  {-612.7, 0, 0, 13.1},  {-571.55, 0, 0, 4.0},
                                  {0, 90, 174.15, 2.1}, {0, -90, 119.85, 2.0}, {0, 0, 116.55, 0.6}};
  model::CellModel cell;
  for (const auto& row : kRows) {
    model::Joint& joint = cell.robot.joints.emplace_back();
    joint.a_m = 1e-3 * row[0];
    joint.alpha_rad = kRadPerDeg * row[1];
    joint.d_m = 1e-3 * row[2];
    joint.link_mass_kg = row[3];
    joint.link_com_m = Vec3(-0.3 * joint.a_m, 0, 0.02);
    joint.min = -2.5;
    joint.max = 2.5;
  }
  cell.robot.joints[1].compliance_rad_per_Nm = 2e-5;
  cell.robot.joints[2].compliance_rad_per_Nm = 3e-5;
  cell.tool.tcp_F = Vec3(0.03, -0.02, 0.15);
  cell.payload_cog_F = Vec3(0, 0, 0.08);
  return cell;
}

/// Shows the watch a robot at standstill in 14 postures, and waits for its answer.
struct Watched {
  std::vector<log::Event> events{};
  cell::ControllerWatch watch{
      [this](const log::LogEntry& entry) { events.push_back(entry.event); }};
  Snapshot snapshot{};

  explicit Watched(const model::CellModel& cell) {
    config::DaemonConfig config;
    config.machine.cell = cell;
    watch.Configure(config);
  }

  /// @param deflects  the controller's pose contains the deflection
  /// @param skip      postures that are left out
  void Visit(const model::CellModel& cell, bool deflects, int skip = 0) {
    const deflection::LoadedArm arm(cell);
    const bool before = watch.answered();
    snapshot.input_fault = InputFault::kOk;
    snapshot.payload_valid = true;
    snapshot.payload.cog_F = *cell.payload_cog_F;
    std::vector<model::JointVector> postures = measure::RandomPostures(cell.robot, 14 + skip);
    postures.erase(postures.begin(), postures.begin() + skip);
    for (const model::JointVector& q : postures) {
      snapshot.payload.mass_kg = snapshot.payload.mass_kg > 0 ? 0 : 5;
      deflection::LoadedState state;
      REQUIRE(arm.AtCommanded(q, snapshot.payload, {}, state));
      snapshot.reading.q = q;
      snapshot.reading.X_BT = deflects ? state.X_BT : arm.UnloadedTip(q);
      for (int k = 0; k < 3; ++k) Next();
    }
    for (int k = 0; k < 3000; ++k) {
      Next();
      if (watch.answered() && !(before && events.empty())) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }

  void Next() {
    ++snapshot.reading.sequence;
    snapshot.now_s += 0.1;
    snapshot.reading.timestamp_s = snapshot.now_s;
    watch.Observe(snapshot);
  }
};

}  // namespace

TEST_CASE("a controller whose pose contains the deflection that the cell corrects is an alarm") {
  const model::CellModel cell = Cell();
  Watched watched(cell);
  watched.Visit(cell, true);
  CHECK(watched.watch.compensated_twice());
  REQUIRE(watched.events.size() == 2);
  CHECK(watched.events[0] == log::Event::kControllerPoseDiffers);
  CHECK(watched.events[1] == log::Event::kCompensatedTwice);
}

TEST_CASE("a controller with the cell's rigid table is not mentioned") {
  const model::CellModel cell = Cell();
  Watched watched(cell);
  watched.Visit(cell, false);
  CHECK_FALSE(watched.watch.compensated_twice());
  CHECK(watched.events.empty());
}

TEST_CASE("a controller that changes is judged by postures after the change") {
  const model::CellModel cell = Cell();
  Watched watched(cell);
  watched.Visit(cell, true);
  REQUIRE(watched.watch.compensated_twice());
  watched.events.clear();
  SECTION("while it goes on reporting") {}
  SECTION("after its link was lost") {
    watched.snapshot.now_s += 60;
  }
  watched.Visit(cell, false);
  CHECK_FALSE(watched.watch.compensated_twice());
  REQUIRE(watched.events.size() == 1);
  CHECK(watched.events[0] == log::Event::kControllerAgrees);
}

TEST_CASE("each posture has the tool offset that was reported with it") {
  model::CellModel cell = Cell();
  const deflection::LoadedArm arm(cell);
  Watched watched(cell);
  watched.snapshot.input_fault = InputFault::kOk;
  int posture = 0;
  for (const model::JointVector& q : measure::RandomPostures(cell.robot, 12)) {
    const Pose X_FT{Mat3::Identity(), Vec3(0, 0, 0.1 + 0.02 * (++posture % 3))};
    watched.snapshot.reading.q = q;
    watched.snapshot.reading.X_FT = X_FT;
    watched.snapshot.reading.X_BT = arm.UnloadedTip(q) * arm.X_FT().Inverse() * X_FT;
    for (int k = 0; k < 3; ++k) watched.Next();
  }
  for (int k = 0; k < 3000 && !watched.watch.answered(); ++k) {
    watched.Next();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  CHECK(watched.watch.answered());
  CHECK(watched.events.empty());
}

}  // namespace plumbline::controller_watch_test
