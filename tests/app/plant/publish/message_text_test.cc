#include "app/plant/publish/message_text.h"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <fstream>
#include <random>

#include "app/base/text/json_text.h"
#include "app/cell/journal/journal.h"
#include "app/cell/journal/journal_csv.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/model/joint_columns.h"
#include "tests/app/temporary_folder.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::message_text_test {

using namespace plumbline::plant;
using test::TemporaryFolder;

namespace {

/// Rows as the daemon writes them: by a PLC, by cameras, by a dial gauge, with a range only.
std::vector<cell::JournalRow> VariedRows(int count, const std::vector<model::Joint>& joints) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const auto vector = [&](double scale) {
    model::JointVector values(static_cast<Eigen::Index>(joints.size()));
    for (double& value : values) value = scale * normal(random);
    return values;
  };
  const auto point = [&] { return Vec3(normal(random), normal(random), normal(random)); };
  std::vector<cell::JournalRow> rows;
  for (int k = 0; k < count; ++k) {
    cell::JournalRow& row = rows.emplace_back();
    row.unix_ms = 1800000000000 + k;
    row.session = k % 2 == 0 ? "7" : "8";
    row.t_s = 1e3 * k + 1e-3 * normal(random);
    row.q = vector(1);
    row.q[0] = -1e-12;  // "-0.0000000" in the table
    row.tau = vector(500);
    row.predicted_W = point();
    row.predicted_radius_m = std::abs(1e-3 * normal(random));
    row.model_version = 3;
    row.payload_kg = 60 + normal(random);
    row.temp_C = 20 + normal(random);
    row.q_step_rad = 1e-5;
    row.tool_number = k % 3 + 1;
    if (k % 3 == 0) row.payload_item = k;
    if (k % 10 == 0) {
      row.source = cell::JournalRow::Source::kGauge;
      row.artefact = "dial";
      row.gauge_m = 1e-3 * normal(random);
      row.sigma_m = 1e-6;
      continue;
    }
    if (k % 10 == 1) {
      row.artefact = "anchor";
      row.range_m = 2 + 0.1 * normal(random);
      continue;
    }
    row.measured_W = *row.predicted_W + 1e-3 * point();
    if (k % 10 == 3) row.orientation_W = Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5);
    if (k % 10 == 2) {
      row.source = cell::JournalRow::Source::kCamera;
      row.covariance_W = Mat3(1e-9 * Mat3::Identity());
      row.camera = "side+rear";
    }
  }
  return rows;
}

/// A row from a message, as a consumer understands docs/run.md.
cell::JournalRow RowFromMessage(const std::string& body, const std::vector<model::Joint>& joints) {
  const nlohmann::json json = text::JsonOrNull(body);
  REQUIRE(json.is_object());
  cell::JournalRow row;
  const auto number = [&json](const char* name, double unit) -> std::optional<double> {
    const auto found = json.find(name);
    if (found == json.end() || found->is_null()) return std::nullopt;
    return found->get<double>() * unit;
  };
  const auto joint_values = [&](const char* name, model::JointQuantity quantity) {
    model::JointVector values;
    const auto found = json.find(name);
    if (found == json.end()) return values;
    values.resize(static_cast<Eigen::Index>(joints.size()));
    for (std::size_t i = 0; i < joints.size(); ++i) {
      values[static_cast<Eigen::Index>(i)] =
          found->at(i).get<double>() * model::FormOf(quantity, joints[i].type).to_SI;
    }
    return values;
  };
  const auto integer = [&json](const char* name) -> std::optional<int> {
    return json.contains(name) ? std::optional(json.at(name).get<int>()) : std::nullopt;
  };
  row.id = json.at("id");
  row.source = cell::SourceNamed(json.at("source").get<std::string>());
  row.session = json.at("session");
  row.t_s = number("t_s", 1);
  row.q = joint_values("q", model::JointQuantity::kPosition);
  row.qd = joint_values("qd", model::JointQuantity::kVelocity);
  row.qdd = joint_values("qdd", model::JointQuantity::kAcceleration);
  row.tau = joint_values("tau", model::JointQuantity::kTorque);
  row.payload_kg = number("payload_kg", 1);
  row.temp_C = number("temp_C", 1);
  row.q_step_rad = number("q_step_deg", kRadPerDeg);
  row.tool_number = integer("tool");
  row.payload_item = integer("payload_item");
  if (const auto& measured = json.at("measured_mm"); !measured.is_null()) {
    row.measured_W = kMetrePerMm * Vec3(measured[0], measured[1], measured[2]);
  }
  row.range_m = number("range_mm", kMetrePerMm);
  row.gauge_m = number("gauge_mm", kMetrePerMm);
  row.sigma_m = number("sigma_mm", kMetrePerMm);
  row.artefact = json.value("artefact", "");
  row.camera = json.value("camera", "");
  if (json.contains("orientation")) {
    const auto& turn = json.at("orientation");
    row.orientation_W = Eigen::Quaterniond(turn[0], turn[1], turn[2], turn[3]);
  }
  return row;
}

}  // namespace

