// The supplied cells at postures whose flange position is published by the manufacturer.
#include <catch2/catch.hpp>
#include <numbers>

#include "app/base/config/cell_reader.h"
#include "firmware-like/kinematics/chain.h"

namespace plumbline::published_poses_test {

using namespace plumbline::config;

TEST_CASE("the flange of each supplied cell matches its data sheet") {
  struct Case {
    const char* cell;
    std::vector<double> q_deg;
    Vec3 flange_mm;
    const char* source;
  };
  const Case cases[] = {
      {"ur5",
       {0, 0, 0, 0, 0, 0},
       {-817.25, -191.45, -5.491},
       "arm stretched: a2+a3, -(d4+d6), d1-d5"},
      {"ur5", {0, -90, 0, -90, 0, 0}, {0, -191.45, 1001.059}, "upright: d1-a2-a3+d5"},
      {"ur10", {0, 0, 0, 0, 0, 0}, {-1184.3, -256.141, 11.6}, "likewise"},
      {"irb120",
       {0, 0, 0, 0, 0, 0},
       {374, 0, 630},
       "ABB data sheet: wrist at 302 mm, flange 72 mm on"},
      {"iiwa7", {0, 0, 0, 0, 0, 0, 0}, {0, 0, 1266}, "KUKA data sheet: 340+400+400+126 upright"},
      {"xarm6", {0, 0, 0, 0, 0, 0}, {207, 0, 112}, "UFACTORY manual, zero position"},
  };
  for (const Case& c : cases) {
    CAPTURE(c.cell, c.source);
    FaultList faults;
    const auto cell = ReadCell(std::string("config/cells/") + c.cell + ".toml", faults);
    INFO(FaultsText(faults));
    REQUIRE(cell);
    REQUIRE(static_cast<std::size_t>(cell->robot.size()) == c.q_deg.size());
    model::JointVector q(cell->robot.size());
    for (int i = 0; i < q.size(); ++i) {
      q[i] = c.q_deg[static_cast<std::size_t>(i)] * std::numbers::pi / 180;
    }
    kinematics::Posture posture;
    kinematics::Chain(cell->robot).Evaluate(q, posture);
    CHECK((1e3 * posture.X_BF().p - c.flange_mm).norm() < 0.5);
  }
}

}  // namespace plumbline::published_poses_test
