#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <set>
#include <sstream>

#include "tests/simulator/artefacts.h"
#include "tests/simulator/families.h"
#include "tests/simulator/fit.h"
#include "tests/simulator/noise.h"

namespace plumbline::simulator_test {

using namespace simulator;
using Eigen::Vector3d;

namespace {

/// A horizontal rigid arm of one metre with a joint about the vertical, then one about -y.
Cell TwoJointArm() {
  Cell cell;
  Joint turn, lift;
  turn.alpha_rad = std::numbers::pi / 2.0;
  lift.a_m = 1.0;
  lift.mass_kg = 10.0;
  lift.mass_known = true;
  lift.com_m = {-0.5, 0.0, 0.0};
  lift.compliance_rad_per_Nm = 1e-5;
  cell.joints = {turn, lift};
  cell.tool.rigid = true;
  cell.sigma_m = 5e-5;
  return cell;
}

Row At(const Eigen::VectorXd& q_rad, double payload_kg = 0.0) {
  Row row;
  row.q_rad = q_rad;
  row.qd_rad_s = row.qdd_rad_s2 = row.last_move_rad = Eigen::VectorXd::Zero(q_rad.size());
  row.payload_kg = payload_kg;
  row.temp_C = 22.0;
  return row;
}

Effect Simple(const std::string& id, const std::vector<Parameter>& parameters,
              const std::vector<std::string>& scope = {}) {
  return {.id = id, .scope = scope, .parameters = parameters, .by = {}, .frame = {}, .session = {}};
}

Vector3d Tip(const Cell& cell, const Effects& effects, const Row& row) {
  return Tips(cell, effects, {row})[0];
}

std::filesystem::path MeasuredFolder() {
  const char* const folder = std::getenv("PLUMBLINE_MEASURED");
  return folder != nullptr ? folder : "../shared/measured";
}

std::vector<Vector3d> ReadPoints(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  std::vector<Vector3d> points;
  while (std::getline(file, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream numbers(line);
    Vector3d p;
    numbers >> p.x() >> p.y() >> p.z();
    points.emplace_back(p * 1e-3);
  }
  return points;
}

}  // namespace

TEST_CASE("a horizontal arm sags by weight times lever times compliance") {
  const Cell cell = TwoJointArm();
  const Row row = At(Eigen::Vector2d::Zero());
  // m g l/2 = 10 * 9.80665 * 0.5 N m turns the second joint down.
  const double sag_rad = 49.03325e-5;
  const Vector3d tip = Tip(cell, {}, row);
  CHECK(tip.x() == Approx(std::cos(sag_rad)).margin(1e-9));
  CHECK(tip.z() == Approx(-std::sin(sag_rad)).margin(1e-9));
  const Changes none(2);
  CHECK(Arm(cell, none).Torques(row)[1] == Approx(-49.03325).margin(1e-4));
}

TEST_CASE("following error and arrival friction make a joint stop short") {
  Cell cell = TwoJointArm();
  cell.joints[1].compliance_rad_per_Nm.reset();
  Row row = At(Eigen::Vector2d::Zero());
  row.last_move_rad = Eigen::Vector2d(0.2, -0.1);
  const auto tip = [&](const std::string& id, const Parameter& parameter) {
    return Tip(cell, {Simple(id, {parameter})}, row);
  };
  CHECK(tip("following_error", {"q1", 1e-3, "rad"}).y() == Approx(-std::sin(1e-3)));
  CHECK(tip("following_error", {"q2", 1e-3, "rad"}).z() == Approx(std::sin(0.5e-3)));
  // 49.03325 N m about the second joint.
  CHECK(tip("arrival_friction", {"q2", 1e-5, "rad/(N m)"}).z() ==
        Approx(std::sin(0.5 * 1e-5 * 49.03325)));
  row.last_move_rad.setZero();
  CHECK(tip("following_error", {"q1", 1e-3, "rad"}).y() == Approx(0.0).margin(1e-15));
}

TEST_CASE("a coupled joint follows the other one; a rotated axis tilts everything outboard") {
  Cell cell = TwoJointArm();
  cell.joints[1].compliance_rad_per_Nm.reset();
  const Row turned = At(Eigen::Vector2d(0.3, 0.0));
  CHECK(Tip(cell, {Simple("axis_coupling", {{"q2_of_q1", 1e-3, "1"}})}, turned).z() ==
        Approx(std::sin(3e-4)));
  // One metre beyond the second link, along its x; its z points along -y.
  cell.tool.tcp_m = {1.0, 0.0, 0.0};
  const Vector3d tip =
      Tip(cell, {Simple("link_geometry", {{"beta2", 0.1, "deg"}})}, At(Eigen::Vector2d::Zero()));
  CHECK(tip.y() == Approx(std::sin(0.1 * kDeg)));
  CHECK(tip.x() == Approx(1.0 + std::cos(0.1 * kDeg)));
}

TEST_CASE("the torque about each joint is the derivative of the work of gravity") {
  for (const std::string robot : {"kr210", "ur10", "arm6"}) {
    const Cell cell = ReadyCell(robot);
    const Changes none(6);
    const Arm arm(cell, none);
    Eigen::VectorXd q(6);
    q << 0.3, -1.2, 1.4, 0.7, -0.6, 2.0;
    const Row row = At(q, cell.payloads_kg.back());
    // Evaluated in the deflected posture.
    const Eigen::VectorXd torque = arm.Torques(row);
    Eigen::VectorXd sag(6);
    for (int i = 0; i < 6; ++i) sag[i] = torque[i] * *cell.joints[i].compliance_rad_per_Nm;
    for (int i = 0; i < 6; ++i) {
      Eigen::VectorXd more = sag, less = sag;
      more[i] += 1e-5;
      less[i] -= 1e-5;
      INFO(robot << " joint " << i + 1);
      const double slope = (arm.WorkOfGravity(row, more) - arm.WorkOfGravity(row, less)) / 2e-5;
      CHECK(torque[i] == Approx(slope).margin(1e-3));
    }
  }
}

TEST_CASE("a horizontal tool bends according to the beam tables") {
  Tool tool;
  tool.length_m = 1.0;
  tool.side_m = 0.1;
  tool.wall_m = 0.05;  // solid: I = 0.1^4/12
  tool.youngs_modulus_Pa = 12e9;
  tool.density_kg_m3 = 1000.0;
  const double stiffness = 1e5;
  const Vector3d g(10.0, 0.0, 0.0);
  // 30 kg at the tip: 300 N / 3EI; self-weight: 100 N/m / 8EI.
  CHECK(Bending(tool, g, 30.0, {0, 0, 1}).x() == Approx((300.0 / 3.0 + 100.0 / 8.0) / stiffness));
  // Half a metre beyond the tip adds 150 N m / 2EI.
  CHECK(Bending(tool, g, 30.0, {0, 0, 1.5}).x() ==
        Approx((300.0 / 3.0 + 150.0 / 2.0 + 100.0 / 8.0) / stiffness));
  CHECK(Bending(tool, {0, 0, 10}, 30.0, {0, 0, 1.5}).norm() == Approx(0.0).margin(1e-15));
  // The slope at the end: force / 2EI, moment / EI, self-weight / 6EI.
  CHECK(Slope(tool, g, 30.0, {0, 0, 1.5}).y() ==
        Approx((300.0 / 2.0 + 150.0 + 100.0 / 6.0) / stiffness));
  CHECK(Slope(tool, {0, 10, 0}, 30.0, {0, 0, 1.5}).x() ==
        Approx(-(300.0 / 2.0 + 150.0 + 100.0 / 6.0) / stiffness));
}

TEST_CASE("effects move the tip according to their definition") {
  Cell cell = TwoJointArm();
  cell.joints[1].compliance_rad_per_Nm = 0.0;
  Row row = At(Eigen::Vector2d(0.5, 0.0));
  row.temp_C = 32.0;
  row.t_s = 100.0;
  row.last_move_rad << -0.2, 0.0;
  row.qd_rad_s << 0.4, 0.0;
  row.qdd_rad_s2 << 2.0, 0.0;
  const Vector3d still = Tip(cell, {}, row);
  const auto turned_by = [&](const Effect& effect) {  // of the first joint, one metre out
    const Vector3d tip = Tip(cell, {effect}, row);
    return std::atan2(tip.y(), tip.x()) - 0.5;
  };
  CHECK(turned_by(Simple("joint_offset", {{"q1", 1e-3, "rad"}})) == Approx(1e-3));
  CHECK(turned_by(Simple("gear_ratio", {{"q1", 1e-3, "1"}})) == Approx(0.5e-3));
  CHECK(turned_by(Simple("approach_lag", {{"q1", 1e-3, "1"}})) == Approx(0.2e-3));
  CHECK(turned_by(Simple("latency", {{"time", 1e-3, "s"}})) == Approx(-0.4e-3));
  CHECK(turned_by(Simple("dynamic_inertia", {{"q1", 1e-3, "s^2"}})) == Approx(-2e-3));
  Effect backlash = Simple("backlash", {{"q1", 1e-3, "rad"}});
  backlash.by = "move";
  CHECK(turned_by(backlash) == Approx(-1e-3));
  CHECK(turned_by(Simple("gear_periodic", {{"q1_amplitude", 1e-3, "rad"},
                                           {"q1_cycles", 3.0, "1/turn"},
                                           {"q1_phase", 0.1, "rad"}})) ==
        Approx(1e-3 * std::sin(1.6)));
  CHECK((Tip(cell, {Simple("thermal_growth", {{"alpha", 1e-4, "1/K"}})}, row) - 1.001 * still)
            .norm() < 1e-12);
  CHECK((Tip(cell, {Simple("measurement_scale", {{"scale", 1e-4, "1"}})}, row) - 1.0001 * still)
            .norm() < 1e-12);
  Effect drift = Simple("thermal_drift", {{"x", 1.0, "mm"}, {"time_constant", 100.0, "s"}});
  CHECK(Tip(cell, {drift}, row).x() - still.x() == Approx(1e-3 * (1.0 - std::exp(-1.0))));
  Effect step = Simple("step_event", {{"z", 1.0, "mm"}, {"time", 99.0, "s"}});
  CHECK(Tip(cell, {step}, row).z() - still.z() == Approx(1e-3));
  row.t_s = 98.0;
  CHECK(Tip(cell, {step}, row).z() - still.z() == Approx(0.0).margin(1e-15));
}

TEST_CASE("a camera with wrong tag size, zoom or lens reads according to the definition") {
  Cell cell = TwoJointArm();
  cell.joints[1].compliance_rad_per_Nm = 0.0;
  const Row row = At(Eigen::Vector2d::Zero());  // the tip at (1, 0, 0)
  // Below the tip and looking up: (X, Y, Z) in the camera are (1, 0, 2).
  cell.camera = Cell::Camera{{0.0, 0.0, -2.0}, {0.0, 0.0, 0.0}};
  const auto off = [&](const std::string& id, const std::string& name) -> Vector3d {
    return Tip(cell, {Simple(id, {{name, 1e-3, "1"}})}, row) - Tip(cell, {}, row);
  };
  CHECK((off("camera_tag_size", "scale") - Vector3d(1e-3, 0, 2e-3)).norm() < 1e-12);
  CHECK((off("camera_zoom", "scale") - Vector3d(0, 0, 2e-3)).norm() < 1e-12);
  // r^2 = 1/4.
  CHECK((off("camera_lens", "k1") - Vector3d(-0.25e-3, 0, -1e-3)).norm() < 1e-12);
}

TEST_CASE("a pedestal leans under the moment at the base") {
  Cell cell = TwoJointArm();
  cell.joints[1].compliance_rad_per_Nm = 0.0;
  const Row row = At(Eigen::Vector2d::Zero());
  const Vector3d tip =
      Tip(cell, {Simple("pedestal_compliance", {{"compliance", 1e-6, "rad/(N m)"}})}, row);
  CHECK(tip.z() == Approx(-49.03325e-6).epsilon(1e-6));
}

TEST_CASE("bearings and links deflect like beams; links of unknown mass act across gravity") {
  Cell cell = TwoJointArm();
  cell.joints[1].compliance_rad_per_Nm.reset();
  const Row row = At(Eigen::Vector2d::Zero());
  const auto sinks = [&](const std::string& id, const Parameter& parameter) {
    return Tip(cell, {Simple(id, {parameter})}, row).z();
  };
  // 49.03325 N m about the base tilt the first bearing; along the second axis nothing tilts.
  CHECK(sinks("bearing_tilt", {"q1", 1e-6, "rad/(N m)"}) == Approx(-49.03325e-6));
  CHECK(sinks("bearing_tilt", {"q2", 1e-6, "rad/(N m)"}) == Approx(0.0).margin(1e-12));
  CHECK(sinks("link_bending", {"q2", 1e-6, "rad/(N m)"}) == Approx(-49.03325e-6 / 3.0));
  cell.joints[1].mass_kg = 0.0;
  CHECK(sinks("gravity_sag", {"q2_link2_x", 1e-3, "rad"}) == Approx(-std::sin(1e-3)));
  CHECK(sinks("gravity_sag", {"q2_link2_y", 1e-3, "rad"}) == Approx(0.0).margin(1e-12));
}

TEST_CASE("a slide is compressed by its load and bends more the further it is extended") {
  Cell cell;
  cell.joints.resize(1);
  cell.joints[0].prismatic = true;
  cell.tool.rigid = true;
  cell.payload_cog_m = Vector3d::Zero();
  const Row up = At(Eigen::VectorXd::Constant(1, 0.5), 10.0);
  CHECK(Tip(cell, {Simple("joint_compliance", {{"q1", 1e-8, "m/N"}})}, up).z() - 0.5 ==
        Approx(-98.0665e-8));
  cell.base_rpy_rad.y() = std::numbers::pi / 2.0;  // along x
  const Effects bends = {Simple("axis_bending", {{"q1", 1e-6, "1/(N m^2)"}})};
  CHECK(Tip(cell, bends, At(Eigen::VectorXd::Constant(1, 2.0), 10.0)).z() ==
        Approx(-98.0665e-6 * 8.0 / 3.0));
}

TEST_CASE("a carriage with play tilts to the side of its load") {
  Cell cell;
  cell.joints.resize(1);
  cell.joints[0].prismatic = true;
  cell.tool.rigid = true;
  cell.tool.tcp_m = Vector3d(0.0, 0.0, 1.0);
  const Row row = At(Eigen::VectorXd::Constant(1, 0.5), 10.0);
  const auto moved = [&](const std::string& name, const Vector3d& cog_m) -> Vector3d {
    cell.payload_cog_m = cog_m;
    return Tip(cell, {Simple("guide_play", {{name, 1e-3, "rad"}})}, row) - Tip(cell, {}, row);
  };
  // A weight off to +x, upright travel: tipped about +y, the tip a metre above goes with it. Three
  // to four of moment to width makes 0.6.
  CHECK(moved("q1_y", {0.01875, 0, 0}).x() == Approx(0.6e-3));
  CHECK(moved("q1_y", {-0.01875, 0, 0}).x() == Approx(-0.6e-3));
  CHECK(moved("q1_y", {0, 0.3, 0}).norm() < 1e-12);
  // Off to +y: about -x, and the tip goes to +y.
  CHECK(moved("q1_x", {0, 0.01875, 0}).y() == Approx(0.6e-3));
  CHECK(moved("q1_x", {0, 0, 0.3}).norm() < 1e-12);
}

TEST_CASE("the base tilts as the inclinometer reads; ranges are measured from the anchor") {
  Cell cell = TwoJointArm();
  cell.joints[1].compliance_rad_per_Nm.reset();
  Row row = At(Eigen::Vector2d::Zero());
  row.tilt_rad.y() = 1e-3;
  CHECK(Tip(cell, {Simple("base_tilt", {{"gain", 0.5, "1"}})}, row).z() == Approx(-0.5e-3));
  row.t_s = 100.0;
  const auto tilted_from = [&](double time_s) {
    return Tip(cell, {Simple("tilt_event", {{"y", 0.1, "deg"}, {"time", time_s, "s"}})}, row).z();
  };
  CHECK(tilted_from(99.0) == Approx(-std::sin(0.1 * kDeg)));
  CHECK(tilted_from(101.0) == Approx(0.0).margin(1e-12));
  cell.anchor_m = Vector3d(1.0, 0.0, -2.0);
  const auto range_mm = [&](const Effects& effects) { return Readings(cell, effects, {row})[0]; };
  CHECK(range_mm({}) == Approx(2000.0));
  CHECK(range_mm({Simple("range_zero", {{"zero", 3.0, "mm"}})}) == Approx(2003.0));
  CHECK(range_mm({Simple("range_anchor", {{"z", 1.0, "mm"}})}) == Approx(1999.0));
  const Effects longer = {Simple("measurement_scale", {{"scale", 1e-3, "1"}})};
  CHECK(range_mm(longer) == Approx(2002.0));
  CHECK((Tip(cell, longer, row) - Tip(cell, {}, row)).norm() < 1e-12);
}

TEST_CASE("every family hides the requested signal, and a fit of its form recovers it") {
  for (const std::string& family : Families()) {
    if (family == "none" || family == "rigid_declared") continue;
    INFO(family);
    Cell cell = ReadyCell("kr210");
    cell.sigma_m = 1e-6;
    if (NeedsCamera(family)) cell.camera = CameraBeside(cell);
    if (NeedsRange(family)) cell.anchor_m = AnchorBeside(cell);
    for (Joint& joint : cell.joints) {
      if (NeedsUnknownMasses(family)) joint.mass_kg = 0.0;
    }
    Generator random(7);
    Design design;
    design.tests = 20;
    design.dynamic = NeedsVelocities(family);
    design.pressure = NeedsPressure(family);
    design.tilt = NeedsTilt(family);
    Tables tables = DrawDesign(cell, design, random);
    Hidden hidden = DrawFamily(family, cell, random);
    ScaleTo(100.0, cell, tables.measured.rows, hidden.effects);
    if (hidden.effects.size() == 1) {
      CHECK(Signal(cell, hidden.effects, tables.measured.rows) == Approx(100.0).epsilon(0.01));
    }
    Measure(cell, Noise{}, Tips(cell, hidden.effects, tables.measured.rows), tables.measured,
            random);
    for (Row& row : tables.measured.rows) {
      if (!cell.anchor_m) continue;
      const Changes changes(hidden.effects, int(cell.joints.size()));
      row.range_m = Arm(cell, changes).Range(row.xyz_m);
    }
    Effects start = hidden.effects;
    for (Effect& effect : start) {
      for (Parameter& p : effect.parameters) {
        if (!p.fixed && p.unit != "1/turn" && p.unit != "s") p.value *= 0.95;
      }
    }
    const FitResult fit = Fit(cell, start, tables.measured);
    CHECK(fit.rms_m < 3e-6);
  }
}

TEST_CASE("combined effects have the requested joints; drawn ones have different names") {
  const Cell cell = ReadyCell("kr210");
  Generator random(3);
  const Hidden named =
      DrawFamily("joint_compliance@q2,q3+thermal_growth+backlash_move@q4", cell, random);
  REQUIRE(named.effects.size() == 3);
  CHECK(named.effects[0].scope == std::vector<std::string>{"q2", "q3"});
  CHECK(named.effects[1].id == "thermal_growth");
  CHECK(named.effects[2].scope == std::vector<std::string>{"q4"});
  CHECK(named.effects[2].by == "move");
  for (int draw = 0; draw < 20; ++draw) {
    std::set<std::string> names;
    for (const Effect& effect : DrawFamily("four", cell, random).effects) {
      names.insert(effect.id + effect.by);
    }
    CHECK(names.size() == 4);
  }
  CHECK_THROWS(DrawFamily("joint_compliance@q1,q2,q3,q4", cell, random));
}

TEST_CASE("a fit ignores missing measurements; the row keeps its position") {
  Cell cell = ReadyCell("kr210");
  cell.sigma_m = 1e-6;
  Generator random(7);
  Tables tables = DrawDesign(cell, Design{}, random);
  Hidden hidden = DrawFamily("backlash_move", cell, random);
  ScaleTo(100.0, cell, tables.measured.rows, hidden.effects);
  Measure(cell, Noise{}, Tips(cell, hidden.effects, tables.measured.rows), tables.measured, random);
  for (std::size_t k = 0; k < tables.measured.rows.size(); k += 3) {
    tables.measured.rows[k].xyz_m[k % 2] = std::numeric_limits<double>::quiet_NaN();
  }
  tables.measured.rows[5].xyz_m.setConstant(std::numeric_limits<double>::quiet_NaN());
  CHECK(Fit(cell, hidden.effects, tables.measured).rms_m < 3e-6);

  const auto path = std::filesystem::temp_directory_path() / "plumbline_simulator_rows.csv";
  std::ofstream(path) << "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm\n"
                         "1,0,0,0,0,0,10,20,30\n2,0,0,0,0,0,,20,\n2,0,0,0,0,0,,,\n";
  const Table table = ReadTable(path, cell);
  std::filesystem::remove(path);
  REQUIRE(table.rows.size() == 3);
  CHECK(std::isnan(table.rows[1].xyz_m.x()));
  CHECK(table.rows[1].xyz_m.y() == Approx(0.02));
  CHECK(table.rows[2].xyz_m.array().isNaN().all());
  CHECK(table.rows[2].last_move_rad[0] == Approx(kDeg));
}

TEST_CASE("poses of a file keep their order; tests stay within its joints and payloads") {
  const Cell cell = ReadyCell("kr210");
  Generator random(7);
  Design design;
  design.rows = 10;
  Table poses = DrawDesign(cell, design, random).measured;
  for (Row& row : poses.rows) row.payload_kg = 60.0;
  const Tables tables = DesignAt(poses, cell, design, random);
  REQUIRE(tables.measured.rows.size() == poses.rows.size());
  CHECK(tables.measured.rows[3].q_rad == poses.rows[3].q_rad);
  REQUIRE(tables.tests.rows.size() == 300);
  for (const Row& row : tables.tests.rows) CHECK(row.payload_kg == 60.0);
  const auto of_first = [](const Row& a, const Row& b) { return a.q_rad[0] < b.q_rad[0]; };
  const auto [low, high] = std::minmax_element(poses.rows.begin(), poses.rows.end(), of_first);
  for (const Row& row : tables.tests.rows) {
    CHECK(row.q_rad[0] >= low->q_rad[0] - 1e-6);
    CHECK(row.q_rad[0] <= high->q_rad[0] + 1e-6);
  }
}

TEST_CASE("the arm touches its artefacts, and reads gauges and wires, within the noise") {
  Cell cell = ReadyCell("ur10");
  cell.sigma_m = 5e-5;
  Design design;
  design.rows = 24;
  design.repeats = 0;
  const Effects effects = {{.id = "joint_offset",
                            .scope = {"q2"},
                            .parameters = {{"q2", 1e-3, "rad"}},
                            .by = {},
                            .frame = {},
                            .session = {}}};
  const Changes changes(effects, int(cell.joints.size()));
  const Arm arm(cell, changes);
  for (const char* what : {"sockets", "gauges", "wires"}) {
    CAPTURE(what);
    Generator random(3);
    Table table = DrawDesign(cell, design, random).measured;
    const Artefacts artefacts = DrawArtefacts(what, 3, cell, table.rows, random);
    TouchArtefacts(artefacts, cell, effects, table, random);
    for (std::size_t k = 0; k < table.rows.size(); ++k) {
      const Row& row = table.rows[k];
      const Artefact& artefact = artefacts.all[k % artefacts.all.size()];
      REQUIRE(row.artefact == artefact.name);
      const Vector3d from = arm.Tip(row) - artefact.at_m;
      double error_m = from.norm();
      if (table.range) error_m = row.range_m - from.norm();
      if (artefact.kind == "plane") error_m = artefact.direction.dot(from);
      if (artefact.kind == "gauge") error_m = row.gauge_m - artefact.direction.dot(from);
      CHECK(std::abs(error_m) < 6 * cell.sigma_m);
      CHECK(std::abs(error_m) > 0.0);
    }
    if (artefacts.pairs.empty()) continue;
    const auto& pair = artefacts.pairs.front();
    CHECK((artefacts.all[pair.first].at_m - artefacts.all[pair.second].at_m).norm() ==
          Approx(pair.distance_m));
  }
}

TEST_CASE("the declared model reproduces example-03") {
  const std::filesystem::path folder = MeasuredFolder() / "example-03";
  if (!std::filesystem::exists(folder)) {
    WARN("skipped: no " << folder << " (set PLUMBLINE_MEASURED)");
    return;
  }
  const Cell cell = ReadCell(folder / "cell.toml");
  const auto tips = Tips(cell, {}, ReadTable(folder / "test_poses.csv", cell).rows);
  const auto truth = ReadPoints(folder / "test_truth.csv");
  REQUIRE(tips.size() == truth.size());
  double square = 0.0;
  for (std::size_t k = 0; k < tips.size(); ++k) square += (tips[k] - truth[k]).squaredNorm();
  CHECK(std::sqrt(square / double(tips.size())) < 4e-7);
}

}  // namespace plumbline::simulator_test
