// Corrected programs against the simulator, which shares no model code with the product.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <numbers>

#include "app/base/config/cell_reader.h"
#include "app/programs/correction/comparison.h"
#include "app/programs/correction/point_text.h"
#include "app/programs/correction/postures.h"
#include "app/programs/correction/program_report.h"
#include "app/programs/correction/rewriting.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"
#include "tests/app/programs/toy_brand.h"
#include "tests/app/temporary_folder.h"
#include "tests/simulator/arm.h"

namespace plumbline::correction_test {

using namespace plumbline::programs;
using Catch::Contains;
using test::ToyBrand;

namespace {

constexpr double kPayload_kg = 40;
const simulator::Changes kUnchanged(6);

/// A heavy arm whose tool is a bending tube, in the simulator and as the product reads it.
struct Cells {
  simulator::Cell simulated = simulator::ReadyCell("kr210");
  model::CellModel cell;

  Cells() {
    simulated.sigma_m = 1e-4;
    const double limits_deg[6][2] = {{-185, 185}, {-140, -5},  {-120, 155},
                                     {-350, 350}, {-125, 125}, {-350, 350}};
    for (std::size_t i = 0; i < 6; ++i) {
      simulated.joints[i].min_rad = kRadPerDeg * limits_deg[i][0];
      simulated.joints[i].max_rad = kRadPerDeg * limits_deg[i][1];
    }
    const test::TemporaryFolder folder;
    const std::string path = folder.path() + "/cell.toml";
    simulator::WriteCell(simulated, path);
    config::FaultList faults;
    const auto read = config::ReadCell(path, faults);
    INFO(config::FaultsText(faults));
    REQUIRE(read);
    cell = deflection::CellOfPoints(*read);
  }
};

const Cells& TheCells() {
  static const Cells cells;
  return cells;
}

/// Tip and axes of the simulated arm, loaded or rigid and without gravity.
Pose Simulated(const model::JointVector& q, bool loaded) {
  simulator::Cell cell = TheCells().simulated;
  if (!loaded) cell.gravity_m_s2.setZero();
  simulator::Row row;
  row.q_rad = q;
  row.qd_rad_s = row.qdd_rad_s2 = row.last_move_rad = Eigen::VectorXd::Zero(q.size());
  row.payload_kg = loaded ? kPayload_kg : 0;
  row.temp_C = cell.reference_temperature_C;
  const simulator::Arm arm(cell, kUnchanged);
  return {arm.TipAxes(row), arm.Tip(row)};
}

model::JointVector Joints(std::initializer_list<double> degrees) {
  model::JointVector q(static_cast<int>(degrees.size()));
  int i = 0;
  for (const double degree : degrees) q[i++] = kRadPerDeg * degree;
  return q;
}

const model::JointVector kFirst = Joints({20, -70, 80, 10, 60, 30}),
                         kSecond = Joints({35, -60, 70, -20, 50, 10}),
                         kThird = Joints({-40, -80, 100, 30, 40, 60}),
                         kMiddle = Joints({27, -64, 74, -6, 56, 21});

/// Six numbers of the unloaded tip in a base, with many digits.
std::string PoseText(const model::JointVector& q, const Pose& X_WU = {}) {
  const Pose X = X_WU.Inverse() * Simulated(q, false);
  const Vec3 turn = kDegPerRad * VectorFromRotation(X.R);
  return fmt::format("{:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}", 1e3 * X.p.x(), 1e3 * X.p.y(),
                     1e3 * X.p.z(), turn.x(), turn.y(), turn.z());
}

/// A point with the posture of its joints.
std::string PointLine(const std::string& name, const model::JointVector& q, const Pose& X_WU = {}) {
  return fmt::format("point {} {} posture={}\n", name, PoseText(q, X_WU), ToyBrand::PostureText(q));
}

/// The tool of the cell, with a load that contains it.
std::string ToolLine(const std::string& name = "tube", double more_kg = kPayload_kg) {
  const simulator::Tool& tool = TheCells().simulated.tool;
  const double body_kg = tool.BodyMassKg(), all_kg = body_kg + tool.mount_mass_kg + more_kg;
  const Eigen::Vector3d cog_m =
      (more_kg * *TheCells().simulated.payload_cog_m +
       (body_kg + tool.mount_mass_kg) * Eigen::Vector3d(0, 0, tool.length_m / 2)) /
      all_kg;
  return fmt::format("tool {} 0 0 {} 0 0 0 {:.9f} {:.9f} {:.9f} {:.9f}\n", name,
                     1e3 * tool.length_m, all_kg, 1e3 * cog_m.x(), 1e3 * cog_m.y(),
                     1e3 * cog_m.z());
}

/// Digits that hide nothing.
const NumberStyle kFine{.least_significant = 12, .least_decimals = 9};

struct Corrected {
  Program program;
  ProgramCorrection correction;
  Result<Rewritten> rewritten{Error{""}};

