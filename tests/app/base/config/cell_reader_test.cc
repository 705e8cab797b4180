#include "app/base/config/cell_reader.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "app/base/config/model_fingerprint.h"
#include "app/base/config/toml_reader.h"
#include "firmware-like/geometry/rotation.h"
#include "tests/app/base/config/wrong_line.h"

namespace plumbline::cell_reader_test {

using namespace plumbline::config;

namespace {

constexpr double kPi = 3.14159265358979323846;

// A turning, a sliding and a turning joint under a square tube.
const std::string kGood = R"(
schema = 1
[robot]
name = "test arm"
convention = "dh"
gravity_m_s2 = [0.0, 0.0, -9.8]
base_xyz_mm = [100.0, 200.0, 300.0]
base_rpy_deg = [0.0, 0.0, 90.0]
[[robot.joint]]
a_mm = 350.0
alpha_deg = -90.0
d_mm = 675.0
theta_offset_deg = 10.0
sign = -1
min_deg = -150.0
max_deg = 150.0
link_mass_kg = 250.0
link_com_mm = [-200.0, 100.0, 0.0]
compliance_rad_per_Nm = 3.5e-7
[[robot.joint]]
type = "prismatic"
a_mm = 1.0
alpha_deg = 2.0
d_mm = 3.0
min_mm = -5.0
max_mm = 2000.0
link_mass_kg = 25.0
link_com_mm = [1.0, 2.0, 3.0]
[[robot.joint]]
a_mm = 4.0
alpha_deg = 5.0
d_mm = 6.0
link_mass_kg = 2.5
link_com_mm = [4.0, 5.0, 6.0]
[tool]
model = "euler_bernoulli"
axis = "z"
length_mm = 1200.0
section = "square_tube"
side_mm = 80.0
wall_mm = 5.0
youngs_modulus_GPa = 70.0
poisson_ratio = 0.33
density_kg_m3 = 2700.0
mount_mass_kg = 8.0
[payload]
cog_mm = [0.0, 40.0, 1300.0]
[measurement]
kind = "range"
anchor_mm = [1000.0, 0.0, 0.0]
frame = "unaligned"
tool = "unknown"
sigma_mm = 0.05
reference_temperature_C = 22.0
[[session]]
id = "1"
base_xyz_mm = [1.0, 2.0, 3.0]
base_rpy_deg = [0.0, 0.0, 180.0]
tip_mm = [0.0, 0.0, 93.0]
[[session]]
id = "2"
[domain]
q_deg = [[-90.0, 90.0], [0.0, 500.0], [-45.0, 45.0]]
payload_kg = [0.0, 80.0]
temp_C = [21.0, 37.0]
)";

bool Reads(const std::string& text, FaultList& faults) {
  return CellFromText(text, "cell.toml", faults).has_value();
}

TEST_CASE("Every value of a cell is read and converted to SI") {
  FaultList faults;
  const auto cell = CellFromText(kGood, "cell.toml", faults);
  CAPTURE(FaultsText(faults));
  REQUIRE(cell);
  CHECK(faults.All().empty());

  const model::Robot& robot = cell->robot;
  CHECK(robot.name == "test arm");
  CHECK(robot.convention == model::DhConvention::kDistal);
  CHECK(robot.g_W == Vec3(0, 0, -9.8));
  CHECK(robot.X_WB.p.isApprox(Vec3(0.1, 0.2, 0.3)));
  CHECK(robot.X_WB.R.isApprox(RotationFromRollPitchYaw(Vec3(0, 0, kPi / 2))));
  REQUIRE(robot.size() == 3);
  const model::Joint& first = robot.joints[0];
  CHECK(first.type == model::JointType::kRevolute);
  CHECK(first.a_m == Approx(0.35));
  CHECK(first.alpha_rad == Approx(-kPi / 2));
  CHECK(first.d_m == Approx(0.675));
  CHECK(first.theta_offset_rad == Approx(kPi / 18));
  CHECK(first.sign == -1);
  CHECK(first.min == Approx(-150 * kPi / 180));
  CHECK(first.max == Approx(150 * kPi / 180));
  CHECK(first.link_mass_kg == 250.0);
  CHECK(first.link_com_m->isApprox(Vec3(-0.2, 0.1, 0)));
  CHECK(first.compliance_rad_per_Nm == 3.5e-7);
  const model::Joint& second = robot.joints[1];
  CHECK(second.type == model::JointType::kPrismatic);
  CHECK(second.min == Approx(-0.005));
  CHECK(second.max == Approx(2));
  CHECK(second.sign == 1);
  CHECK_FALSE(second.compliance_rad_per_Nm);
  CHECK(std::isinf(robot.joints[2].max));

  CHECK_FALSE(cell->tool.rigid);
  CHECK(cell->tool.theory == model::BeamTheory::kEulerBernoulli);
  REQUIRE(cell->tool.segments.size() == 1);
  CHECK(cell->tool.Length() == Approx(1.2));
  CHECK(cell->tool.tcp_F.isApprox(Vec3(0, 0, 1.2)));
  CHECK(cell->tool.segments[0].section.area_m2 == Approx(0.08 * 0.08 - 0.07 * 0.07));
  CHECK(cell->tool.segments[0].section.ix_m4 ==
        Approx((std::pow(0.08, 4) - std::pow(0.07, 4)) / 12));
  CHECK(cell->tool.segments[0].material.youngs_modulus_Pa == Approx(70e9));
  CHECK(cell->tool.segments[0].material.poisson_ratio == 0.33);
  CHECK(cell->tool.segments[0].material.density_kg_m3 == 2700.0);
  CHECK(cell->tool.mount_mass_kg == 8.0);

  CHECK(cell->payload_cog_F->isApprox(Vec3(0, 0.04, 1.3)));
  CHECK(cell->measurement.kind == model::MeasurementKind::kRange);
  CHECK(cell->measurement.anchor_W.isApprox(Vec3(1, 0, 0)));
  CHECK_FALSE(cell->measurement.frame_known);
  CHECK_FALSE(cell->measurement.tool_known);
  CHECK(*cell->measurement.sigma_m == Approx(5e-5));
  CHECK(cell->measurement.reference_temperature_C == 22.0);

  REQUIRE(cell->sessions.size() == 2);
  CHECK(cell->sessions[0].id == "1");
  CHECK(cell->sessions[0].X_WB.p.isApprox(Vec3(0.001, 0.002, 0.003)));
  REQUIRE(cell->sessions[0].tips.size() == 1);
  CHECK(cell->sessions[0].tips[0].p_F.isApprox(Vec3(0, 0, 0.093)));
  CHECK(cell->sessions[1].X_WB.p == robot.X_WB.p);
  CHECK(cell->sessions[1].tips.empty());
  REQUIRE(cell->domain);
  CHECK(cell->domain->q[0].low == Approx(-kPi / 2));
  CHECK(cell->domain->q[1].high == Approx(0.5));
  CHECK(cell->domain->payload_kg->Hull() == model::Interval{0, 80});
  CHECK_FALSE(cell->domain->payload_kg->growth);
  CHECK(cell->domain->temp_C->Hull() == model::Interval{21, 37});
  CHECK_FALSE(cell->domain->t_s);
}

TEST_CASE("Each faulty field of a cell gives exactly one message") {
  const std::vector<WrongLine> cases = {
      {"[payload]\ncog_mm = [0.0, 40.0, 1300.0]", "[payloads]",
       "@46 payloads: unknown key; did you mean \"payload\"?"},
      // robot
      {"name = \"test arm\"", "name = 3", "robot.name: 3 is not a string in quotes"},
      {"name = \"test arm\"", "", "@3 robot.name: missing; expected a string in quotes"},
      {"convention = \"dh\"", "installed = \"2019-05-01\"\nconvention = \"dh\"",
       "robot.installed: \"2019-05-01\" is not a date without quotes, such as 2019-05-01"},
      {"convention = \"dh\"", "model = 210\nconvention = \"dh\"",
       "robot.model: 210 is not a string in quotes"},
      {"convention = \"dh\"", "convention = \"DH\"",
       "robot.convention: \"DH\" is not one of \"dh\", \"mdh\""},
      {"convention = \"dh\"", "", "@3 robot.convention: missing; expected one of \"dh\", \"mdh\""},
      {"gravity_m_s2 = [0.0, 0.0, -9.8]", "gravity_m_s2 = [0.0, 0.0, -98]",
       "robot.gravity_m_s2[3]: -98 is outside -20..20"},
      {"gravity_m_s2 = [0.0, 0.0, -9.8]", "gravity_m_s2 = [15.0, 15.0, -9.8]",
       "robot.gravity_m_s2: [15, 15, -9.8] has a magnitude above 20"},
      {"base_xyz_mm = [100.0, 200.0, 300.0]", "base_xyz_mm = [100.0, 200.0]",
       "robot.base_xyz_mm: [100, 200] is not a list of 3 numbers"},
      {"base_rpy_deg = [0.0, 0.0, 90.0]", "base_rpy_deg = [0.0, 0.0, 900.0]",
       "robot.base_rpy_deg[3]: 900 is outside -360..360"},
      {"base_rpy_deg = [0.0, 0.0, 90.0]", "base_rpy_rad = [0.0, 0.0, 0.0]",
       "robot.base_rpy_rad: unknown key; did you mean \"base_rpy_deg\"?"},
      // joints
      {"a_mm = 350.0", "a_mm = \"350\"", "robot.joint[1].a_mm: \"350\" is not a number"},
      {"a_mm = 350.0", "", "@9 robot.joint[1].a_mm: missing; expected a number, -100000..100000"},
      {"alpha_deg = -90.0", "alpha_deg = -900.0",
       "robot.joint[1].alpha_deg: -900 is outside -360..360"},
      {"d_mm = 675.0", "d_mm = nan", "robot.joint[1].d_mm: nan is not a finite number"},
      {"theta_offset_deg = 10.0", "theta_offset_deg = 361",
       "robot.joint[1].theta_offset_deg: 361 is outside -360..360"},
      {"theta_offset_deg = 10.0", "theta_offset = 10.0",
       "robot.joint[1].theta_offset: unknown key; did you mean \"theta_offset_deg\"?"},
      {"sign = -1", "sign = 0", "robot.joint[1].sign: 0 must be 1 or -1"},
      {"sign = -1", "sign = 2", "robot.joint[1].sign: 2 is outside -1..1"},
      {"min_deg = -150.0", "min_deg = -15000",
       "robot.joint[1].min_deg: -15000 is outside -7200..7200"},
      {"max_deg = 150.0", "max_deg = -160.0",
       "robot.joint[1].max_deg: -160 must be greater than min_deg"},
      {"link_mass_kg = 250.0", "link_mass_kg = -1",
       "robot.joint[1].link_mass_kg: -1 is outside 0..10000"},
      {"link_com_mm = [-200.0, 100.0, 0.0]", "link_com_mm = [1]",
       "robot.joint[1].link_com_mm: [1] is not a list of 3 numbers"},
      {"compliance_rad_per_Nm = 3.5e-7", "compliance_rad_per_Nm = -3.5e-7",
       "robot.joint[1].compliance_rad_per_Nm: -3.5e-07 is outside 0..0.1"},
      {"type = \"prismatic\"", "type = \"linear\"",
       "robot.joint[2].type: \"linear\" is not one of \"revolute\", \"prismatic\""},
      {"max_mm = 2000.0", "max_mm = -2000.0",
       "robot.joint[2].max_mm: -2000 must be greater than min_mm"},
      {"max_mm = 2000.0", "max_mm = 2000.0\ncompliance_rad_per_Nm = 1e-7",
       "@27 robot.joint[2].compliance_rad_per_Nm: 1e-07 does not apply to a prismatic joint; "
       "remove it and declare the compliance as an [[effect]] joint_compliance in m/N"},
      // tool
      {"model = \"euler_bernoulli\"", "model = \"bernoulli\"",
       "tool.model: \"bernoulli\" is not one of \"euler_bernoulli\", \"timoshenko\", \"rigid\""},
      {"model = \"euler_bernoulli\"", "",
       "@35 tool.model: missing; expected one of \"euler_bernoulli\", \"timoshenko\", \"rigid\""},
      {"axis = \"z\"", "axis = \"x\"", "tool.axis: \"x\" is not one of \"z\""},
      {"length_mm = 1200.0", "length_mm = 0", "tool.length_mm: 0 is outside 1..20000"},
      {"length_mm = 1200.0", "", "@35 tool.length_mm: missing; expected a number, 1..20000"},
      {"section = \"square_tube\"", "section = \"pipe\"",
       "tool.section: \"pipe\" is not one of \"rectangle\", \"square_tube\", \"tube\", \"rod\", "
       "\"i_beam\""},
      {"side_mm = 80.0", "side_mm = 0", "tool.side_mm: 0 is outside 0.01..10000"},
      {"wall_mm = 5.0", "wall_mm = 40.0", "tool.wall_mm: 40 is too thick: 80 mm of wall in 80 mm"},
      {"wall_mm = 5.0", "", "@35 tool.wall_mm: missing; expected a number, 0.01..10000"},
      {"youngs_modulus_GPa = 70.0", "youngs_modulus_GPa = 70000000000.0",
       "tool.youngs_modulus_GPa: 70000000000 is outside 0.001..2000"},
      {"youngs_modulus_GPa = 70.0", "",
       "@35 tool.youngs_modulus_GPa: missing; expected a number, 0.001..2000"},
      {"poisson_ratio = 0.33", "poisson_ratio = 0.6", "tool.poisson_ratio: 0.6 is outside 0..0.5"},
      {"density_kg_m3 = 2700.0", "density_kg_m3 = 270000",
       "tool.density_kg_m3: 270000 is outside 0..25000"},
      {"density_kg_m3 = 2700.0", "density_kg_m3 = 2700.0\nmaterial = \"cheese\"",
       "@45 tool.material: \"cheese\" is not a known material; give youngs_modulus_GPa, "
       "poisson_ratio and density_kg_m3 instead"},
      {"mount_mass_kg = 8.0", "mount_mass_kg = -8.0", "tool.mount_mass_kg: -8 is outside 0..5000"},
      // payload, measurement
      {"cog_mm = [0.0, 40.0, 1300.0]", "cog_mm = 40.0",
       "payload.cog_mm: 40 is not a list of 3 numbers"},
      {"kind = \"range\"", "kind = \"distance\"",
       "measurement.kind: \"distance\" is not one of \"position\", \"range\", \"pose\""},
      {"kind = \"range\"", "kind = \"pose\"",
       "@50 measurement.anchor_mm: [1000, 0, 0] is allowed with kind = \"range\" only"},
      {"anchor_mm = [1000.0, 0.0, 0.0]", "",
       "@48 measurement.anchor_mm: missing; expected 3 numbers, -100000..100000"},
      {"frame = \"unaligned\"", "frame = \"align\"",
       "measurement.frame: \"align\" is not one of \"aligned\", \"unaligned\""},
      {"frame = \"unaligned\"", "points = \"instrument\"",
       "measurement.points: \"instrument\" \"instrument\" is allowed with frame = \"unaligned\" "
       "only: an aligned instrument measures in the cell's frame"},
      {"tool = \"unknown\"", "tool = true",
       "measurement.tool: true is not one of \"known\", \"unknown\""},
      {"sigma_mm = 0.05", "sigma_mm = 0", "measurement.sigma_mm: 0 is outside 1e-06..100"},
      {"reference_temperature_C = 22.0", "reference_temperature_C = 295.15",
       "measurement.reference_temperature_C: 295.15 is outside -50..150"},
      {"reference_temperature_C = 22.0", "camera_xyz_mm = [0.0, 0.0, 0.0]",
       "measurement.camera_xyz_mm: [0, 0, 0] is not allowed with kind = \"range\": a camera "
       "measures no ranges"},
      {"reference_temperature_C = 22.0", "reference_sd_mm = 0.2",
       "measurement.reference_sd_mm: 0.2 needs reference_tags_mm, the places of the tags"},
      {"reference_temperature_C = 22.0",
       "reference_tags_mm = [[0, 0, 0], [100, 0, 0], [200, 0, 0]]\nreference_sd_mm = 0.2",
       "measurement.reference_tags_mm: [[0, 0, 0], [100, 0, 0], [200, 0, 0]] must hold the places "
       "[x, y, z] of at least three tags that are not on one line: fewer do not define a frame"},
      {"reference_temperature_C = 22.0",
       "reference_tags_mm = [[0.2, 0, 0], [1.5, 0, 0], [0, 0.9, 0.4]]\nreference_sd_mm = 0.2",
       "measurement.reference_tags_mm: [[0.2, 0, 0], [1.5, 0, 0], [0, 0.9, 0.4]] looks like "
       "metres: "
       "no tag is farther than 1.5 mm from the origin. Write mm (a factor of 1000)"},
      {"reference_temperature_C = 22.0",
       "reference_tags_mm = [[0, 0, 0], [100, 0, 0], [0, 100, 0]]",
       "@48 measurement.reference_sd_mm: missing; expected the standard deviation of each tag's "
       "place on one axis"},
      // sessions, domain
      {"id = \"2\"", "id = \"1\"", "session[2].id: \"1\" is used for two sessions"},
      {"id = \"2\"", "id = 2", "session[2].id: 2 is not a string in quotes"},
      {"tip_mm = [0.0, 0.0, 93.0]", "tip_mm = [0.0, 93.0]",
       "session[1].tip_mm: [0, 93] is not a list of 3 numbers"},
      {"q_deg = [[-90.0, 90.0], [0.0, 500.0], [-45.0, 45.0]]", "q_deg = [[-90.0, 90.0]]",
       "domain.q_deg: [[-90, 90]] is not a list of 3 lists of 2 numbers"},
      {"q_deg = [[-90.0, 90.0], [0.0, 500.0], [-45.0, 45.0]]",
       "q_deg = [[-90.0, 90.0], [0.0, 500.0], [45.0, -45.0]]",
       "domain.q_deg: [[-90, 90], [0, 500], [45, -45]] has the lower end of joint 3 above its "
       "upper end"},
      {"q_deg = [[-90.0, 90.0], [0.0, 500.0], [-45.0, 45.0]]", "",
       "@62 domain.q_deg: missing; expected one pair [low, high] per joint"},
      {"payload_kg = [0.0, 80.0]", "payload_kg = [80.0, 0.0]",
       "domain.payload_kg: [80, 0] is not an ascending list of pairs [low, high, low, high, ..]"},
      {"temp_C = [21.0, 37.0]", "temp_C = [21.0, 370.0]",
       "domain.temp_C[2]: 370 is outside -50..150"},
  };
  ExpectOneFaultEach(kGood, "cell.toml", cases, Reads);
}

TEST_CASE("Couplings of joints are read in SI; cycles and joints out of range are faults") {
  const auto with = [](const std::string& tables) {
    std::string text(kGood);
    text.insert(text.find("[tool]"), tables);
    return text;
  };
  const auto coupling = [](int joint, int of, const std::string& ratio) {
    return fmt::format("[[robot.coupling]]\njoint = {}\nof = {}\nratio = {}\n", joint, of, ratio);
  };
  FaultList faults;
  const auto cell =
      CellFromText(with(coupling(3, 1, "-1") + coupling(2, 1, "0.5")), "cell.toml", faults);
  CAPTURE(FaultsText(faults));
  REQUIRE(cell);
  REQUIRE(cell->robot.couplings.size() == 2);
  CHECK(cell->robot.couplings[0] == model::JointCoupling{2, 0, -1});
  CHECK(cell->robot.couplings[0].drive == model::CouplingDrive::kAxis);
  const auto driven =
      CellFromText(with(coupling(3, 1, "-1") + "drive = \"reading\"\n"), "cell.toml", faults);
  REQUIRE(driven);
  CHECK(driven->robot.couplings[0].drive == model::CouplingDrive::kReading);
  // 0.5 mm per degree
  CHECK(cell->robot.couplings[1].ratio == Approx(0.5e-3 / (kPi / 180)));

  const auto fault = [&](const std::string& tables) {
    FaultList own;
    CHECK_FALSE(CellFromText(with(tables), "cell.toml", own));
    const std::vector<std::string> texts = Texts(own, Fault::Severity::kFault);
    CAPTURE(FaultsText(own));
    REQUIRE(texts.size() == 1);
    return texts.front().substr(texts.front().find(' ') + 1);
  };
  CHECK(fault(coupling(3, 3, "1.0")) ==
        "robot.coupling[1].of: 3 is the joint itself; name the joint that it turns with");
  CHECK(fault(coupling(3, 2, "1.0") + coupling(2, 3, "1.0")) ==
        "robot.coupling[2].of: 3 is itself coupled to joint 2, so neither value follows from the "
        "other; remove one [[robot.coupling]]");
  CHECK(fault(coupling(3, 1, "1.0") + coupling(3, 1, "1.0")) ==
        "robot.coupling[2].of: 1 is named twice for joint 3; add the ratios up in one "
        "[[robot.coupling]]");
  CHECK(fault(coupling(4, 1, "1.0")) == "robot.coupling[1].joint: 4 is outside 1..3");
  CHECK(fault(coupling(3, 1, "0")) ==
        "robot.coupling[1].ratio: 0 couples nothing; remove this [[robot.coupling]]");
  CHECK(
      fault(coupling(2, 1, "1.0") + coupling(3, 2, "1.0") + "drive = \"reading\"\n") ==
      "robot.coupling[2].drive: \"reading\" differs from that of the coupling that joins the same "
      "three joints; write the same drive in both");
  CHECK(fault(coupling(3, 1, "nan")) == "robot.coupling[1].ratio: nan is not a finite number");
  CHECK(fault("[[robot.coupling]]\njoint = 3\nof = 1\n") ==
        "robot.coupling[1].ratio: missing; expected a number, -1000..1000");
}

TEST_CASE("tip_mm of a session belongs to a cell with one tool; declared_tip_mm to a tip_mm") {
  const auto fault = [](std::string text, const std::string& from, const std::string& to) {
    REQUIRE(text.find(from) != std::string::npos);
    text.replace(text.find(from), from.size(), to);
    FaultList own;
    CHECK_FALSE(CellFromText(text, "cell.toml", own));
    return FaultsText(own);
  };
  const std::string tip = "tip_mm = [0.0, 0.0, 93.0]";
  CHECK_THAT(fault(kGood, tip, "declared_" + tip),
             Catch::Contains("session[1].declared_tip_mm") && Catch::Contains("is missing"));
  std::string several = kGood;
  several.replace(several.find("[tool]"), 6, "[[tool]]\nnumber = 1");
  const std::size_t end = several.find("\n[", several.find("[[tool]]"));
  REQUIRE(end != std::string::npos);
  CHECK_THAT(fault(several, several.substr(end, 2),
                   "\n[[tool]]\nnumber = 2\nmodel = \"rigid\"\ntcp_mm = [0.0, 0.0, 1.0]\n\n["),
             Catch::Contains("session[1].tip_mm") && Catch::Contains("[[session.tip]]"));
}

TEST_CASE("beta_deg and gamma_deg complete a row of the table; gamma_deg is for dh only") {
  std::string text(kGood);
  const std::string key = "alpha_deg = -90.0\n";
  REQUIRE(text.find(key) != std::string::npos);
  text.insert(text.find(key) + key.size(), "beta_deg = 0.9\ngamma_deg = 30.0\n");
  FaultList faults;
  const auto cell = CellFromText(text, "cell.toml", faults);
  CAPTURE(FaultsText(faults));
  REQUIRE(cell);
  CHECK(cell->robot.joints[0].beta_rad == Approx(0.005 * kPi));
  CHECK(cell->robot.joints[0].gamma_rad == Approx(kPi / 6));
  CHECK(cell->robot.joints[1].beta_rad == 0);
  text.replace(text.find("\"dh\""), 4, "\"mdh\"");
  CHECK_FALSE(Reads(text, faults));
  CHECK_THAT(
      FaultsText(faults),
      Catch::Contains("robot.joint[1].gamma_deg: 30") &&
          Catch::Contains("is allowed with convention = \"dh\" only; add it to theta_offset"));
}

TEST_CASE("The schema must be 1 or 2") {
  for (const auto& [schema, fault] : std::vector<std::pair<std::string, std::string>>{
           {"schema = 3",
            "cell.toml:1 schema: 3 must be 1 or 2, the schemas that this version supports"},
           {"schema = \"1\"", "cell.toml:1 schema: \"1\" is not an integer"},
           {"", "cell.toml:1 schema: missing; expected an integer, 0..1000000"}}) {
    FaultList faults;
    CHECK_FALSE(Reads(schema + kGood.substr(kGood.find("\n[robot]")), faults));
    CHECK(Texts(faults, Fault::Severity::kFault) == std::vector<std::string>{fault});
  }
}

std::string WithArtefacts(const std::string& tables) {
  return "schema = 2" + kGood.substr(kGood.find("\n[robot]")) + tables;
}

TEST_CASE("Artefacts and known distances are read in SI") {
  FaultList faults;
  const auto cell = CellFromText(WithArtefacts(R"(
[[artefact]]
name = "front_0"
kind = "point"
xyz_mm = [500.0, 0.0, 20.0]
sd_mm = 0.1
frame = "base"
[[artefact]]
name = "front_1"
kind = "point"
frame = "base"
[[artefact]]
name = "table"
kind = "plane"
normal = [0.0, 0.0, 2.0]
[[artefact]]
name = "dial"
kind = "gauge"
direction = [0.0, -1.0, 0.0]
[[artefact]]
name = "ball"
kind = "sphere"
radius_mm = 25.0
[[distance]]
between = ["front_0", "front_1"]
value_mm = 50.0
sd_mm = 0.05
)"),
                                 "cell.toml", faults);
  CAPTURE(Texts(faults, Fault::Severity::kFault));
  REQUIRE(cell);
  REQUIRE(cell->artefacts.size() == 5);
  const model::Artefact& known = cell->artefacts[0];
  CHECK(known.name == "front_0");
  CHECK(known.place.value().isApprox(Vec3(0.5, 0, 0.02)));
  CHECK(known.sd_m == Approx(1e-4));
  CHECK(known.in_base);
  CHECK_FALSE(cell->artefacts[1].place);
  CHECK(cell->artefacts[2].kind == model::ArtefactKind::kPlane);
  CHECK(cell->artefacts[2].direction.value().isApprox(Vec3::UnitZ()));
  CHECK(cell->artefacts[3].direction.value().isApprox(-Vec3::UnitY()));
  CHECK(cell->artefacts[4].radius_m.value() == Approx(0.025));
  REQUIRE(cell->distances.size() == 1);
  CHECK(cell->distances[0].first == 0);
  CHECK(cell->distances[0].second == 1);
  CHECK(cell->distances[0].value_m == Approx(0.05));
  CHECK(cell->distances[0].sd_m == Approx(5e-5));
}

TEST_CASE("Each fault of an artefact or a distance has its line, value and remedy") {
  const std::string good =
      "[[artefact]]\nname = \"left\"\nkind = \"point\"\n[[artefact]]\n"
      "name = \"table\"\nkind = \"plane\"\nnormal = [0, 0, 1]\n";
  const auto fault_of = [&](const std::string& more) {
    FaultList faults;
    CHECK_FALSE(Reads(WithArtefacts(good + more), faults));
    const std::vector<std::string> texts = Texts(faults, Fault::Severity::kFault);
    REQUIRE(texts.size() == 1);
    return texts.front().substr(texts.front().find(' ') + 1);
  };
  CHECK(fault_of("[[artefact]]\nname = \"left\"\nkind = \"point\"\n") ==
        "artefact[3].name: \"left\" is used for two artefacts");
  CHECK(fault_of("[[artefact]]\nname = \"a\"\nkind = \"point\"\nradius_mm = 3\n") ==
        "artefact[3].radius_mm: 3 is allowed with kind = \"sphere\" only: remove it");
  CHECK(fault_of("[[artefact]]\nname = \"a\"\nkind = \"gauge\"\ndirection = [0, 0, 0]\n") ==
        "artefact[3].direction: [0, 0, 0] has no direction: its length is zero");
  CHECK(fault_of("[[distance]]\nbetween = [\"left\", \"lft\"]\nvalue_mm = 50\n") ==
        "distance[1].between: [\"left\", \"lft\"] names \"lft\", which is no [[artefact]]; did you "
        "mean left?");
  CHECK(fault_of("[[distance]]\nbetween = [\"left\", \"table\"]\nvalue_mm = 50\n") ==
        "distance[1].between: [\"left\", \"table\"] names \"table\", which is not of kind "
        "\"point\"");
}

TEST_CASE("An empty cell lacks its three required tables") {
  FaultList faults;
  CHECK_FALSE(Reads("#", faults));
  CHECK(Texts(faults, Fault::Severity::kFault) ==
        std::vector<std::string>{"cell.toml:1 schema: missing; expected an integer, 0..1000000",
                                 "cell.toml:1 robot: missing; expected the table [robot]",
                                 "cell.toml:1 tool: missing; expected the table [tool]"});
}

TEST_CASE("An arm has 1 to 12 joints") {
  const std::string head = "schema = 1\n[robot]\nname = \"n\"\nconvention = \"dh\"\n";
  const std::string joint = "[[robot.joint]]\na_mm = 0\nalpha_deg = 0\nd_mm = 0\n";
  const std::string tail = "[tool]\nmodel = \"rigid\"\ntcp_mm = [0, 0, 0]\n";
  auto fault = [&](int joints) {
    std::string text = head;
    for (int i = 0; i < joints; ++i) text += joint;
    FaultList faults;
    Reads(text + tail, faults);
    const auto texts = Texts(faults, Fault::Severity::kFault);
    return texts.empty() ? "" : texts[0];
  };
  CHECK(fault(0) ==
        "cell.toml:2 robot.joint: missing; expected one [[robot.joint]] for each joint");
  CHECK(fault(1).empty());
  CHECK(fault(12).empty());
  CHECK(fault(13) == "cell.toml:5 robot.joint: is given 13 times; at most 12 joints");
}

/// The good cell with another [tool].
std::string WithTool(const std::string& tool) {
  const std::size_t begin = kGood.find("[tool]");
  return kGood.substr(0, begin) + tool + kGood.substr(kGood.find("[payload]"));
}

TEST_CASE("Every section is read and reports missing keys") {
  const std::string head =
      "[tool]\nmodel = \"timoshenko\"\nlength_mm = 100\nmaterial = \"steel\"\n";
  const std::vector<std::pair<std::string, double>> good = {
      {"section = \"rectangle\"\nb_mm = 10\nh_mm = 20\n", 200e-6},
      {"section = \"tube\"\nouter_diameter_mm = 20\nwall_mm = 5\n", kPi * 75e-6},
      {"section = \"rod\"\ndiameter_mm = 20\n", kPi * 100e-6},
      {"section = \"i_beam\"\nheight_mm = 100\nwidth_mm = 50\nweb_mm = 5\nflange_mm = 10\n",
       1400e-6},
      {"area_mm2 = 123\nix_mm4 = 1000\niy_mm4 = 2000\n", 123e-6}};
  for (const auto& [section, area_m2] : good) {
    CAPTURE(section);
    FaultList faults;
    const auto cell = CellFromText(WithTool(head + section), "cell.toml", faults);
    CAPTURE(FaultsText(faults));
    REQUIRE(cell);
    CHECK(cell->tool.theory == model::BeamTheory::kTimoshenko);
    CHECK(cell->tool.segments[0].section.area_m2 == Approx(area_m2).epsilon(1e-3));
    CHECK(cell->tool.segments[0].material.youngs_modulus_Pa > 190e9);
  }
  const std::vector<std::pair<std::string, std::string>> bad = {
      {"section = \"rectangle\"\nb_mm = 10\n",
       "35 tool.h_mm: missing; expected a number, 0.01..10000"},
      {"section = \"tube\"\nouter_diameter_mm = 20\nwall_mm = 10\n",
       "41 tool.wall_mm: 10 is too thick: 20 mm of wall in 20 mm"},
      {"section = \"rod\"\nside_mm = 3\ndiameter_mm = 20\n", "40 tool.side_mm: unknown key"},
      {"section = \"i_beam\"\nheight_mm = 20\nwidth_mm = 50\nweb_mm = 5\nflange_mm = 10\n",
       "43 tool.flange_mm: 10 is too thick: 20 mm of wall in 20 mm"},
      {"section = \"i_beam\"\nheight_mm = 90\nwidth_mm = 50\nweb_mm = 50\nflange_mm = 10\n",
       "42 tool.web_mm: 50 is too thick: 50 mm of wall in 50 mm"},
      {"area_mm2 = 123\nix_mm4 = 1000\n",
       "35 tool.iy_mm4: missing; expected a number, 0.0001..1e+16"},
      {"",
       "35 tool.section: missing; expected the name of a section, or area_mm2, ix_mm4 and iy_mm4"}};
  for (const auto& [section, fault] : bad) {
    CAPTURE(section);
    FaultList faults;
    CHECK_FALSE(Reads(WithTool(head + section), faults));
    const auto texts = Texts(faults, Fault::Severity::kFault);
    REQUIRE_FALSE(texts.empty());
    CHECK(texts == std::vector<std::string>{"cell.toml:" + fault});
  }
}

TEST_CASE("A modulus or density that contradicts the named material is a warning") {
  const auto warnings = [](const std::string& keys) {
    FaultList faults;
    CHECK(CellFromText(
        WithTool("[tool]\nmodel = \"euler_bernoulli\"\nlength_mm = 1200\nsection = \"rod\"\n"
                 "diameter_mm = 100\nmaterial = \"steel\"\n" +
                 keys),
        "cell.toml", faults));
    return Texts(faults, Fault::Severity::kWarning);
  };
  const auto soft = warnings("youngs_modulus_GPa = 2\n");
  REQUIRE(soft.size() == 1);
  CHECK_THAT(soft[0], Catch::Contains("tool.youngs_modulus_GPa: warning: 2 contradicts material = "
                                      "\"steel\", which has 210; remove this key"));
  CHECK(warnings("youngs_modulus_GPa = 190\ndensity_kg_m3 = 8000\n").empty());
  CHECK(warnings("density_kg_m3 = 2700\n").size() == 1);
  const auto unit = warnings("density_kg_m3 = 7.85\n");
  REQUIRE(unit.size() == 1);
  CHECK_THAT(unit[0], Catch::Contains("looks like g/cm3"));
}

TEST_CASE("A link mass out of range is not called missing") {
  int line = 0;
  FaultList faults;
  CHECK_FALSE(CellFromText(WithLine(kGood, "link_mass_kg = 2.5", "link_mass_kg = -2.5", line),
                           "cell.toml", faults));
  CHECK(Texts(faults, Fault::Severity::kFault).size() == 1);
  CHECK(Texts(faults, Fault::Severity::kWarning).empty());
}

TEST_CASE("Values of a named material can be overridden") {
  FaultList faults;
  const auto cell = CellFromText(
      WithTool("[tool]\nmodel = \"euler_bernoulli\"\nlength_mm = 100\nsection = \"rod\"\n"
               "diameter_mm = 10\nmaterial = \"steel\"\nyoungs_modulus_GPa = 205\n"),
      "cell.toml", faults);
  REQUIRE(cell);
  const model::Material steel = *model::MaterialByName("steel");
  CHECK(cell->tool.segments[0].material.youngs_modulus_Pa == Approx(205e9));
  CHECK(cell->tool.segments[0].material.density_kg_m3 == steel.density_kg_m3);
}

TEST_CASE("A stepped tool has its segments in order; each is checked") {
  const std::string segment =
      "[[tool.segment]]\nlength_mm = 100\nsection = \"rod\"\n"
      "diameter_mm = 30\nmaterial = \"steel\"\n";
  const std::string second =
      "[[tool.segment]]\nlength_mm = 200\nsection = \"tube\"\n"
      "outer_diameter_mm = 20\nwall_mm = 2\nmaterial = \"steel\"\n";
  FaultList faults;
  const auto cell = CellFromText(
      WithTool("[tool]\nmodel = \"euler_bernoulli\"\n" + segment + second), "cell.toml", faults);
  CAPTURE(FaultsText(faults));
  REQUIRE(cell);
  REQUIRE(cell->tool.segments.size() == 2);
  CHECK(cell->tool.segments[0].length_m == Approx(0.1));
  CHECK(cell->tool.tcp_F.isApprox(Vec3(0, 0, 0.3)));

  FaultList both;
  CHECK_FALSE(
      Reads(WithTool("[tool]\nmodel = \"euler_bernoulli\"\nlength_mm = 5\n" + segment), both));
  CHECK(Texts(both, Fault::Severity::kFault) ==
        std::vector<std::string>{"cell.toml:37 tool.length_mm: 5 cannot be combined with "
                                 "[[tool.segment]]; give one or the other"});
}

TEST_CASE("Several tools and payload items have numbers of their own") {
  const auto with = [](const std::string& tool, const std::string& item) {
    std::string text = kGood;
    text.replace(text.find("[tool]"), 6, "[[tool]]\nnumber = 4");
    text.erase(text.find("tool = \"unknown\""), 16);
    text.erase(text.find("tip_mm = [0.0, 0.0, 93.0]"), 25);
    text += "[[tool]]\nmodel = \"rigid\"\ntcp_mm = [1, 2, 300]\n" + tool;
    return text + "[[payload.item]]\nnumber = 2\nmass_kg = 3\ncog_mm = [1, 2, 3]\n" + item;
  };
  const auto faults_of = [&](const std::string& tool, const std::string& item) {
    FaultList faults;
    CHECK_FALSE(CellFromText(with(tool, item), "cell.toml", faults));
    return FaultsText(faults);
  };
  FaultList faults;
  const auto cell = CellFromText(with("number = 0\n", ""), "cell.toml", faults);
  INFO(FaultsText(faults));
  REQUIRE(cell);
  CHECK(cell->tools() == 2);
  CHECK(cell->tool.number == 4);
  CHECK_FALSE(cell->tool.rigid);
  CHECK(cell->ToolAt(1).number == 0);
  CHECK(cell->ToolAt(1).tcp_F == Vec3(1e-3, 2e-3, 0.3));
  REQUIRE(cell->payload_items.size() == 1);
  CHECK(cell->payload_items[0].mass_kg == 3);
  CHECK(cell->payload_items[0].cog_F == Vec3(1e-3, 2e-3, 3e-3));

  CHECK_THAT(faults_of("", ""), Catch::Contains("tool[2].number: missing"));
  CHECK_THAT(faults_of("number = 4\n", ""),
             Catch::Contains("tool[2].number: 4 is already the number of the tool in line"));
  CHECK_THAT(faults_of("number = 70000\n", ""), Catch::Contains("70000 is outside 0..65535"));
  CHECK_THAT(faults_of("number = 1\n", "[[payload.item]]\nnumber = 2\nmass_kg = 1\n"),
             Catch::Contains("payload.item[2].number: 2 is already the number of the item") &&
                 Catch::Contains("payload.item[2].cog_mm: missing"));
  std::string unknown = with("number = 1\n", "");
  unknown.replace(unknown.find("[measurement]"), 13, "[measurement]\ntool = \"unknown\"");
  const auto with_tip = [&](const std::string& number, FaultList& found) {
    return CellFromText(unknown + "\n[[session]]\nid = \"third\"\n[[session.tip]]\ntool = " +
                            number + "\nxyz_mm = [1, 2, 3]\n",
                        "cell.toml", found);
  };
  FaultList of_unknown;
  const auto with_tips = with_tip("1", of_unknown);
  INFO(FaultsText(of_unknown));
  REQUIRE(with_tips);
  CHECK(with_tips->sessions.back().tips.front().tool == 1);
  CHECK_FALSE(with_tip("3", of_unknown));
  CHECK_THAT(FaultsText(of_unknown), Catch::Contains("is not the number of a [[tool]]"));
}

TEST_CASE("A rigid tool has a tip and no beam") {
  FaultList faults;
  const auto cell = CellFromText(WithTool("[tool]\nmodel = \"rigid\"\ntcp_mm = [10, 20, 30]\n"),
                                 "cell.toml", faults);
  REQUIRE(cell);
  CHECK(cell->tool.rigid);
  CHECK(cell->tool.tcp_F.isApprox(Vec3(0.01, 0.02, 0.03)));

  FaultList warned;
  CHECK(Reads(WithTool("[tool]\nmodel = \"rigid\"\ntcp_mm = [10, 20, 30]\nmount_mass_kg = 4\n"),
              warned));
  CHECK(FaultsText(warned) ==
        "cell.toml:38 tool.mount_mass_kg: warning: 4 acts at the flange, since a rigid tool has no "
        "length\n");

  FaultList wrong;
  CHECK_FALSE(Reads(WithTool("[tool]\nmodel = \"rigid\"\nlength_mm = 3\n"), wrong));
  CHECK(Texts(wrong, Fault::Severity::kFault) ==
        std::vector<std::string>{
            "cell.toml:35 tool.tcp_mm: missing; expected 3 numbers, -20000..20000",
            "cell.toml:37 tool.length_mm: unknown key"});
}

TEST_CASE("The daemon's configuration in place of a cell is recognised, and its cell is named") {
  FaultList faults;
  CHECK_FALSE(Reads("cell = \"cells/ur10.toml\"\n[robot]\nprofile = \"generic\"\n", faults));
  CHECK(
      FaultsText(faults) ==
      "cell.toml:1: is recognised as the configuration of a daemon (plumbline.toml) (cell = "
      "\"cells/ur10.toml\"), but a cell (cell.toml) is read here. Give the cell that it names.\n");
  FaultList without;
  CHECK_FALSE(Reads("[plc]\nport = 502\n", without));
  CHECK(without.All().size() == 1);
}

TEST_CASE("Each unknown quantity is a warning") {
  const std::vector<WrongLine> cases = {
      {"link_mass_kg = 2.5", "",
       "@19 robot.joint[1].compliance_rad_per_Nm: warning: 3.5e-07 cannot be used: link_mass_kg of "
       "joint 1 or of a later joint is missing, so the torque is unknown and every correction and "
       "prediction is refused"},
      {"link_com_mm = [4.0, 5.0, 6.0]", "",
       "@29 robot.joint[3].link_com_mm: warning: missing; the centre of mass of the link is "
       "assumed"},
      {"gravity_m_s2 = [0.0, 0.0, -9.8]", "",
       "@3 robot.gravity_m_s2: warning: missing; [0, 0, -9.80665] is assumed"},
      {"gravity_m_s2 = [0.0, 0.0, -9.8]", "gravity_m_s2 = [0, 0, 0]",
       "@6 robot.gravity_m_s2: warning: [0, 0, 0] is zero: no deflection by weight is computed"},
      {"[payload]\ncog_mm = [0.0, 40.0, 1300.0]", "",
       "@1 payload: warning: missing; payload masses cannot be used"},
  };
  for (const WrongLine& wrong : cases) {
    int line = 0;
    FaultList faults;
    CAPTURE(wrong.good, wrong.wrong);
    CHECK(Reads(WithLine(kGood, wrong.good, wrong.wrong, line), faults));
    CHECK(Texts(faults, Fault::Severity::kWarning) ==
          std::vector<std::string>{std::string("cell.toml:") + (wrong.fault + 1)});
  }
}

TEST_CASE("All faults of a cell are reported at once") {
  int line = 0;
  std::string text = WithLine(kGood, "sign = -1", "sign = 7", line);
  text = WithLine(text, "wall_mm = 5.0", "wall_mm = 500.0", line);
  text = WithLine(text, "kind = \"range\"", "kind = \"range\"\nsigma = 1", line);
  text = WithLine(text, "temp_C = [21.0, 37.0]", "temp_C = [nan, 37.0]", line);
  FaultList faults;
  CHECK_FALSE(Reads(text, faults));
  CHECK(FaultsText(faults) ==
        "cell.toml:14 robot.joint[1].sign: 7 is outside -1..1\n"
        "cell.toml:41 tool.wall_mm: 500 is too thick: 1000 mm of wall in 80 mm\n"
        "cell.toml:50 measurement.sigma: unknown key; did you mean \"sigma_mm\"?\n"
        "cell.toml:66 domain.temp_C[1]: nan is not a finite number\n");
}

std::string FingerprintOf(const std::string& text) {
  FaultList faults;
  const TomlDocument document(text, "cell.toml", faults);
  INFO(FaultsText(faults));
  REQUIRE(document.parsed());
  return ModelFingerprint(document);
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  INFO(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

TEST_CASE("An arm's model, series and installation date are labels") {
  const std::string labelled =
      Replaced(kGood, "name = \"test arm\"",
               "name = \"test arm\"\nmodel = \"KR 210\"\nseries = \"2\"\ninstalled = 2019-05-01");
  FaultList faults;
  const auto cell = CellFromText(labelled, "cell.toml", faults);
  CAPTURE(FaultsText(faults));
  REQUIRE(cell);
  CHECK(cell->robot.identity.model == "KR 210");
  CHECK(cell->robot.identity.series == "2");
  CHECK(cell->robot.identity.installed == "2019-05-01");
  CHECK(FingerprintOf(labelled) == FingerprintOf(kGood));
}

TEST_CASE("The fingerprint of a model is the same on every computer and in every version") {
  CHECK(FingerprintOf("schema = 1\n[robot]\nname = \"any\"\nconvention = \"dh\"\n"
                      "gravity_m_s2 = [-0.0, -9.81]\n") == "644b0b81167390cb");
}

TEST_CASE("distant_sigma_mm and poses_deg require each other") {
  const auto told = [](const std::string& text) {
    FaultList faults;
    CHECK_FALSE(CellFromText(kGood + text, "cell.toml", faults));
    return FaultsText(faults);
  };
  CHECK(told("distant_sigma_mm = 0.2\n").find("requires poses_deg") != std::string::npos);
  for (const char* key : {"reach_rad", "range_growth_mm", "declared_sigma_mm"}) {
    CHECK(told(std::string(key) + " = 0.2\n").find("requires distant_sigma_mm") !=
          std::string::npos);
  }
  CHECK(told("applied_share = 0.5\n").find("requires declared_sigma_mm") != std::string::npos);
  CHECK(told("poses_deg = [[1, 2, 3]]\n").find("requires distant_sigma_mm") != std::string::npos);
  CHECK(told("distant_sigma_mm = 0.2\nposes_deg = []\n").find("of 3 joints each") !=
        std::string::npos);
}

TEST_CASE("measured values of an input are ascending pairs, each with the growth of the error") {
  std::string text = Replaced(kGood, "payload_kg = [0.0, 80.0]",
                              "payload_kg = [0, 0, 5, 5, 20, 30]\npayload_growth_mm_per_kg = 0.02");
  text +=
      "temp_growth_mm_per_K = 0.01\nt_s = [0, 60, 3600, 7200]\ntime_growth_mm_per_h = 0.36\n"
      "torques_Nm = [[1, -20, 80, 0.002], [3, 0, 0, 0]]\n";
  FaultList faults;
  const auto cell = CellFromText(text, "cell.toml", faults);
  CAPTURE(FaultsText(faults));
  REQUIRE(cell);
  CHECK(faults.All().empty());
  const model::Domain& domain = *cell->domain;
  CHECK(domain.payload_kg->intervals == std::vector<model::Interval>{{0, 0}, {5, 5}, {20, 30}});
  CHECK(*domain.payload_kg->growth == Approx(2e-5));
  CHECK(domain.temp_C->intervals == std::vector<model::Interval>{{21, 37}});
  CHECK(*domain.temp_C->growth == Approx(1e-5));
  CHECK(domain.t_s->Hull() == model::Interval{0, 7200});
  CHECK(*domain.t_s->growth == Approx(1e-7));
  REQUIRE(domain.torques.size() == 2);
  CHECK(domain.torques[0].joint == 0);
  CHECK(domain.torques[0].range.intervals == std::vector<model::Interval>{{-20, 80}});
  CHECK(*domain.torques[0].range.growth == Approx(2e-6));
  CHECK(domain.torques[1].joint == 2);
  CHECK(*domain.torques[1].range.growth == 0);
}

TEST_CASE("measured values that are no ascending pairs, or a growth without them, are faults") {
  const auto told = [](const std::string& keys) {
    FaultList faults;
    CHECK_FALSE(Reads(kGood + keys + "\n", faults));
    return FaultsText(faults);
  };
  for (const char* values : {"[0]", "[0, 60, 90]", "[60, 0]", "[0, 60, 50, 90]"}) {
    CAPTURE(values);
    CHECK_THAT(told(std::string("t_s = ") + values),
               Catch::Contains("is not an ascending list of pairs [low, high, low, high, ..]"));
  }
  CHECK_THAT(told("time_growth_mm_per_h = 0.1"),
             Catch::Contains("domain.time_growth_mm_per_h: 0.1 requires t_s"));
  CHECK_THAT(told("payload_growth_mm_per_kg = -1"),
             Catch::Contains("domain.payload_growth_mm_per_kg: -1 is outside 0.."));
}

TEST_CASE("torques_Nm name joints of the arm once, with a range that includes zero") {
  const auto fault = [](const std::string& rows) {
    FaultList faults;
    CHECK_FALSE(Reads(kGood + "torques_Nm = " + rows + "\n", faults));
    return FaultsText(faults);
  };
  CHECK_THAT(fault("[[1, 0]]"), Catch::Contains("[joint, lowest torque, highest torque, growth]"));
  CHECK_THAT(fault("[[4, 0, 10, 1]]"), Catch::Contains("names joint 4; the joints are 1 to 3"));
  CHECK_THAT(fault("[[1.5, 0, 10]]"), Catch::Contains("names joint 1.5"));
  CHECK_THAT(fault("[[2, 10, 0]]"), Catch::Contains("range of joint 2 without 0"));
  CHECK_THAT(fault("[[2, 10, 50]]"), Catch::Contains("range of joint 2 without 0"));
  CHECK_THAT(fault("[[2, 0, 10], [2, 0, 5]]"), Catch::Contains("joint 2 twice"));
  // Without the last column, how the error grows is not known.
  FaultList faults;
  const auto cell = CellFromText(kGood + "torques_Nm = [[2, -5, 10]]\n", "cell.toml", faults);
  REQUIRE(cell);
  CHECK_FALSE(cell->domain->torques.at(0).range.growth);
}

TEST_CASE("what a domain of an earlier version states of loads is read, with a warning") {
  const auto read = [](const std::string& keys) {
    FaultList faults;
    const auto cell = CellFromText(kGood + keys + "\n", "cell.toml", faults);
    CAPTURE(FaultsText(faults));
    REQUIRE(cell);
    const auto warnings = Texts(faults, Fault::Severity::kWarning);
    REQUIRE(warnings.size() == 1);
    CHECK_THAT(warnings[0], Catch::Contains("is from an earlier version"));
    return *cell->domain;
  };
  const model::Domain torques = read("joint_loads_Nm = [[2, -5, 10]]");
  REQUIRE(torques.torques.size() == 1);
  CHECK(torques.torques[0].joint == 1);
  CHECK(torques.torques[0].range.Hull().low == Approx(-5.1));  // 2 % beyond were covered
  CHECK(torques.torques[0].range.Hull().high == Approx(10.2));
  CHECK_FALSE(torques.torques[0].range.growth);
  const model::Domain levels = read("payload_levels_kg = [80, 0]");
  CHECK_FALSE(levels.payload_kg->growth);
  CHECK(levels.payload_kg->Hull() == model::Interval{-4, 84});  // and 5 % of the loads
  CHECK(levels.payload_kg->intervals.size() == 2);              // no load between them
  CHECK(read("joint_combinations = [[1, 0, -1, -5, 5]]").torques.empty());
}

TEST_CASE("A fitted model keeps its validation through edits that change no value") {
  // [domain] is the last table of the text.
  const std::string good = kGood + "residual_sigma_mm = 0.05\n";
  const std::string fitted = good + "fingerprint = \"" + FingerprintOf(good) + "\"\n";
  const std::vector<std::string> texts = {
      fitted,
      "# mounted by the night shift\n\n" + fitted + "\n\n# the end",
      Replaced(fitted, "3.5e-7", "0.000_000_35"),
      Replaced(fitted, "a_mm = 350.0\nalpha_deg = -90.0", "alpha_deg = -90\na_mm = 350"),
      Replaced(fitted, "name = \"test arm\"", "name = \"our arm\""),
  };
  for (const std::string& text : texts) {
    CAPTURE(text);
    FaultList faults;
    const auto cell = CellFromText(text, "cell.toml", faults);
    INFO(FaultsText(faults));
    REQUIRE(cell);
    CHECK(cell->domain->as_validated);
    CHECK(FaultsText(faults).find("fingerprint") == std::string::npos);
  }
}

TEST_CASE("A model that was edited after it was fitted is no longer validated") {
  const std::string good = kGood + "residual_sigma_mm = 0.05\n";
  const std::string fingerprint = FingerprintOf(good);
  const std::string fitted = good + "fingerprint = \"" + fingerprint + "\"\n";
  const std::string damaged = (fingerprint[0] == '0' ? "1" : "0") + fingerprint.substr(1);
  const std::vector<std::string> texts = {
      Replaced(fitted, "wall_mm = 5.0", "wall_mm = 2.0"),
      Replaced(fitted, "compliance_rad_per_Nm = 3.5e-7", "compliance_rad_per_Nm = 7.0e-7"),
      Replaced(fitted, "residual_sigma_mm = 0.05", "residual_sigma_mm = 0.04"),
      Replaced(fitted, fingerprint, damaged),
  };
  for (const std::string& text : texts) {
    CAPTURE(text);
    FaultList faults;
    const auto cell = CellFromText(text, "cell.toml", faults);
    INFO(FaultsText(faults));
    REQUIRE(cell);
    CHECK_FALSE(cell->domain->as_validated);
    std::vector<Fault> found;
    for (const Fault& fault : faults.All()) {
      if (fault.key == kFingerprintKey) found.push_back(fault);
    }
    REQUIRE(found.size() == 1);
    CHECK(found[0].severity == Fault::Severity::kWarning);
    CHECK(found[0].file == "cell.toml");
    CHECK(found[0].line == std::count(text.begin(), text.end(), '\n'));
    CHECK_THAT(found[0].what,
               Catch::Contains("does not match: the model was edited after it was fitted") &&
                   Catch::Contains("counts as assumed") && Catch::Contains("Undo the edit"));
  }
}

TEST_CASE("A fitted model without a fingerprint is accepted") {
  FaultList faults;
  const auto cell =
      CellFromText(Replaced(kGood, "wall_mm = 5.0", "wall_mm = 2.0"), "cell.toml", faults);
  REQUIRE(cell);
  CHECK(cell->domain->as_validated);
  CHECK(FaultsText(faults).find("fingerprint") == std::string::npos);
}

TEST_CASE("A file that cannot be read is a fault") {
  FaultList faults;
  CHECK_FALSE(ReadCell("/nonexistent/cell.toml", faults));
  CHECK(FaultsText(faults) ==
        "/nonexistent/cell.toml: cannot be read: No such file or directory; there is no folder "
        "/nonexistent: check the path\n");
}

TEST_CASE("A value in range but probably unintended is a warning with a remedy") {
  const WrongLine cases[] = {
      {"gravity_m_s2 = [0.0, 0.0, -9.8]", "gravity_m_s2 = [0, 0, 9.8]",
       "robot.gravity_m_s2: warning: [0, 0, 9.8] points up"},
      {"gravity_m_s2 = [0.0, 0.0, -9.8]", "gravity_m_s2 = [0, 0, -1.62]",
       "robot.gravity_m_s2: warning: [0, 0, -1.62] has magnitude 1.62 m/s2"},
      {"alpha_deg = -90.0", "alpha_deg = -1.5708",
       "robot.joint[1].alpha_deg: warning: -1.5708 looks like radians; in degrees write -90"},
      {"theta_offset_deg = 10.0", "theta_offset_deg = 3.14",
       "robot.joint[1].theta_offset_deg: warning: 3.14 looks like radians; in degrees write 180"},
      {"density_kg_m3 = 2700.0", "density_kg_m3 = 2.7",
       "tool.density_kg_m3: warning: 2.7 looks like g/cm3; write 2700"},
      {"cog_mm = [0.0, 40.0, 1300.0]", "cog_mm = [0, 0.04, 0.3]",
       "payload.cog_mm: warning: [0, 0.04, 0.3] looks like metres"},
      {"cog_mm = [0.0, 40.0, 1300.0]", "cog_mm = [0, 0, 13000]",
       "payload.cog_mm: warning: [0, 0, 13000] is 13 m from the flange"},
      {"cog_mm = [0.0, 40.0, 1300.0]", "cog_mm = [0, 0, 0]",
       "payload.cog_mm: warning: [0, 0, 0] is at the flange, but the tool's tip is 1200 mm away; "
       "if the payload is at the tip, write about [0, 0, 1200]"},
  };
  for (const WrongLine& unlikely : cases) {
    int line = 0;
    const std::string text = WithLine(kGood, unlikely.good, unlikely.wrong, line);
    FaultList faults;
    CAPTURE(unlikely.wrong);
    CHECK(CellFromText(text, "cell.toml", faults));
    const auto warnings = Texts(faults, Fault::Severity::kWarning);
    REQUIRE(warnings.size() == 1);
    CHECK_THAT(warnings[0],
               Catch::StartsWith(fmt::format("cell.toml:{} {}", line, unlikely.fault)));
  }
}

TEST_CASE("An arm shorter than ten millimetres causes a warning about metres") {
  int line = 0;
  const std::string text = WithLine(WithLine(kGood, "a_mm = 350.0", "a_mm = 0.35", line),
                                    "d_mm = 675.0", "d_mm = 0.675", line);
  FaultList faults;
  CHECK(CellFromText(text, "cell.toml", faults));  // its third joint has d_mm = 6
  const auto warnings = Texts(faults, Fault::Severity::kWarning);
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0],
             Catch::Contains("robot.joint[3].d_mm: warning: 6 is the longest length of "
                             "the arm and looks like metres"));
}

TEST_CASE("A file that is clearly not a cell is reported as what it is") {
  const std::pair<const char*, const char*> cases[] = {
      {"", "cell.toml: is empty"},
      {" \n", "cell.toml: is empty"},
      {"schema = 1\nname = \"x\"\n[[joints]]\ntable = \"holding\"\n",
       "cell.toml:3: is recognised as a register profile"},
      {"cell = \"arm.toml\"\n", "cell.toml:1: is recognised as the configuration of a daemon"}};
  for (const auto& [text, told] : cases) {
    FaultList faults;
    CHECK_FALSE(CellFromText(text, "cell.toml", faults));
    CHECK(faults.All().size() == 1);
    CHECK_THAT(FaultsText(faults), Catch::StartsWith(told));
  }
}

}  // namespace
}  // namespace plumbline::cell_reader_test
