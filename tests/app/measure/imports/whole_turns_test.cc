// Joints counted from 0 to 360 degrees against limits around zero.
#include "app/measure/imports/whole_turns.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "firmware-like/geometry/units.h"

namespace plumbline::whole_turns_test {
namespace {

model::Robot Limited(double low_deg, double high_deg) {
  model::Robot robot;
  model::Joint joint;
  joint.min = kRadPerDeg * low_deg, joint.max = kRadPerDeg * high_deg;
  robot.joints = {joint};
  return robot;
}

measure::ImportedTable Table(const std::vector<double>& q_deg) {
  measure::ImportedTable table;
  for (const double q : q_deg) {
    table.rows.push_back({static_cast<int>(table.rows.size()) + 2, {{"q1_deg", q}}, {}, {}});
  }
  return table;
}

}  // namespace

TEST_CASE("values from 0 to 360 are brought within limits of one turn, and only those") {
  std::mt19937 random(31);
  std::uniform_real_distribution<double> within(-170, 170);
  for (int k = 0; k < 200; ++k) {
    std::vector<double> meant, counted;
    for (int i = 0; i < 10; ++i) {
      meant.push_back(within(random));
      counted.push_back(meant.back() < 0 ? meant.back() + 360 : meant.back());
    }
    measure::ImportedTable table = Table(counted);
    SubtractWholeTurns(Limited(-180, 180), 0.02, table);
    for (std::size_t i = 0; i < meant.size(); ++i) {
      CHECK(std::abs(table.rows[i].numbers.at("q1_deg") - meant[i]) < 1e-9);
    }
    // An arm that may turn twice, or with a dead angle in which a value lies, is left alone.
    for (const model::Robot& robot : {Limited(-360, 360), Limited(-90, 90)}) {
      measure::ImportedTable other = Table(counted);
      other.rows[0].numbers.at("q1_deg") = 120;
      SubtractWholeTurns(robot, 0.02, other);
      CHECK(other.notes.empty());
      CHECK(other.rows[0].numbers.at("q1_deg") == 120);
      for (std::size_t i = 1; i < counted.size(); ++i) {
        CHECK(other.rows[i].numbers.at("q1_deg") == counted[i]);
      }
    }
    // Degrees converted twice are not turns.
    measure::ImportedTable twice = Table(counted);
    for (auto& row : twice.rows) row.numbers.at("q1_deg") *= kDegPerRad;
    SubtractWholeTurns(Limited(-180, 180), 0.02, twice);
    CHECK(twice.notes.empty());
  }
}

TEST_CASE("a joint whose whole turn moves a coupled axis by part of a turn is left alone") {
  for (const double ratio : {1.0, 0.5}) {
    measure::ImportedTable table = Table({10, 350, 200});
    model::Robot robot = Limited(-180, 180);
    robot.joints.push_back(robot.joints.front());
    robot.couplings = {{1, 0, ratio}};
    SubtractWholeTurns(robot, 0.02, table);
    CHECK(table.notes.empty() == (ratio == 0.5));
  }
}

TEST_CASE("what was subtracted is said") {
  measure::ImportedTable table = Table({10, 350, 200});
  SubtractWholeTurns(Limited(-180, 180), 0.02, table);
  REQUIRE(table.notes.size() == 1);
  CHECK(table.notes[0] ==
        "q1_deg: the file counts from 0 to 360 degrees, the cell from -180 to 180: 360 subtracted "
        "in 2 of 3 rows, the first in line 3 (350 becomes -10)");
}

}  // namespace plumbline::whole_turns_test