  const PointCorrection& operator[](const std::string& name) const {
    for (const PointCorrection& point : correction.points) {
      if (program.points[point.point].name == name) return point;
    }
    FAIL("no point " << name);
    return correction.points.front();
  }
  const std::string& text() const { return rewritten->files.front().bytes; }
};

Corrected Correct(const std::string& text, const CorrectionSettings& settings = {},
                  const ToyBrand& brand = ToyBrand(kFine),
                  const std::optional<double>& insert_m = {}) {
  Corrected corrected;
  corrected.program = brand.Read({{"a.toy", text}}).program;
  ProgramCorrector corrector(brand, corrected.program, TheCells().cell, settings);
  corrected.correction = corrector.Correct();
  corrector.CheckSegments(insert_m, corrected.correction);
  corrected.rewritten = Rewrite(brand, corrected.program, corrected.correction,
                                {"0.1.0", "2026-11-29", "0123456789ab", ""});
  if (!corrected.rewritten) FAIL(corrected.rewritten.error());
  return corrected;
}

/// Asserts that the simulated arm, sent to the written pose, has its loaded tip at a target.
void CheckLanding(const PointCorrection& point, const Pose& X_WU, const Pose& X_WT,
                  double allowed_m = 1e-6, double allowed_rad = 1e-6) {
  INFO(point.reason);
  REQUIRE(point.reason.empty());
  const Pose command = X_WU * point.corrected, unloaded = Simulated(point.q_command, false),
             loaded = Simulated(point.q_command, true);
  CHECK((command.p - unloaded.p).norm() < allowed_m);
  CHECK(VectorFromRotation(command.R * unloaded.R.transpose()).norm() < allowed_rad);
  CHECK((loaded.p - X_WT.p).norm() < allowed_m);
  CHECK(VectorFromRotation(loaded.R * X_WT.R.transpose()).norm() < allowed_rad);
}

const std::string kStart = "sub main starts\nuse tube\n";

}  // namespace

TEST_CASE("the simulated loaded tip is at the taught pose after the correction") {
  const Corrected c = Correct(ToolLine() + PointLine("a", kFirst) + PointLine("b", kSecond) +
                              PointLine("c", kThird) + kStart + "J a\nL b\nC a c\nend\n");
  CheckLanding(c["a"], {}, Simulated(kFirst, false));
  CheckLanding(c["b"], {}, Simulated(kSecond, false));
  CheckLanding(c["c"], {}, Simulated(kThird, false));
  CHECK((c["a"].corrected.p - c["a"].taught.p).norm() > 5e-4);
  CHECK(c["a"].radius_m > 0);
  CHECK((c["a"].before_B - c["a"].target_B).norm() > 5e-4);
  CHECK((c["a"].after_B - c["a"].target_B).norm() < 1e-6);
}

TEST_CASE("a base turns the correction into its own frame") {
  const Pose X_WU{RotationFromVector(kRadPerDeg * Vec3(0, 0, 90)), Vec3(1, 0.2, -0.1)};
  const Corrected c = Correct(ToolLine() + "base table 1000 200 -100 0 0 90\n" +
                              PointLine("a", kFirst, X_WU) + kStart + "in table\nJ a\nend\n");
  CheckLanding(c["a"], X_WU, Simulated(kFirst, false));
}

TEST_CASE("another point on the tool is brought to its place by the bent tool") {
  // A tool point at 300 mm beside the tip, turned by 90 degrees.
  const Pose X_TP{RotationFromVector(kRadPerDeg * Vec3(0, 90, 0)), Vec3(0.3, 0, 0)};
  const simulator::Tool& tool = TheCells().simulated.tool;
  const Pose X = Simulated(kFirst, false) * X_TP;
  const Vec3 turn = kDegPerRad * VectorFromRotation(X.R);
  const std::string text = fmt::format(
      "tool side 300 0 {} 0 90 0\nload part 40\npoint a {:.9f} {:.9f} {:.9f} {:.9f} "
      "{:.9f} {:.9f} posture={}\nsub main starts\nuse side\ncarry part\nJ a\nend\n",
      1e3 * tool.length_m, 1e3 * X.p.x(), 1e3 * X.p.y(), 1e3 * X.p.z(), turn.x(), turn.y(),
      turn.z(), ToyBrand::PostureText(kFirst));
  CHECK_THAT(Correct(text)["a"].reason, Contains("the tip of no tool of the cell"));
  CorrectionSettings settings;
  settings.stated.tool_numbers["side"] = 1;
  settings.stated.payloads["part"] = {kPayload_kg, {}};
  const Corrected c = Correct(text, settings);
  INFO(c["a"].reason);
  REQUIRE(c["a"].reason.empty());
  const Pose landed = Simulated(c["a"].q_command, true) * X_TP,
             command = Simulated(c["a"].q_command, false) * X_TP;
  CHECK((landed.p - X.p).norm() < 1e-6);
  CHECK((command.p - c["a"].corrected.p).norm() < 1e-6);
}

TEST_CASE("loads without the tool are taken as they are, if the user says so") {
  const std::string text =
      "tool tube 0 0 " + fmt::format("{} 0 0 0\n", 1e3 * TheCells().simulated.tool.length_m) +
      "load small 0.5 0 0 100\n" + PointLine("a", kFirst) + kStart + "carry small\nJ a\nend\n";
  CHECK_THAT(Correct(text)["a"].reason, Contains("less than the tool of the cell"));
  CorrectionSettings settings;
  settings.stated.loads_without_tool = true;
  const Corrected c = Correct(text, settings);
  CHECK(c["a"].reason.empty());
  CHECK(c["a"].context.payload.mass_kg == Approx(0.5));
}

TEST_CASE("every point that is not corrected has one reason and a line") {
  const std::string text =
      ToolLine() + ToolLine("light", 0) + "load missing -\n" + PointLine("shared", kFirst) +
      PointLine("agreeing", kFirst) + PointLine("copied", kFirst) + PointLine("sought", kFirst) +
      PointLine("shifted", kFirst) + PointLine("moved", kFirst) + PointLine("heavy", kFirst) +
      PointLine("unused", kFirst) + PointLine("stated", kFirst) +
      fmt::format("point accurate {} accurate\npoint blank {} untaught\npoint railed {} ext 250\n",
                  PoseText(kFirst), PoseText(kFirst), PoseText(kFirst)) +
      "point partial 1 2 3 - 0 0\njoints home 0 -90 90 0 90 0\npoint away 9000 0 0 0 0 0\n" +
      fmt::format("point framed {} in table\nbase table 1 0 0 0 0 0\nbase floor 2 0 0 0 0 0\n",
                  PoseText(kFirst)) +
      kStart +
      "in none\ngrip none\nshift off\nJ shared\nJ agreeing\ntouch copied\nJ copied\nsearch "
      "sought\nshift on\nJ shifted\n"
      "shift off\nJ moved+?\nJ accurate\nJ blank\nJ railed\nJ partial\nJ home\nJ away\n"
      "in floor\nJ framed\nuse light\nin none\nJ shared\ngrip missing\nJ heavy\nend\n";
  const Corrected c = Correct(text);
  CHECK_THAT(c["shared"].reason, Contains("used with") && Contains("a.toy:"));
  CHECK(c["agreeing"].reason.empty());
  CHECK_THAT(c["copied"].reason, Contains("it is copied"));
  CHECK_THAT(c["sought"].reason, Contains("a search ends"));
  CHECK_THAT(c["shifted"].reason, Contains("a displacement is active"));
  CHECK_THAT(c["moved"].reason, Contains("the offset is computed"));
  CHECK_THAT(c["heavy"].reason, Contains("not entered"));
  CHECK(c["unused"].reason == "no motion uses it");
  CHECK_THAT(c["accurate"].reason, Contains("would double"));
  CHECK(c["blank"].reason == "untaught");
  CHECK_THAT(c["railed"].reason, Contains("external axis"));
  CHECK_THAT(c["partial"].reason, Contains("not all of its numbers"));
  CHECK_THAT(c["home"].reason, Contains("--joints"));
  CHECK_THAT(c["away"].reason, Contains("no posture"));
  CHECK_THAT(c["framed"].reason, Contains("taught in table, executed in floor"));
  for (const PointCorrection& point : c.correction.points) {
    CHECK((point.reason.empty() || point.reason_place.line > 0));
  }
}

TEST_CASE("keys with equal values agree") {
  const Corrected c = Correct(ToolLine() + ToolLine("twin") + PointLine("a", kFirst) + kStart +
                              "J a\nuse twin\nJ a\nend\n");
  CheckLanding(c["a"], {}, Simulated(kFirst, false));
}

TEST_CASE("with one offset, the point is corrected so that the offset target is right") {
  Pose X = Simulated(kFirst, false);
  const Pose target = X;
  X.p -= Vec3(0, 0, 0.05);  // the point is 50 mm below
  const Vec3 turn = kDegPerRad * VectorFromRotation(X.R);
  const std::string text = fmt::format(
      "{}point a {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} posture={}\n{}J a+base:0,0,50\nend\n",
      ToolLine(), 1e3 * X.p.x(), 1e3 * X.p.y(), 1e3 * X.p.z(), turn.x(), turn.y(), turn.z(),
      ToyBrand::PostureText(kFirst), kStart);
  const Corrected c = Correct(text);
  REQUIRE(c["a"].reason.empty());
  const Pose command{c["a"].corrected.R, c["a"].corrected.p + Vec3(0, 0, 0.05)};
  CHECK((command.p - Simulated(c["a"].q_command, false).p).norm() < 1e-6);
  CHECK((Simulated(c["a"].q_command, true).p - target.p).norm() < 1e-6);
}

TEST_CASE("several offsets share a correction only within the bound") {
  const std::string text = ToolLine() + PointLine("near", kFirst) + PointLine("far", kFirst) +
                           kStart + "J near\nJ near+base:0,0,5\nJ far\nJ far+tool:0,0,-400\nend\n";
  CorrectionSettings settings;
  settings.offset_bound_m = 5e-5;
  const Corrected c = Correct(text, settings);
  CHECK(c["near"].reason.empty());
  // The error is that of the use for which the common correction is worst.
  CHECK((c["near"].after_B - c["near"].target_B).norm() > 1e-7);
  CHECK_THAT(c["far"].reason, Contains("several offsets"));
}

TEST_CASE("joint targets are corrected on request") {
  std::string joints = "joints a";
  for (const double q : kFirst) joints += fmt::format(" {:.9f}", kDegPerRad * q);
  CorrectionSettings settings;
  settings.joints = true;
  const Corrected c = Correct(ToolLine() + joints + "\n" + kStart + "J a\nend\n", settings);
  CheckLanding(c["a"], {}, Simulated(kFirst, false));
}

TEST_CASE("points taught by hand under the same load stay where they are") {
  CorrectionSettings settings;
  settings.taught_under = StatedPayload{kPayload_kg, {}};
  const Corrected c =
      Correct(ToolLine() + PointLine("a", kFirst) + kStart + "J a\nend\n", settings);
  REQUIRE(c["a"].reason.empty());
  CHECK((c["a"].corrected.p - c["a"].taught.p).norm() < 1e-8);
  // Taught without a part, executed with one: the tool returns to where it was.
  settings.taught_under = StatedPayload{0, {}};
  const Corrected other =
      Correct(ToolLine() + PointLine("a", kFirst) + kStart + "J a\nend\n", settings);
  simulator::Row row;
  row.q_rad = kFirst;
  row.qd_rad_s = row.qdd_rad_s2 = row.last_move_rad = Eigen::VectorXd::Zero(6);
  row.temp_C = TheCells().simulated.reference_temperature_C;
  const Eigen::Vector3d where = simulator::Arm(TheCells().simulated, kUnchanged).Tip(row);
  CHECK((Simulated(other["a"].q_command, true).p - where).norm() < 1e-6);
}

TEST_CASE("the path between points taught under a load is the one that the load made") {
  const std::string text =
      ToolLine() + PointLine("a", kFirst) + PointLine("b", kSecond) + kStart + "J a\nL b\nend\n";
  CorrectionSettings settings;
  settings.taught_under = StatedPayload{kPayload_kg, {}};
  const Corrected c = Correct(text, settings);
  REQUIRE(c.correction.segments.size() == 1);
  CHECK(c.correction.segments.front().ends_m < 1e-6);
  CHECK(c["a"].translation_B.norm() < 1e-8);
  const double bound_m = c.correction.segments.front().largest_m / 3;
  const SegmentDeviation refined =
      Correct(text, settings, ToyBrand(kFine), bound_m).correction.segments.front();
  CHECK(refined.inserted > 0);
  CHECK(refined.largest_m <= bound_m);
}

TEST_CASE("a load that is set replaces the one that the tool is declared with") {
  std::string whole = ToolLine("whole");
  whole.replace(0, whole.rfind(" 0 0 0 ") + 6, "load whole");
  const Corrected c =
      Correct(ToolLine() + whole + PointLine("a", kFirst) + kStart + "carry whole\nJ a\nend\n");
  INFO(whole << c["a"].reason);
  CHECK(c["a"].context.payload.mass_kg == Approx(kPayload_kg));
}

TEST_CASE("an auxiliary point without an orientation has that of the end") {
  const std::string pose = PoseText(kMiddle);
  std::size_t third = 0;
  for (int k = 0; k < 3; ++k) third = pose.find(' ', third + 1);
  const std::string text = ToolLine() + PointLine("a", kFirst) + PointLine("b", kSecond) +
                           "point v " + pose.substr(0, third) + " - - -\n" + kStart;
  const Corrected c = Correct(text + "J a\nC v b\nend\n");
  INFO(c["v"].reason);
  REQUIRE(c["v"].reason.empty());
  CHECK(c["v"].edits.size() == 3);
  CHECK((c["v"].after_B - c["v"].target_B).norm() < 1e-6);
  CHECK_THAT(Correct(text + "J a\nC v b\nL v\nend\n")["v"].reason,
             Contains("not all of its numbers"));
}

TEST_CASE("an arc is corrected as a whole or not at all") {
  const std::string text = ToolLine() + PointLine("a", kFirst) + PointLine("v", kMiddle) +
                           PointLine("b", kSecond) + kStart;
  CHECK_THAT(Correct(text + "J a\nC computed b\nend\n")["b"].reason,
             Contains("corrected together, and the computed"));
  const Corrected copied = Correct(text + "touch b\nJ a\nC v b\nend\n");
  CHECK_THAT(copied["v"].reason, Contains("corrected together, and b stays"));
  CHECK(copied["v"].reason_place.line == 9);
  CHECK(copied["a"].reason.empty());
  CHECK_THAT(copied["a"].notes.front(), Contains("corrected at one end only"));
}

TEST_CASE("a linear or circular motion keeps its posture, whatever the point states") {
  const correction::Corrector corrector(TheCells().cell, {});
  const Pose X_BP = TheCells().cell.robot.X_WB.Inverse() * Simulated(kSecond, false);
  std::string other;
  for (const model::JointVector& q : PosturesOf(corrector, {X_BP, Vec3::Zero(), 0})) {
    const std::string posture = ToyBrand::PostureText(q);
    if (posture != ToyBrand::PostureText(kSecond)) other = posture;
  }
  REQUIRE_FALSE(other.empty());
  const std::string text = ToolLine() + PointLine("a", kFirst) + PointLine("v", kMiddle) +
                           fmt::format("point b {} posture={}\n", PoseText(kSecond), other) +
                           kStart;
  CHECK_THAT(Correct(text + "J a\nC v b\nend\n")["b"].reason, Contains("states another posture"));
  // Linear motions of this language do not obey it: what it states is left alone.
  const Corrected linear = Correct(text + "J a\nL b\nend\n");
  CheckLanding(linear["b"], {}, Simulated(kSecond, false));
  CHECK_THAT(linear.text(), Contains("posture=" + other));
}

TEST_CASE("a long linear motion is followed from its start") {
  const model::JointVector far = Joints({95, -60, 70, 10, 60, 30});
  const std::string text = ToolLine() + PointLine("a", kFirst) +
                           fmt::format("point b {}\n", PoseText(far)) + kStart + "J a\nL b\nend\n";
  CheckLanding(Correct(text)["b"], {}, Simulated(far, false));
}

TEST_CASE("without a stated posture, it is that of the motion before") {
  const std::string text =
      ToolLine() + PointLine("a", kFirst) + fmt::format("point b {}\n", PoseText(kSecond)) + kStart;
  CheckLanding(Correct(text + "J a\nL b\nend\n")["b"], {}, Simulated(kSecond, false));
  CHECK_THAT(Correct(text + "L b\nend\n")["b"].reason,
             Contains("the posture is not known") && Contains("main is started"));
  CHECK_THAT(Correct(text + "J a\nwait\nL b\nend\n")["b"].reason,
             Contains("the posture is not known"));
}

TEST_CASE("the joints where the program is started tell the posture of its first motion") {
  CorrectionSettings settings;
  settings.start_q = kFirst;
  const std::string text =
      ToolLine() + fmt::format("point b {}\n", PoseText(kSecond)) + kStart + "L b\nend\n";
  CheckLanding(Correct(text, settings)["b"], {}, Simulated(kSecond, false));
}

TEST_CASE("where paths meet, the posture is known if all of them lead to the same one") {
  const std::string points =
      ToolLine() + PointLine("a", kFirst) + fmt::format("point b {}\n", PoseText(kSecond));
  const std::string loop = kStart + "J a\nlabel again\nL b\nbranch again\nend\n";
  CheckLanding(Correct(points + loop)["b"], {}, Simulated(kSecond, false));
  // From another branch of the wrist, the same line ends in that one.
  model::JointVector other = kFirst;
  other[3] += std::numbers::pi;
  other[4] = -other[4];
  other[5] -= std::numbers::pi;
  const std::string either =
      PointLine("c", other) + kStart + "branch x\nJ a\njump y\nlabel x\nJ c\nlabel y\nL b\nend\n";
  CHECK_THAT(Correct(points + either)["b"].reason, Contains("end in several postures"));
}

TEST_CASE("a stated posture that no solution has is a reason") {
  const Corrected c =
      Correct(ToolLine() + fmt::format("point a {} posture=------\n", PoseText(kFirst)) + kStart +
              "J a\nend\n");
  CHECK_THAT(c["a"].reason,
             Contains("has the stated configuration") && Contains("main is started"));
}

TEST_CASE("only digits of corrected points change, and a comment is added") {
  const std::string before = "# a comment\xE9\r\n" + ToolLine() + PointLine("a", kFirst) +
                             PointLine("unused", kSecond) + kStart + "J a\nend\n";
  const Corrected c = Correct(before);
  const ToyBrand brand(kFine);
  const Program after = brand.Read(c.rewritten->files).program;
  CHECK(c.rewritten->files.front().bytes != before);
  CHECK_FALSE(after.marks.front().empty());
  const ProgramComparison comparison = Compare(brand, c.program, after);
  REQUIRE(comparison.points.size() == 1);
  CHECK(comparison.points.front().name == "a");
  CHECK(comparison.points.front().distance_m > 5e-4);
  CHECK(comparison.others.empty());
}

TEST_CASE("the comparison names bytes beside the numbers") {
  const ToyBrand brand;
  const Program one = brand.Read({{"a.toy", "# x\npoint a 1 2 3 0 0 0\n"}}).program,
                other = brand.Read({{"a.toy", "# y\npoint a 1 2.5 3 0 0 0\n"}}).program;
  const ProgramComparison comparison = Compare(brand, one, other);
  REQUIRE(comparison.others.size() == 1);
  CHECK(comparison.others.front().line == 1);
  REQUIRE(comparison.points.size() == 1);
  CHECK(comparison.points.front().distance_m == Approx(5e-4));
}

TEST_CASE("nothing to correct leaves the file as it is, byte for byte") {
  model::CellModel rigid = TheCells().cell;
  rigid.tool.rigid = true;
  for (model::Joint& joint : rigid.robot.joints) joint.compliance_rad_per_Nm.reset();
  const std::string text = ToolLine() + PointLine("a", kFirst) + kStart + "J a\nend\n";
  const ToyBrand brand(kFine);
  const Program program = brand.Read({{"a.toy", text}}).program;
  CorrectionSettings settings;
  settings.stated.loads_without_tool = true;
  ProgramCorrector corrector(brand, program, rigid, settings);
  const ProgramCorrection correction = corrector.Correct();
  INFO(correction.points.front().reason);
  REQUIRE(correction.points.front().reason.empty());
  const auto rewritten = Rewrite(brand, program, correction, {});
  REQUIRE(rewritten);
  CHECK(rewritten->files.front().bytes == text);
  CHECK_FALSE(rewritten->changed.front());
}

TEST_CASE("a corrected file is recognised, and so is one that was edited since") {
  const std::string text = ToolLine() + PointLine("a", kFirst) + kStart + "J a\nend\n";
  for (const bool comments : {true, false}) {
    const ToyBrand brand(kFine, comments);
    const Corrected c = Correct(text, {}, brand);
    const std::string record =
        RecordOf(c.program, 0, c.correction, c.rewritten->marks.front(), "a.toy", c.text()).dump();
    CHECK(StateOf(c.program, 0, "") == FileState::kOriginal);
    const Program after = brand.Read(c.rewritten->files).program;
    CHECK(StateOf(after, 0, record) == FileState::kCorrected);
    std::string edited = c.text();
    const std::size_t digit = edited.find("point a ") + 8;
    edited[digit] = edited[digit] == '1' ? '2' : '1';
    const Program changed = brand.Read({{"a.toy", edited}}).program;
    CHECK(StateOf(changed, 0, record) == FileState::kEdited);
  }
}

TEST_CASE("the path between points is checked, and refined on request") {
  const std::string text =
      ToolLine() + PointLine("a", kFirst) + PointLine("b", kSecond) + kStart + "J a\nL b\nend\n";
  const Corrected c = Correct(text);
  REQUIRE(c.correction.segments.size() == 1);
  const SegmentDeviation& before = c.correction.segments.front();
  CHECK(before.ends_m < 1e-6);
  CHECK(before.largest_m > before.ends_m);
  const double bound_m = before.largest_m / 3;
  const Corrected refined = Correct(text, {}, ToyBrand(kFine), bound_m);
  const SegmentDeviation& after = refined.correction.segments.front();
  CHECK(after.inserted > 0);
  CHECK(after.largest_m <= bound_m);
  CHECK(std::ranges::count(refined.text(), '\n') ==
        std::ranges::count(text, '\n') + after.inserted + 1);
}

TEST_CASE("the report counts and lists every point") {
  const Corrected c = Correct(ToolLine() + PointLine("a", kFirst) + PointLine("b", kSecond) +
                              kStart + "J a\nsearch b\nend\n");
  const ToyBrand brand(kFine);
  const ReportInput input{brand,           c.program,   {},      c.correction,
                          TheCells().cell, "cell.toml", "0.1.0", "2026-11-29"};
  const ReportCounts counts = CountsOf(input);
  CHECK(counts.corrected == 1);
  CHECK(counts.left == 1);
  CHECK_THAT(ReportText(input, true), Contains("a.toy:7: b stays as it is: a search"));
  CHECK_THAT(ReportPage(input), Contains("<svg") && Contains("a search ends"));
  CHECK(ReportJson(input)["left"].size() == 1);
}

TEST_CASE("all postures of a pose are found, whole turns included") {
  const correction::Corrector corrector(TheCells().cell, {});
  const Pose X_BP = TheCells().cell.robot.X_WB.Inverse() * Simulated(kFirst, false);
  const auto postures = PosturesOf(corrector, {X_BP, Vec3::Zero(), 0});
  std::size_t whole_turns = 0;
  for (const model::JointVector& q : postures) {
    CHECK((corrector.arm().UnloadedTip(q).p - X_BP.p).norm() < 1e-7);
    model::JointVector difference = q - kFirst;
    for (double& one : difference) one -= 2 * M_PI * std::round(one / (2 * M_PI));
    whole_turns += difference.norm() < 1e-6 ? 1 : 0;
  }
  CHECK(postures.size() >= 4);
  CHECK(whole_turns == 4);  // axes 4 and 6 turn by 700 degrees
}

TEST_CASE("an unknown posture stays unknown, and a known one is found after it") {
  const correction::Corrector corrector(TheCells().cell, {});
  PostureSearch search(corrector);
  PostureQuestion question;
  question.no_seed = "main is started";
  for (const model::JointVector& q : {kFirst, kSecond, kThird}) {
    question.target = {TheCells().cell.robot.X_WB.Inverse() * Simulated(q, false), Vec3::Zero(), 0};
    const Result<model::JointVector> unknown = search.Choose(question);
    REQUIRE_FALSE(unknown);
    CHECK_THAT(unknown.error(), Contains("the point states none") && Contains("main is started"));
  }
  question.states = true;
  question.agrees = [](const model::JointVector& q) { return (q - kThird).norm() < 1e-3; };
  const Result<model::JointVector> known = search.Choose(question);
  REQUIRE(known);
  CHECK((*known - kThird).norm() < 1e-6);
}

}  // namespace plumbline::correction_test
