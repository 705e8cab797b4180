// Controllers whose model is known, made from the product's own chain: the independent ones are in
// tests/evaluation/controller_models.py.
#include "app/measure/controller/identify.h"

#include <catch2/catch.hpp>
#include <numbers>

#include "app/measure/controller/posture_collector.h"
#include "app/measure/controller/relation_text.h"
#include "app/measure/urdf/chain_difference.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::controller_test {
namespace {

using measure::Identification;
using measure::RelationKind;

/// A UR10e by its published table, with link masses and a tool.
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
  cell.tool.tcp_F = Vec3(0.03, -0.02, 0.15);
  cell.payload_cog_F = Vec3(0, 0, 0.08);
  return cell;
}

/// What a controller reports that differs from the cell by relations, rounded to 1 um and 1e-5
/// rad.
measure::ControllerSample Reported(const model::CellModel& cell,
                                   const measure::Hypothesis& relations, std::vector<double> values,
                                   int count = 14) {
  const measure::RelationContext context(cell);
  measure::ControllerSample sample;
  for (const model::JointVector& q : measure::RandomPostures(cell.robot, count)) {
    measure::ControllerPosture& posture = sample.postures.emplace_back();
    posture.q = q;
    loads::Payload payload;
    payload.mass_kg = sample.postures.size() % 2 == 0 ? 5 : 0;
    payload.cog_F = *cell.payload_cog_F;
    posture.payload = payload;
  }
  measure::HypothesisFit truth;
  truth.hypothesis = relations;
  truth.values = Eigen::Map<Eigen::VectorXd>(values.data(), std::ssize(values));
  const measure::RelationFitter controller(context, sample);
  const auto rounded = [](double value, double step) { return step * std::round(value / step); };
  for (measure::ControllerPosture& posture : sample.postures) {
    const Pose X = controller.ReportedAt(truth, posture);
    posture.angles = VectorFromRotation(X.R);
    for (int k = 0; k < 3; ++k) {
      posture.p[k] = rounded(X.p[k], 1e-6);
      posture.angles[k] = rounded(posture.angles[k], 1e-5);
    }
    posture.R = RotationFromVector(posture.angles);
  }
  return sample;
}

RelationKind KindOf(const Identification& found) {
  REQUIRE(found.verdict == Identification::Verdict::kNamed);
  REQUIRE(found.best.hypothesis.size() == 1);
  return found.best.hypothesis.front().kind;
}

}  // namespace

TEST_CASE("a controller with the cell's own table is nominal, and its difference is rounding") {
  const model::CellModel cell = Cell();
  const measure::RelationContext context(cell);
  const auto sample = Reported(cell, {{}}, {});
  const Identification found = Identify(context, sample);
  CHECK(KindOf(found) == RelationKind::kNominal);
  CHECK(found.IsNominal());
  CHECK(found.nominal.held_out.distance_m < 2e-6);
  CHECK_FALSE(UnexplainedDifference(context, sample));
  CHECK(FindingRemedy(found, context, sample).empty());
}

TEST_CASE("a joint counted against another is named, and its line makes the cell nominal") {
  const model::CellModel cell = Cell();
  const auto sample =
      Reported(cell, {{.kind = RelationKind::kCoupling, .joint = 2, .other = 1}}, {-1.0});
  const measure::RelationContext context(cell);
  CHECK(UnexplainedDifference(context, sample));
  const Identification found = Identify(context, sample);
  REQUIRE(KindOf(found) == RelationKind::kCoupling);
  CHECK(found.best.hypothesis.front().joint == 2);
  CHECK(found.best.hypothesis.front().other == 1);
  model::CellModel changed;
  const auto lines = LinesOf(found.best, context, sample, changed);
  REQUIRE(lines.size() == 1);
  CHECK(lines.front().place == "[robot]");
  CHECK(lines.front().lines ==
        std::vector<std::string>{"coupling = [{ joint = 3, of = 2, ratio = -1.0 }]"});
  CHECK(Identify(measure::RelationContext(changed), sample).IsNominal());
}