TEST_CASE("the probes published by a cell give the measured.csv that its journal exports") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/journal.sqlite";
  std::vector<model::Joint> joints = test::HeavyArm().robot.joints;
  joints[2].type = model::JointType::kPrismatic;
  auto journal = cell::Journal::Open(path);
  REQUIRE(journal);
  ProbeTail tail(path, joints);
  ProbeMark mark = tail.ReadNew(std::nullopt).value().mark;
  REQUIRE(journal.value().Append(VariedRows(200, joints), joints));
  static_cast<void>(tail.ReadNew(mark).value());
  std::vector<cell::JournalRow> published;
  std::size_t bytes = 0;
  for (const ProbeRow& probe : tail.ReadNew(mark).value().probes) {
    const std::string body = ProbeBody(probe, joints);
    CHECK(body.find("null") == (probe.measured_W ? std::string::npos : body.find("null")));
    bytes += body.size();
    published.push_back(RowFromMessage(body, joints));
  }
  REQUIRE(published.size() == 200);
  const auto stored = journal.value().Read({}, joints);
  REQUIRE(stored);
  const cell::ExportedCsv ours = cell::CsvFromJournal(published, joints),
                          theirs = cell::CsvFromJournal(*stored, joints);
  CHECK(ours.text == theirs.text);
  CHECK(ours.ids == theirs.ids);
  CHECK(theirs.ids.size() == 200);
  for (const char* column : {"q3_mm", "tau1_Nm", "tool", "payload_item", "q_step_deg", "artefact",
                             "range_mm", "gauge_mm", "sigma_mm", "camera", "t_s"}) {
    CHECK_THAT(theirs.text.substr(0, theirs.text.find('\n')), Catch::Contains(column));
  }
  CHECK(bytes / published.size() < 800);
}

TEST_CASE("a probe of a gauge has no residual, and what was not recorded is left out") {
  ProbeRow probe;
  probe.artefact = "dial";
  probe.gauge_m = 1e-3;
  const auto json = text::JsonOrNull(ProbeBody(probe, std::vector<model::Joint>(6)));
  CHECK(json.at("gauge_mm") == 1);
  CHECK(json.at("measured_mm").is_null());
  CHECK(json.at("residual_mm").is_null());
  for (const char* name : {"q", "tau", "t_s", "tool", "range_mm", "camera", "covariance_mm2"}) {
    CHECK_FALSE(json.contains(name));
  }
}

TEST_CASE("a cell is published with its identity; a text that is too long is left out") {
  FleetCell cell;
  cell.arm = {"KR 210 R2700-2", "", "2019-05-01"};
  cell.page = "http://cell7:8080/";
  const CellInForce in_force{7, "[robot]\nname = \"left \\\"A\\\"\"\n", "0123456789abcdef"};
  const auto json = text::JsonOrNull(CellBody(cell, in_force));
  CHECK(json == nlohmann::json{{"model", 7},
                               {"fingerprint", in_force.fingerprint},
                               {"arm_model", "KR 210 R2700-2"},
                               {"installed", "2019-05-01"},
                               {"page", "http://cell7:8080/"},
                               {"cell", in_force.text}});
  // A newline becomes two bytes.
  const auto large = CellBody(cell, {7, std::string(kLongestCell_bytes / 2, '\n'), "0"});
  CHECK(large.size() < kLongestCell_bytes);
  CHECK_FALSE(text::JsonOrNull(large).contains("cell"));
  CHECK_THAT(text::JsonOrNull(large).at("cell_omitted").get<std::string>(),
             Catch::Contains("has 128000 bytes"));
}

TEST_CASE("the cell in force is the version in the model store, or the cell file") {
  const TemporaryFolder folder;
  config::DaemonConfig config;
  config.state_directory = folder.path();
  config.cell_file = folder.path() + "/cell.toml";
  std::filesystem::create_directories(folder.path() + "/models");
  std::ofstream(config.cell_file) << "# declared\n[robot]\nname = \"a\"\n";
  std::ofstream(folder.path() + "/models/0002.toml")
      << "[robot]\nname = \"a\"\n[tool]\nmass_kg = 3\n";
  const auto declared = ReadCellInForce(config, 0), applied = ReadCellInForce(config, 2);
  REQUIRE(declared);
  REQUIRE(applied);
  CHECK_THAT(declared->text, Catch::StartsWith("# declared"));
  CHECK_THAT(applied->text, Catch::EndsWith("mass_kg = 3\n"));
  CHECK(declared->fingerprint.size() == 16);
  CHECK(declared->fingerprint != applied->fingerprint);
  const auto missing = ReadCellInForce(config, 3);
  REQUIRE_FALSE(missing);
  CHECK_THAT(missing.error(), Catch::Contains("0003.toml"));
}

TEST_CASE("a birth message of a cell with very many points names their number") {
  const TemporaryFolder folder;
  const auto queue = FleetQueue::Open(folder.path() + "/queue.sqlite", 1'000'000);
  REQUIRE(queue);
  FleetCell cell;
  cell.points.assign(5000, {1, std::string(60, 'x')});
  const std::string birth = BirthText(cell, queue.value(), 1, 2);
  CHECK(birth.size() < kLongestMessage_bytes);
  CHECK(text::JsonOrNull(birth).at("points").empty());
  CHECK(text::JsonOrNull(birth).at("points_omitted") == 5000);
}

}  // namespace plumbline::message_text_test
