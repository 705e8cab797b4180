// Writer of the corrected cell: preservation of the original text, and exact read-back.
#include "app/measure/diagnosis/output/model_writer.h"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>

#include "app/base/config/cell_reader.h"
#include "drivers/files/text_file.h"
#include "firmware-like/deflection/landing_uncertainty.h"
#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/effects/catalogue.h"
#include "firmware-like/geometry/rotation.h"
#include "tests/app/measure/diagnosis/example_diagnosis.h"

namespace plumbline::model_writer_test {

using namespace plumbline::measure;

namespace {

const DataOrigin kOrigin{"measured.csv", 96, "2026-11-21"};

std::string CellText() {
  return files::ReadTextFile("config/cells/kr210.toml").value();
}

model::CellModel Read(const std::string& text) {
  config::FaultList faults;
  const auto cell = config::CellFromText(text, "cell.toml", faults);
  INFO(text << config::FaultsText(faults));
  REQUIRE(cell);
  return *cell;
}

std::string Corrected(const std::string& text, const Diagnosis& diagnosis) {
  const auto corrected = CorrectedCellText(text, Read(text), diagnosis, kOrigin);
  INFO((corrected ? "" : corrected.error()));
  REQUIRE(corrected.ok());
  return *corrected;
}

bool Same(double a, double b) {
  return std::abs(a - b) <= 1e-12 * std::abs(b);
}

void CheckSame(const model::MeasuredRange& read, const model::MeasuredRange& wanted) {
  REQUIRE(read.intervals.size() == wanted.intervals.size());
  for (std::size_t k = 0; k < read.intervals.size(); ++k) {
    CHECK(Same(read.intervals[k].low, wanted.intervals[k].low));
    CHECK(Same(read.intervals[k].high, wanted.intervals[k].high));
  }
  REQUIRE(read.growth.has_value() == wanted.growth.has_value());
  if (read.growth) CHECK(Same(*read.growth, *wanted.growth));
}

}  // namespace

TEST_CASE("effects, frames and domain read back within 1e-12") {
  Diagnosis diagnosis = test::ExampleDiagnosis(Verdict::kExplained);
  model::SessionFrames session;
  session.id = "shift \"2\"\\";
  session.X_WB.p = Vec3(0.123456789012345, -1.0 / 3, 2);
  session.X_WB.R = RotationFromRollPitchYaw(Vec3(0.1, -0.2, 3.0000000000001));
  session.tips = {{std::nullopt, Vec3(1.0 / 7, 0, 1e-9), Vec3(0.1, 0, 1.0 / 3)}};
  diagnosis.sessions = {session};
  diagnosis.domain.q[1] = {-1.0 / 3, 2.0 / 3};
  diagnosis.domain.largest_residual_m = 1e-3 / 3;
  diagnosis.domain.torques = {{1, {{{0, 1e3 / 3}}, 1e-6 / 3}}, {4, {{{-1.0 / 7, 0}}, 1e-5}}};
  diagnosis.domain.payload_kg = model::MeasuredRange{{{0, 0}, {20, 80}}, 1e-5 / 7};
  diagnosis.domain.t_s = model::MeasuredRange{{{0, 1e5 / 3}}, 1e-8 / 3};
  const std::string original = CellText();
  const std::string text = Corrected(original, diagnosis);
  CHECK(text.starts_with(original));
  const model::CellModel cell = Read(text);

  REQUIRE(cell.effects.size() == 2);
  for (std::size_t k = 0; k < 2; ++k) {
    const model::WrittenEffect wanted =
        effects::WrittenFromActive(diagnosis.findings[k].effect, diagnosis.findings[k].covariance);
    const model::WrittenEffect& read = cell.effects[k];
    CHECK(read.id == wanted.id);
    CHECK(read.scope == wanted.scope);
    REQUIRE(read.parameters.size() == wanted.parameters.size());
    for (std::size_t i = 0; i < read.parameters.size(); ++i) {
      CHECK(read.parameters[i].name == wanted.parameters[i].name);
      CHECK(read.parameters[i].unit == wanted.parameters[i].unit);
      CHECK(Same(read.parameters[i].value, wanted.parameters[i].value));
      CHECK(Same(*read.parameters[i].sd, *wanted.parameters[i].sd));
    }
    CHECK((read.covariance - wanted.covariance).norm() <= 1e-12 * wanted.covariance.norm());
    CHECK(read.from_file == "measured.csv");
    CHECK(read.from_rows == 96);
    CHECK(read.from_date == "2026-11-21");
  }
  REQUIRE(cell.sessions.size() == 1);
  CHECK(cell.sessions[0].id == session.id);
  CHECK((cell.sessions[0].X_WB.p - session.X_WB.p).norm() < 1e-14);
  CHECK((cell.sessions[0].X_WB.R - session.X_WB.R).norm() < 1e-12);
  REQUIRE(cell.sessions[0].tips.size() == 1);
  CHECK((cell.sessions[0].tips[0].p_F - session.tips[0].p_F).norm() < 1e-15);
  CHECK((*cell.sessions[0].tips[0].declared_F - *session.tips[0].declared_F).norm() < 1e-15);
  REQUIRE(cell.domain);
  for (std::size_t i = 0; i < 6; ++i) {
    CHECK(Same(cell.domain->q[i].low, diagnosis.domain.q[i].low));
    CHECK(Same(cell.domain->q[i].high, diagnosis.domain.q[i].high));
  }
  CHECK(Same(cell.domain->largest_residual_m.value(), 1e-3 / 3));
  REQUIRE(cell.domain->torques.size() == 2);
  for (std::size_t k = 0; k < 2; ++k) {
    CHECK(cell.domain->torques[k].joint == diagnosis.domain.torques[k].joint);
    CheckSame(cell.domain->torques[k].range, diagnosis.domain.torques[k].range);
  }
  CheckSame(cell.domain->payload_kg.value(), *diagnosis.domain.payload_kg);
  CheckSame(cell.domain->temp_C.value(), *diagnosis.domain.temp_C);  // without a growth
  CheckSame(cell.domain->t_s.value(), *diagnosis.domain.t_s);
}

TEST_CASE(
    "old frames and domain in the middle of the file are replaced, everything else is preserved") {
  std::string original = CellText();
  const std::string middle =
      "# frames of spring\n[[session]]  # first\nid = \"1\"\n# inside\ntip_mm = [0.0, 0.0, "
      "93.0]\n\n"
      "[ domain ]\nq_deg = [[-1, 1], [-2, 2],  # [not a header]\n  [-3, 3], [-4, 4],\n"
      "[-5, 5], [-6, 6]]\n# \"\"\"\npayload_kg = [0, 1]\n\n";
  const std::string tool_comment = "# The tool on the flange.";
  const auto at = original.find(tool_comment);
  REQUIRE(at != std::string::npos);
  original.insert(at, middle);
  original +=
      "\n[[effect]]\nid = \"joint_offset\"\nparameters = [{ name = \"q1\", value = 1e-4 }]\n";

  Diagnosis diagnosis = test::ExampleDiagnosis(Verdict::kExplained);
  diagnosis.sessions = {model::SessionFrames{"2", {}}};
  const std::string text = Corrected(original, diagnosis);
  const model::CellModel cell = Read(text);
  REQUIRE(cell.effects.size() == 3);
  CHECK(cell.effects[0].id == "joint_offset");
  REQUIRE(cell.sessions.size() == 1);
  CHECK(cell.sessions[0].id == "2");
  CHECK(cell.domain->payload_kg->Hull().high == 80);
  CHECK(text.find("93.0") == std::string::npos);
  CHECK(text.find("# frames of spring\n") != std::string::npos);
  CHECK(text.find(tool_comment) != std::string::npos);
  CHECK(text.find("[tool]") != std::string::npos);

  SECTION("and a second diagnosis adds to the first") {
    const model::CellModel again = Read(Corrected(text, diagnosis));
    CHECK(again.effects.size() == 5);
    CHECK(again.sessions.size() == 1);
  }
  SECTION("values that the diagnosis did not estimate are preserved") {
    const model::CellModel kept = Read(Corrected(original, Diagnosis{}));
    REQUIRE(kept.sessions.size() == 1);
    CHECK(kept.sessions[0].id == "1");
    CHECK(kept.domain->payload_kg->Hull().high == 1);
  }
}

TEST_CASE("frames, domain and effects given inline at the root are replaced, too") {
  const std::string inlined =
      "domain.q_deg = [[-1, 1], [-2, 2], [-3, 3], [-4, 4], [-5, 5], [-6, 6]]\n"
      "session = [ { id = \"1\" } ]\n"
      "\"effect\" = [ { id = \"joint_offset\", parameters = [\n"
      "  { name = \"q1\", value = 1e-4, sd = 1e-5, unit = \"rad\" } ] } ]\n";
  Diagnosis diagnosis = test::ExampleDiagnosis(Verdict::kExplained);
  diagnosis.sessions = {model::SessionFrames{"2", {}}};
  const model::CellModel cell = Read(Corrected(inlined + CellText(), diagnosis));
  REQUIRE(cell.effects.size() == 3);
  CHECK(cell.effects[0].id == "joint_offset");
  CHECK(cell.effects[0].parameters[0].value == 1e-4);
  CHECK(cell.sessions[0].id == "2");
  CHECK(cell.domain->q[5].high == Approx(1.5));
}

TEST_CASE("the range of a prismatic joint is written in mm") {
  std::string original = CellText();
  const std::string limits = "min_deg = -185.0\nmax_deg = 185.0\n";
  original.replace(original.find(limits), limits.size(), "type = \"prismatic\"\n");
  Diagnosis diagnosis;
  diagnosis.domain.q.assign(6, {-0.25, 1.75});
  const model::CellModel cell = Read(Corrected(original, diagnosis));
  CHECK(Same(cell.domain->q[0].low, -0.25));
  CHECK(Same(cell.domain->q[1].high, 1.75));
}

TEST_CASE("variants and empirical nodes read back") {
  Diagnosis diagnosis;
  Finding backlash;
  backlash.effect.term = {effects::FindEffect("backlash"), {{0, 2, 1}}, "move"};
  backlash.effect.values = {2e-4};
  Finding empirical;
  empirical.effect.term.effect = effects::FindEffect("empirical");
  empirical.effect.term.parameters = {{2, -1, 1}};
  empirical.effect.term.drivers = {"temp_C"};
  empirical.effect.term.nodes = (Eigen::MatrixXd(2, 2) << 5, -0.1, 7, 1.0 / 3).finished();
  empirical.effect.values = {1};
  diagnosis.findings = {backlash, empirical};
  const model::CellModel cell = Read(Corrected(CellText(), diagnosis));
  REQUIRE(cell.effects.size() == 2);
  CHECK(cell.effects[0].parameters[1].word == "move");
  CHECK(cell.effects[1].drivers == std::vector<std::string>{"temp_C"});
  CHECK(cell.effects[1].nodes == empirical.effect.term.nodes);
}

namespace {

struct ReadBack {
  model::CellModel cell;
  std::string messages;  ///< faults and warnings
  model::StatedRadius radius;
};

/// The model of a text, and its radius inside its domain.
ReadBack ReadWithRadius(const std::string& text) {
  config::FaultList faults;
  const auto cell = config::CellFromText(text, "corrected.toml", faults);
  INFO(text << config::FaultsText(faults));
  REQUIRE(cell);
  const deflection::LoadedArm arm(*cell);
  model::JointVector q(6);
  q << 0.2, -1.4, 1.7, 0.3, 0.6, -0.4;
  return {*cell, config::FaultsText(faults),
          deflection::LandingUncertainty(*cell, arm, {})
              .At(arm, q, deflection::LoadStatement::Stated({}), {}, false)};
}

std::string Edited(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

}  // namespace

TEST_CASE(
    "the radius of a written model is \"measured\", and \"assumed\" once the file is edited") {
  Diagnosis diagnosis;
  diagnosis.domain.q.assign(6, {-3, 3});
  diagnosis.domain.residual_sigma_m = 5e-5;
  const bool carriage_returns = GENERATE(false, true);
  std::string original;
  for (const char c : files::ReadTextFile("tests/virtual_cell/demo/cockpit-cell.toml").value()) {
    original += carriage_returns && c == '\n' ? std::string("\r\n") : std::string(1, c);
  }
  const std::string written = Corrected(original, diagnosis);
  CHECK(written.find("\nfingerprint = \"") != std::string::npos);

  const ReadBack validated = ReadWithRadius(written);
  CHECK(validated.cell.domain->as_validated);
  CHECK(validated.messages.find("fingerprint") == std::string::npos);
  CHECK(validated.radius.basis == model::RadiusBasis::kMeasured);

  for (const std::string& text :
       {Edited(written, "wall_mm = 5.0", "wall_mm = 2.0"),
        Edited(written, "compliance_rad_per_Nm = 3.0e-7", "compliance_rad_per_Nm = 6.0e-7"),
        Edited(written, "residual_sigma_mm = 0.05", "residual_sigma_mm = 0.01")}) {
    const ReadBack edited = ReadWithRadius(text);
    CHECK_FALSE(edited.cell.domain->as_validated);
    CHECK(edited.messages.find("the model was edited after it was fitted") != std::string::npos);
    CHECK(edited.radius.basis == model::RadiusBasis::kAssumed);
    CHECK(edited.radius.radius_m > validated.radius.radius_m);
    // After another diagnosis it is a validated model again.
    const ReadBack again = ReadWithRadius(Corrected(text, diagnosis));
    CHECK(again.cell.domain->as_validated);
    CHECK(again.radius.basis == model::RadiusBasis::kMeasured);
  }
}

TEST_CASE("the measured poses are written and are part of the fingerprint") {
  const std::string original =
      files::ReadTextFile("tests/virtual_cell/demo/cockpit-cell.toml").value();
  Diagnosis diagnosis;
  diagnosis.domain.q.assign(6, {-3, 3});
  diagnosis.domain.residual_sigma_m = 5e-5;
  diagnosis.domain.distant_sigma_m = 2e-4;
  model::JointVector q(6);
  q << 0.1, -0.2, 0.3, -0.4, 0.5, -0.6;
  diagnosis.domain.poses = {q, 2 * q};
  diagnosis.domain.reach_rad = 0.25;
  diagnosis.domain.covariance_share = 0.5;
  diagnosis.domain.declared_sigma_m = 7e-4;
  diagnosis.domain.applied_share = 0.75;
  diagnosis.domain.range_growth_m = 3e-4;
  const std::string written = Corrected(original, diagnosis);
  const model::Domain domain = *Read(written).domain;
  CHECK(domain.as_validated);
  CHECK(*domain.distant_sigma_m == Approx(2e-4));
  CHECK(domain.reach_rad == 0.25);
  CHECK(domain.covariance_share == 0.5);
  CHECK(*domain.declared_sigma_m == Approx(7e-4));
  CHECK(domain.applied_share == 0.75);
  CHECK(*domain.range_growth_m == Approx(3e-4));
  REQUIRE(domain.poses.size() == 2);
  CHECK((domain.poses[1] - 2 * q).norm() < 1e-4);
  CHECK_FALSE(Read(Edited(written, "distant_sigma_mm = 0.2", "distant_sigma_mm = 0.1"))
                  .domain->as_validated);
  CHECK_FALSE(Read(Edited(written, "11.459", "11.460")).domain->as_validated);
}

TEST_CASE("a written model with effects and frames reads back as validated") {
  Diagnosis diagnosis = test::ExampleDiagnosis(Verdict::kExplained);
  const Pose declared{RotationFromRollPitchYaw(Vec3(0.1, -0.2, 0.3)), Vec3(1, 2, 3)};
  diagnosis.sessions = {model::SessionFrames{
      "2", {}, {{std::nullopt, Vec3(0, 0, 0.2), Vec3(0.1, 0, 0.2)}}, declared}};
  const std::string written = Corrected(CellText(), diagnosis);
  const model::SessionFrames frames = Read(written).sessions.front();
  REQUIRE((frames.X_WB_declared && frames.tips.size() == 1 && frames.tips[0].declared_F));
  CHECK((frames.X_WB_declared->p - declared.p).norm() < 1e-12);
  CHECK((frames.X_WB_declared->R - declared.R).norm() < 1e-12);
  CHECK((*frames.tips[0].declared_F - Vec3(0.1, 0, 0.2)).norm() < 1e-12);
  CHECK(Read(written).domain->as_validated);
  CHECK(Read(Edited(written, "date = \"2026-11-21\"", "date = \"2026-11-22\""))
            .domain->as_validated);  // a label
  CHECK_FALSE(Read(Edited(written, "id = \"2\"", "id = \"3\"")).domain->as_validated);
}

TEST_CASE("a model that cannot be read back is refused") {
  Diagnosis diagnosis;
  diagnosis.domain.q.assign(2, {-1, 1});
  const auto corrected = CorrectedCellText(CellText(), Read(CellText()), diagnosis, kOrigin);
  REQUIRE_FALSE(corrected.ok());
  CHECK(corrected.error().find("domain") != std::string::npos);
}

TEST_CASE("carriage returns are preserved, and a missing newline at the end is added") {
  std::string original;
  for (const char c : CellText()) original += c == '\n' ? std::string("\r\n") : std::string(1, c);
  original.resize(original.size() - 2);
  const std::string text = Corrected(original, test::ExampleDiagnosis(Verdict::kExplained));
  CHECK(text.find("id = \"thermal_growth\"\r\n") != std::string::npos);
}

TEST_CASE("the concatenated statements of a text are the text") {
  const std::string text =
      "\xEF\xBB\xBF# a\na.b = \"\"\"x\n[c]\"\"\"\"\nd = '''\n[e] \\''' # '''\n[f.\"g\"] # [h]\n"
      "i = [ # ]\n '[', \"\\\"]\",\n]\n[['domain']]\nj = \"#\"";
  std::string joined;
  std::vector<std::string> headers;
  for (const TomlStatement& statement : TomlStatements(text)) {
    joined += statement.text;
    if (statement.kind == TomlStatement::Kind::kHeader) headers.push_back(statement.first_key);
  }
  CHECK(joined == text);
  CHECK(headers == std::vector<std::string>{"f", "domain"});
  CHECK(WithoutTable(text, "domain") == text.substr(0, text.find("[['domain']]")));
}

TEST_CASE("a text file is replaced atomically, through links, and only if permitted") {
  namespace fs = std::filesystem;
  const fs::path folder = fs::temp_directory_path() / ("plumbline-" + std::to_string(getpid()));
  fs::create_directories(folder);
  const std::string file = folder / "model.toml", link = folder / "link.toml";
  REQUIRE(files::WriteTextFile(file, "one"));
  fs::create_symlink(file, link);
  CHECK(files::CheckWritable(link));
  REQUIRE(files::WriteTextFile(link, "two"));
  CHECK(files::ReadTextFile(file).value() == "two");
  CHECK(fs::is_symlink(link));
  CHECK(std::distance(fs::directory_iterator(folder), fs::directory_iterator()) == 2);
  CHECK(files::WriteTextFile("/dev/null", "three"));
  CHECK(fs::is_character_file("/dev/null"));
  CHECK_FALSE(files::CheckWritable(folder / "absent" / "model.toml"));
  CHECK_FALSE(files::WriteTextFile(folder / "absent" / "model.toml", ""));
  CHECK_FALSE(files::CheckWritable(folder));
  fs::remove_all(folder);
}

}  // namespace plumbline::model_writer_test