TEST_CASE("zero, sign and length of a joint are written as the line that makes it nominal") {
  const model::CellModel cell = Cell();
  const measure::RelationContext context(cell);
  struct Case {
    measure::Relation relation;
    std::vector<double> values;
    std::string line;
  };
  const Case cases[] = {
      {{.kind = RelationKind::kZeroOffset, .joint = 2}, {0.2}, "theta_offset_deg = 11.459"},
      {{.kind = RelationKind::kAxisSign, .joint = 3}, {}, "sign = -1"},
      {{.kind = RelationKind::kTableValue, .joint = 1, .other = 0}, {-0.004}, "a_mm = -616.7"}};
  for (const Case& one : cases) {
    const auto sample = Reported(cell, {one.relation}, one.values);
    const Identification found = Identify(context, sample);
    INFO(NameOf(one.relation.kind) << ": " << FindingText(found, context));
    REQUIRE(KindOf(found) == one.relation.kind);
    model::CellModel changed;
    const auto lines = LinesOf(found.best, context, sample, changed);
    REQUIRE_FALSE(lines.empty());
    CHECK(lines.front().lines.front().substr(0, 8) == one.line.substr(0, 8));
    CHECK(Identify(measure::RelationContext(changed), sample).IsNominal());
  }
}

TEST_CASE("deflection in the controller's pose is compensated twice only if the cell corrects it") {
  model::CellModel rigid = Cell();
  model::CellModel compliant = Cell();
  compliant.robot.joints[1].compliance_rad_per_Nm = 2e-5;
  compliant.robot.joints[2].compliance_rad_per_Nm = 3e-5;
  const auto sample = Reported(compliant, {{.kind = RelationKind::kCellDeflection}}, {});
  const Identification found = Identify(measure::RelationContext(compliant), sample);
  CHECK(KindOf(found) == RelationKind::kCellDeflection);
  CHECK(found.compensation() == measure::Compensation::kDeflection);
  const measure::RelationContext context(compliant), without(rigid);
  CHECK(CompensatedTwice(context, sample, found));
  CHECK(OverlapOf(context, sample, found).correlation > 0.99);
  const Identification plain = Identify(without, sample);
  CHECK(KindOf(plain) == RelationKind::kJointCompliance);
  CHECK_FALSE(CompensatedTwice(without, sample, plain));
}

TEST_CASE("a calibration of the controller is not what a cell corrects as deflection") {
  model::CellModel cell = Cell();
  model::WrittenEffect& effect = cell.effects.emplace_back();
  effect.id = "joint_compliance";
  model::EffectParameter& stiffness = effect.parameters.emplace_back();
  stiffness.name = "q2";
  stiffness.value = 1e-5;
  std::vector<double> values;
  for (int k = 0; k < 30; ++k) values.push_back(1e-3 * std::sin(2.3 * k + 0.4));
  const auto sample = Reported(cell, {{.kind = RelationKind::kAdjustedTable}}, values);
  const measure::RelationContext context(cell);
  const Identification found = Identify(context, sample);
  REQUIRE(KindOf(found) == RelationKind::kAdjustedTable);
  CHECK(found.compensation() == measure::Compensation::kCalibration);
  CHECK_FALSE(CompensatedTwice(context, sample, found));
}

TEST_CASE("deflection in the controller's pose is not what a cell corrects as another cause") {
  model::CellModel compliant = Cell(), cell = Cell();
  compliant.robot.joints[1].compliance_rad_per_Nm = 2e-5;
  const auto sample = Reported(compliant, {{.kind = RelationKind::kCellDeflection}}, {});
  cell.robot.joints[4].compliance_rad_per_Nm = 5e-4;
  const measure::RelationContext context(cell);
  const Identification found = Identify(context, sample);
  REQUIRE(KindOf(found) == RelationKind::kJointCompliance);
  CHECK_FALSE(CompensatedTwice(context, sample, found));
}

TEST_CASE("two zeros are named as two zeros, not as a calibration") {
  const model::CellModel cell = Cell();
  const measure::RelationContext context(cell);
  for (const double zero : {0.035, 0.004}) {
    const auto sample = Reported(cell,
                                 {{.kind = RelationKind::kZeroOffset, .joint = 0},
                                  {.kind = RelationKind::kZeroOffset, .joint = 5}},
                                 {zero, -1.5 * zero});
    const Identification found = Identify(context, sample);
    INFO(FindingText(found, context));
    REQUIRE(found.verdict == Identification::Verdict::kNamed);
    REQUIRE(found.best.hypothesis.size() == 2);
    CHECK(found.best.hypothesis[0] ==
          measure::Relation{.kind = RelationKind::kZeroOffset, .joint = 0});
    CHECK(found.best.hypothesis[1] ==
          measure::Relation{.kind = RelationKind::kZeroOffset, .joint = 5});
    model::CellModel changed;
    const auto lines = LinesOf(found.best, context, sample, changed);
    REQUIRE(lines.size() == 2);
    CHECK(lines[0].place == "[robot], joint 1");
    CHECK(lines[1].place == "[robot], joint 6");
    CHECK(changed.robot.joints[0].beta_rad == 0);
  }
}

