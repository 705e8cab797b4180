// A plan for a ready cell: safe postures, on the artefacts, better than random ones.
#include "app/measure/plan/measurement_plan.h"

#include <catch2/catch.hpp>
#include <sstream>

#include "app/base/config/cell_reader.h"
#include "app/measure/plan/plan_text.h"
#include "firmware-like/kinematics/chain.h"

namespace plumbline::measurement_plan_test {

using namespace plumbline::measure;

namespace {

model::CellModel Ur10() {
  config::FaultList faults;
  const auto cell = config::ReadCell("config/cells/ur10.toml", faults);
  REQUIRE(cell);
  return *cell;
}

PlanTask Small() {
  PlanTask task;
  task.rows = 12;
  task.candidates = 60;
  return task;
}

model::Artefact Socket(const std::string& name, const Vec3& place) {
  model::Artefact artefact;
  artefact.name = name;
  artefact.place = place;
  artefact.sd_m = 1e-3;
  return artefact;
}

}  // namespace

TEST_CASE("a plan is safe and determines more than random postures") {
  const model::CellModel cell = Ur10();
  const PlanTask task = Small();
  const auto plan = PlanMeasurements(cell, task);
  INFO((plan ? "" : plan.error()));
  REQUIRE(plan);
  REQUIRE(plan->rows.size() == 12);
  CHECK(plan->efficiency > 1.02);
  CHECK_FALSE(plan->effects.empty());
  const PostureCheck check(cell, task.rules);
  for (const PlannedRow& row : plan->rows) {
    CHECK(check.IsSafe(row.q));
    CHECK(row.X_WT.p.z() >= 0);
    CHECK(check.arm().chain().WithinLimits(row.q));
  }
  CHECK(PlanMeasurements(cell, task)->rows[5].q == plan->rows[5].q);  // deterministic
}

TEST_CASE("a plan on artefacts touches them") {
  model::CellModel cell = Ur10();
  cell.artefacts = {Socket("left", Vec3(0.6, 0.3, 0.3)), Socket("right", Vec3(0.5, -0.4, 0.4))};
  PlanTask task = Small();
  task.artefacts = {"left", "right"};
  const auto plan = PlanMeasurements(cell, task);
  INFO((plan ? "" : plan.error()));
  REQUIRE(plan);
  for (const PlannedRow& row : plan->rows) {
    const Vec3& place = *cell.artefacts[row.artefact == "left" ? 0 : 1].place;
    CHECK((row.X_WT.p - place).norm() < 1e-6);
  }
  task.artefacts = {"front"};
  CHECK_THAT(PlanMeasurements(cell, task).error(), Catch::Contains("no [[artefact]] \"front\""));
  cell.artefacts[0].place.reset();
  task.artefacts = {"left"};
  CHECK_THAT(PlanMeasurements(cell, task).error(), Catch::Contains("its place is unknown"));
  cell.artefacts[0].place = Vec3(9, 0, 0);
  CHECK_THAT(PlanMeasurements(cell, task).error(), Catch::Contains("only 0 safe postures"));
}

TEST_CASE("a plan is for one tool, and names tool, item and payload of every row") {
  model::CellModel cell = Ur10();
  cell.tool.number = 1;
  model::Tool longer = cell.tool;
  longer.number = 2;
  longer.rigid = true;
  longer.segments.clear();
  longer.tcp_F = Vec3(0, 0, 0.4);
  cell.further_tools = {longer};
  cell.payload_items = {{.number = 3, .mass_kg = 2, .cog_F = Vec3(0, 0, 0.1)}};
  PlanTask task = Small();
  const auto first = PlanMeasurements(cell, task);
  INFO((first ? "" : first.error()));
  REQUIRE(first);
  CHECK(LoadText(first->rows[0]) == "tool 1, no payload item");
  task.tool_number = 2;
  task.payload_items = {0, 3};
  const auto second = PlanMeasurements(cell, task);
  INFO((second ? "" : second.error()));
  REQUIRE(second);
  int with_item = 0;
  const kinematics::Chain chain(cell.robot);
  for (const PlannedRow& row : second->rows) {
    CHECK(row.tool_number == 2);
    with_item += row.payload_item == 3 ? 1 : 0;
    kinematics::Posture posture;
    chain.Evaluate(row.q, posture);
    CHECK((row.X_WT.p - cell.robot.X_WB * (posture.X_BF() * longer.tcp_F)).norm() < 1e-9);
  }
  CHECK(with_item > 0);
  CHECK(with_item < 12);
  CHECK_THAT(PlanCsv(*second, cell.robot.joints), Catch::Contains(",tool,payload_item\n"));
  CHECK_THAT(UrScript(*second), Catch::Contains("measure with tool 2, payload item 3, then"));
  CHECK_THAT(PointList(*second, cell.robot.joints), Catch::Contains("\ttool 2, no payload item\n"));
  task.tool_number = 5;
  CHECK_THAT(PlanMeasurements(cell, task).error(),
             Catch::Contains("has no [[tool]] with number = 5"));
  task.tool_number = 2;
  task.payload_items = {4};
  CHECK_THAT(PlanMeasurements(cell, task).error(),
             Catch::Contains("has no [[payload.item]] with number = 4"));
}

TEST_CASE("the rows of a plan are grouped by load, and no payload is named, too") {
  PlanTask task = Small();
  task.payloads_kg = {8, 0};
  const auto plan = PlanMeasurements(Ur10(), task);
  REQUIRE(plan);
  CHECK(plan->load_changes == 1);
  int changes = 0;
  for (std::size_t k = 1; k < plan->rows.size(); ++k)
    changes += plan->rows[k].payload_kg != plan->rows[k - 1].payload_kg ? 1 : 0;
  CHECK(changes == 1);
  CHECK_THAT(LoadText(plan->rows.front()), Catch::Contains("no payload"));
  CHECK_THAT(UrScript(*plan), Catch::Contains("measure with no payload, then"));
  CHECK_THAT(UrScript(*plan), Catch::Contains("measure with payload 8 kg, then"));
}

TEST_CASE("singular postures, the floor and the arm itself are avoided") {
  const model::CellModel cell = Ur10();
  const PostureCheck check(cell, {});
  model::JointVector q(6);
  q << 0, 0, 0, 0, 1, 0;  // stretched out
  CHECK(check.Dexterity(q) < 0.03);
  q << 0.3, 1.2, 0.4, -0.5, 1, 0;  // down through the floor
  CHECK_FALSE(check.IsSafe(q));
  q << 0, -1.5, 2.6, -1, 1.5, 0;  // folded
  CHECK_FALSE(check.IsMoveFree(q, q + model::JointVector::Constant(6, 1.5)));
}

TEST_CASE("the plan as table, program, points and picture") {
  const model::CellModel cell = Ur10();
  MeasurementPlan plan;
  PlannedRow row;
  row.q = model::JointVector::Constant(6, 0.5);
  row.X_WT.p = Vec3(0.1, 0.2, 0.3);
  plan.rows = {row, row};
  plan.rows[0].move_checked = true;
  plan.rows[1].artefact = "left";
  const std::string csv = PlanCsv(plan, cell.robot.joints);
  CHECK_THAT(csv, Catch::Contains("q1_deg,q2_deg") && Catch::Contains("artefact\n28.64789"));
  const std::string script = UrScript(plan);
  CHECK_THAT(script, Catch::Contains("movej([0.500000, 0.500000") &&
                         Catch::Contains("measure at left") &&
                         Catch::Contains("Guide the robot to 28.6, 28.6, 28.6, 28.6, 28.6, 28.6 "
                                         "deg, onto left"));
  CHECK(script.find("movej") == script.rfind("movej"));
  CHECK_THAT(PointList(plan, cell.robot.joints), Catch::Contains("\t100.000\t200.000\t300.000"));
  const std::string svg = PlanSvg(plan, cell);
  CHECK(svg.find("<svg") == 0);
  CHECK(svg.find("nan") == std::string::npos);
}

}  // namespace plumbline::measurement_plan_test
