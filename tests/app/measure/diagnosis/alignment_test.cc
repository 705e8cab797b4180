// Estimation of instrument frame and tool tip, including rows with a constant tool orientation.
#include "app/measure/diagnosis/linear/alignment.h"

#include <catch2/catch.hpp>
#include <random>

#include "app/measure/diagnosis/preparation/dataset_preparation.h"
#include "app/measure/diagnosis/preparation/realign.h"
#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/statistics/statistics.h"
#include "tests/app/measure/diagnosis/simulated.h"

namespace plumbline::alignment_test {

using namespace plumbline::measure;

namespace {

/// A wrist on three orthogonal linear axes: the tool orientation is constant while only the linear
/// axes move. Instrument frame and tool tip are unknown.
MeasuredCell Gantry(bool wrist_moves) {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 40 --repeats 0 --seed 8");
  std::vector<model::Joint>& joints = data.cell.robot.joints;
  for (std::size_t i = 0; i < 3; ++i) {
    joints[i].type = model::JointType::kPrismatic;
    joints[i].min = -5;
    joints[i].max = 5;
  }
  joints[0].alpha_rad = -90 * kRadPerDeg;
  joints[1].alpha_rad = 90 * kRadPerDeg;
  joints[1].theta_offset_rad = 90 * kRadPerDeg;
  for (model::Joint& joint : joints) joint.compliance_rad_per_Nm.reset();
  for (measure::MeasuredRow& row : data.table.rows) {
    row.q.head<3>() *= 0.3;
    if (!wrist_moves) row.q.tail<3>() = model::JointVector::Constant(3, 0.4);
  }
  Remeasure(data, {}, 5e-5, 4);
  data.cell.measurement.frame_known = data.cell.measurement.tool_known = false;
  return data;
}

Alignment AlignmentOf(const MeasuredCell& data, Dataset& dataset) {
  const Result<Dataset> read = DatasetFrom(data.cell, data.table);
  REQUIRE(read);
  dataset = *read;
  const Result<Alignment> alignment = AlignFrames(dataset, Model::Declared(dataset), 1);
  REQUIRE(alignment);
  return *alignment;
}

}  // namespace

TEST_CASE("rows with many orientations determine tip and base independently of the declaration") {
  MeasuredCell data = Gantry(true);
  const Vec3 true_tip_F = data.cell.tool.tcp_F;
  data.cell.tool.tcp_F += Vec3(0.06, -0.05, 0.06);
  Dataset dataset;
  const Alignment alignment = AlignmentOf(data, dataset);
  CHECK((alignment.model.frames.front().X_FT.front().p - true_tip_F).norm() < 1e-4);
  CHECK(alignment.model.frames.front().X_WB.p.norm() < 2e-4);
  CHECK_FALSE(UndeterminedFramesText(dataset, alignment, SessionIndex(0)));
}

TEST_CASE("each tool has a tip of its own, and a session lists those it measured") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 60 --repeats 0 --seed 8");
  model::CellModel& cell = data.cell;
  cell.tool.rigid = true;
  cell.tool.number = 1;
  for (const int number : {2, 7, 9}) {
    model::Tool& other = cell.further_tools.emplace_back(cell.tool);
    other.number = number;
    other.tcp_F = Vec3(0.01 * number, -0.02, 0.1);
  }
  // Tool 9 is not used; tool 7 only in the second session.
  for (std::size_t k = 0; k < data.table.rows.size(); ++k) {
    const bool second = k >= 30;
    data.table.rows[k].session = second ? "2" : "1";
    data.table.rows[k].tool_number = k % 2 == 0 ? 1 : second ? 7 : 2;
  }
  data.table.recorded.session = data.table.recorded.tool = true;
  Remeasure(data, {}, 2e-5, 4);
  const model::CellModel truth = cell;
  for (int tool = 0; tool < cell.tools(); ++tool) {
    cell.ToolAt(tool).tcp_F += Vec3(0.03, -0.02 * tool, 0.01);
  }
  cell.measurement.frame_known = cell.measurement.tool_known = false;
  Dataset dataset;
  const Alignment alignment = AlignmentOf(data, dataset);
  const auto error_m = [&](int session, int tool) {
    return (alignment.model.frames[SessionIndex(session)].X_FT[tool].p - truth.ToolAt(tool).tcp_F)
        .norm();
  };
  CHECK(error_m(0, 0) < 1e-4);
  CHECK(error_m(0, 1) < 1e-4);
  CHECK(error_m(1, 0) < 1e-4);
  CHECK(error_m(1, 2) < 1e-4);
  CHECK_FALSE(UndeterminedFramesText(dataset, alignment, SessionIndex(0)));
  const Result<Realignment> realigned = Realign(cell, data.table, 1);
  REQUIRE(realigned);
  const std::vector<model::SessionTip>& tips = realigned->cell.sessions.front().tips;
  CHECK(tips.size() == 2);
  const model::CellModel of_session = deflection::CellOfSession(realigned->cell, "2");
  CHECK((of_session.ToolAt(2).tcp_F - truth.ToolAt(2).tcp_F).norm() < 1e-4);
  CHECK(of_session.ToolAt(3).tcp_F == cell.ToolAt(3).tcp_F);
  // Session 2 did not measure tool 2: its tip is that of session 1, and it may have been seated
  // anew as tool 1 was. Tool 9 was never measured.
  CHECK(TipVarianceElsewhere(realigned->cell, 1) < 1e-8);
  CHECK(TipVarianceElsewhere(realigned->cell, 3) == Approx(0.05 * 0.05));
  CHECK_FALSE(StatesTip(realigned->cell, realigned->cell.sessions[1], 1));
  CHECK(realigned->covariance.at("2")[3].bottomRightCorner<3, 3>().isApprox(0.0025 *
                                                                            Mat3::Identity()));
  CHECK((of_session.ToolAt(1).tcp_F - truth.ToolAt(1).tcp_F).norm() < 1e-4);
}

TEST_CASE(
    "with a constant orientation the tip stays as declared and the radius grows accordingly") {
  MeasuredCell data = Gantry(false);
  data.cell.tool.tcp_F += Vec3(0.012, 0, -0.015);
  Dataset dataset;
  const Alignment alignment = AlignmentOf(data, dataset);
  const Model::Frames& frames = alignment.model.frames.front();
  CHECK((frames.X_FT.front().p - data.cell.tool.tcp_F).norm() < 1e-6);
  // The base absorbs the error of the tip; points with this orientation are still predicted
  // correctly.
  CHECK(frames.X_WB.p.norm() == Approx(Vec3(0.012, 0, -0.015).norm()).margin(1e-3));
  const Result<Linearisation> linear = Linearise(dataset, alignment.model, false, 1);
  REQUIRE(linear);
  const auto radius = [&](const Eigen::Matrix<double, 3, 9>& J) {
    return statistics::RadiusHolding95Percent(J * alignment.covariance.front().front() *
                                              J.transpose());
  };
  for (const LinearRow& row : linear->rows) {
    CHECK(row.residual.norm() < 3e-4);
    CHECK(radius(row.frames) < 1e-4);
    // With the tool rotated by half a turn, the error of the tip counts twice.
    Eigen::Matrix<double, 3, 9> turned = row.frames;
    turned.rightCols<3>() = -turned.rightCols<3>();
    CHECK(radius(turned) > 0.1);
  }
  const auto warning = UndeterminedFramesText(dataset, alignment, SessionIndex(0));
  REQUIRE(warning);
  CHECK_THAT(*warning, Catch::Contains("stays as declared") && Catch::Contains("100 mm (95 %)"));
}

}  // namespace plumbline::alignment_test