TEST_CASE("a table is no calibration if no prior allows its values") {
  const model::CellModel cell = Cell();
  const measure::RelationContext context(cell);
  const auto sample = Reported(cell,
                               {{.kind = RelationKind::kZeroOffset, .joint = 1},
                                {.kind = RelationKind::kZeroOffset, .joint = 2},
                                {.kind = RelationKind::kZeroOffset, .joint = 4}},
                               {0.04, -0.05, 0.06});
  CHECK(Identify(context, sample).verdict == Identification::Verdict::kNone);
}

TEST_CASE("another base is the controller's: the cell keeps its place and its gravity") {
  model::CellModel cell = Cell();
  cell.robot.X_WB.p = Vec3(0.4, -0.3, 0.8);
  const measure::RelationContext context(cell);
  const auto sample = Reported(cell, {{.kind = RelationKind::kBase}}, {0.1, 0.2, 0.9, 1.2, 0.3, 0});
  const Identification found = Identify(context, sample);
  REQUIRE(KindOf(found) == RelationKind::kBase);
  CHECK_FALSE(CellCanHold(found.best));
  model::CellModel changed;
  const auto lines = LinesOf(found.best, context, sample, changed);
  REQUIRE(lines.size() == 1);
  CHECK(lines.front().lines.empty());
  CHECK(changed.robot.X_WB.p == cell.robot.X_WB.p);
  CHECK(changed.robot.X_WB.R == cell.robot.X_WB.R);
}

TEST_CASE("a pose that no relation explains is given no name") {
  const model::CellModel cell = Cell();
  auto sample = Reported(cell, {{}}, {});
  double travel_m = 0.1;
  for (measure::ControllerPosture& posture : sample.postures) {
    posture.p.x() += travel_m;
    travel_m = 1.3 * std::fmod(travel_m + 0.37, 0.9);
  }
  const Identification found = Identify(measure::RelationContext(cell), sample);
  CHECK(found.verdict == Identification::Verdict::kNone);
  CHECK(found.compensation() == measure::Compensation::kNone);
}

TEST_CASE("few postures, or an arm that hardly moved, give no answer") {
  const model::CellModel cell = Cell();
  const measure::RelationContext context(cell);
  const auto few = Reported(cell, {{}}, {}, 5);
  CHECK(Identify(context, few).verdict == Identification::Verdict::kTooFew);
  auto still = Reported(cell, {{}}, {});
  for (measure::ControllerPosture& posture : still.postures) posture = still.postures.front();
  CHECK(Identify(context, still).verdict == Identification::Verdict::kTooFew);
}

TEST_CASE("the step of rounded numbers is found") {
  CHECK(measure::StepOf({0.0123, -0.4567, 0.9}, 1e-3) == Approx(1e-4));
  CHECK(measure::StepOf({0.001, 0.5, -0.25}, 1e-3) == Approx(1e-3));
  CHECK(measure::StepOf({std::numbers::pi, std::numbers::e}, 1e-3) == 0);
  CHECK(measure::StepOf({0, 0}, 1e-3) == 0);
  // Thousandths of a degree, printed in rad with ten decimals: also of small values.
  std::vector<double> printed;
  for (const double degrees : {126.662, 0.985, -4.719, 124.694}) {
    printed.push_back(std::round(degrees * kRadPerDeg * 1e10) / 1e10);
  }
  CHECK(measure::StepOf(printed, kRadPerDeg) == Approx(1e-3 * kRadPerDeg));
}

TEST_CASE("a full collector keeps the postures that are farthest apart") {
  measure::PostureCollector collector(3);
  const auto at = [](double q) {
    measure::ControllerPosture posture;
    posture.q = model::JointVector::Constant(1, q);
    return posture;
  };
  for (const double q : {0.0, 0.2, 0.25, 0.4}) collector.Add(at(q));
  CHECK(collector.postures().size() == 3);
  CHECK(collector.Add(at(2.0)));
  CHECK_FALSE(collector.Add(at(1.95)));
  CHECK(collector.postures().size() == 3);
  CHECK(measure::DistanceToNearest(collector.postures(), at(2.0).q) == 0);
}

TEST_CASE("a reading with a tool that the cell does not declare is no posture") {
  model::CellModel cell;
  cell.tool.number = 1;
  model::RobotState reading;
  reading.sequence = 1;
  reading.q = model::JointVector::Zero(2);
  reading.X_BT = Pose();
  reading.tool_number = 7;
  CHECK_FALSE(measure::PostureFromReading(reading, cell));
  reading.tool_number = 1;
  CHECK(measure::PostureFromReading(reading, cell));
}

TEST_CASE("postures expire") {
  measure::PostureCollector collector;
  for (const double t_s : {10.0, 20.0}) {
    measure::ControllerPosture posture;
    posture.q = model::JointVector::Constant(1, 0.1 * t_s);
    posture.t_s = t_s;
    collector.Add(posture);
  }
  collector.Expire(15);
  REQUIRE(collector.postures().size() == 1);
  CHECK(collector.postures().front().t_s == 20);
}

TEST_CASE("readings become a posture at standstill only, or with their velocity") {
  model::RobotState reading;
  reading.q = model::JointVector::Zero(2);
  reading.X_BT = Pose();
  const model::CellModel cell;
  measure::ReadingFilter still(false), moving(true);
  std::optional<measure::ControllerPosture> rest, motion;
  for (int k = 1; k <= 3; ++k) {
    reading.sequence = static_cast<std::uint64_t>(k);
    reading.timestamp_s = 0.1 * k;
    reading.q[0] = 0.02 * k;
    rest = still.Observe(reading, cell);
    motion = moving.Observe(reading, cell);
  }
  CHECK_FALSE(rest);
  REQUIRE(motion);
  CHECK(motion->qd[0] == Approx(0.2));
  CHECK(motion->q[0] == Approx(0.04));
  for (int k = 4; k <= 6; ++k) {
    reading.sequence = static_cast<std::uint64_t>(k);
    reading.timestamp_s = 0.1 * k;
    rest = still.Observe(reading, cell);
  }
  CHECK(rest);
}

TEST_CASE("a row that does not fit the others is named, and the answer is about the others") {
  const model::CellModel cell = Cell();
  const measure::RelationContext context(cell);
  const measure::Relation coupling{.kind = RelationKind::kCoupling, .joint = 2, .other = 1};
  for (const bool coupled : {false, true}) {
    auto sample = coupled ? Reported(cell, {coupling}, {-1.0}, 16) : Reported(cell, {}, {}, 16);
    sample.postures[5].line = 7;
    for (const double travel_m : {0.03, 0.0005}) {
      auto moved = sample;
      moved.postures[5].p.x() += travel_m;
      const Identification found = Identify(context, moved);
      INFO(FindingText(found, context));
      REQUIRE(KindOf(found) == (coupled ? RelationKind::kCoupling : RelationKind::kNominal));
      REQUIRE(found.outlying.size() == 1);
      CHECK(found.outlying.front().row == 5);
      CHECK(found.outlying.front().error.distance_m == Approx(travel_m).margin(2e-5));
      CHECK(found.postures == 15);
      CHECK(FindingText(found, context).find("row 6 in line 7") != std::string::npos);
    }
  }
}

TEST_CASE("several rows that do not fit are named, but no more than one in four") {
  const model::CellModel cell = Cell();
  const measure::RelationContext context(cell);
  auto sample = Reported(cell, {{.kind = RelationKind::kHiddenTool}}, {0.08, 0, 0, 0, 0, 0}, 16);
  for (const std::size_t row : {std::size_t{2}, std::size_t{9}, std::size_t{14}})
    sample.postures[row].p += 0.001 * static_cast<double>(row) * Vec3(1, -2, 0.5);
  const Identification found = Identify(context, sample);
  INFO(FindingText(found, context));
  CHECK(KindOf(found) == RelationKind::kHiddenTool);
  REQUIRE(found.outlying.size() == 3);
  CHECK(found.outlying[0].row == 2);
  CHECK(found.outlying[1].row == 9);
  CHECK(found.outlying[2].row == 14);
}

TEST_CASE("rows that fit are never left out") {
  const model::CellModel cell = Cell();
  const measure::RelationContext context(cell);
  const measure::RelationFitter fitter(context, Reported(cell, {}, {}, 16));
  CHECK(FindOutlyingRows(fitter, {{}}, [](double) { return true; }).empty());
}

TEST_CASE(
    "of relations that are the same everywhere, the tool comes before a dimension of the arm") {
  const model::CellModel cell = Cell();
  const auto sample = Reported(cell, {{.kind = RelationKind::kHiddenTool}}, {0, 0, 0.005, 0, 0, 0});
  const Identification found = Identify(measure::RelationContext(cell), sample);
  CHECK(KindOf(found) == RelationKind::kHiddenTool);
}

TEST_CASE("joints in radians that were read as degrees are no arm that hardly moved") {
  const model::CellModel cell = Cell();
  auto sample = Reported(cell, {}, {});
  for (measure::ControllerPosture& posture : sample.postures) posture.q *= kRadPerDeg;
  sample.joint_step = 1e-12;
  const Identification found = Identify(measure::RelationContext(cell), sample);
  CHECK(KindOf(found) == RelationKind::kJointUnit);
}

}  // namespace plumbline::controller_test
