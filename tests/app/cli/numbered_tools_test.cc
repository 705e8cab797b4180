// Several tools and payload items in one set: from rows of the simulator, which shares no model
// code with the product, to the diagnosis and the predictions of the corrected cell.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <sstream>

#include "app/cli/commands.h"
#include "drivers/files/text_file.h"
#include "tests/app/cli/run_command.h"
#include "tests/app/temporary_folder.h"
#include "tests/file_text.h"
#include "tests/simulator/arm.h"

namespace plumbline::numbered_tools_test {

using Catch::Contains;
using plumbline::test::Answer;
using plumbline::test::RunCommand;
using plumbline::test::TemporaryFolder;

namespace {

constexpr double kSigma_m = 5e-5;
constexpr double kHidden_rad_per_Nm = 4e-6;

/// What the arm carries in one row.
struct Carried {
  int tool = 1;
  int item = 0;
  double payload_kg = 0;
};

/// Tool 1 is that of the ready cell; tool 2 is longer and three times as heavy.
simulator::Tool ToolOf(int number) {
  simulator::Tool tool = simulator::ReadyCell("ur10").tool;
  if (number == 1) return tool;
  tool.length_m = 0.75;
  tool.side_m = 0.05;
  tool.mount_mass_kg = 2.5;
  return tool;
}

const Eigen::Vector3d kPayloadCog_m(0.01, 0.02, 0.53), kItemCog_m(-0.08, 0.06, 0.1);
constexpr double kItem_kg = 2.2;

/// The simulator's cell for one row; payload and item are one mass there.
simulator::Cell CellFor(const Carried& carried) {
  simulator::Cell cell = simulator::ReadyCell("ur10");
  cell.sigma_m = kSigma_m;
  cell.tool = ToolOf(carried.tool);
  const double item_kg = carried.item == 7 ? kItem_kg : 0;
  const double all_kg = carried.payload_kg + item_kg;
  cell.payload_cog_m = kPayloadCog_m;
  if (all_kg > 0) {
    cell.payload_cog_m = (carried.payload_kg * kPayloadCog_m + item_kg * kItemCog_m) / all_kg;
  }
  return cell;
}

/// A row without motion.
simulator::Row StillRow() {
  simulator::Row row;
  row.q_rad = row.qd_rad_s = row.qdd_rad_s2 = row.last_move_rad = Eigen::VectorXd::Zero(6);
  row.temp_C = simulator::Cell().reference_temperature_C;
  return row;
}

Eigen::Vector3d TipOf(const Carried& carried, simulator::Row row) {
  const simulator::Effects hidden = {{.id = "joint_compliance",
                                      .scope = {"q2", "q3"},
                                      .parameters = {{"q2", kHidden_rad_per_Nm, "rad/(N m)"},
                                                     {"q3", 1.5 * kHidden_rad_per_Nm, "rad/(N m)"}},
                                      .by = {},
                                      .frame = {},
                                      .session = {}}};
  row.payload_kg = carried.payload_kg + (carried.item == 7 ? kItem_kg : 0);
  return simulator::Tips(CellFor(carried), hidden, {row}).front();
}

struct Table {
  std::string measured, poses;
  std::vector<Eigen::Vector3d> truth;  ///< at `poses` [m]
};

/// Rows with both tools, with and without payload and item, in random order.
Table Rows(int measured, int poses) {
  const simulator::Cell cell = simulator::ReadyCell("ur10");
  std::mt19937_64 random(21);
  std::normal_distribution<double> noise(0, kSigma_m);
  std::uniform_real_distribution<double> share(0.15, 0.85);
  const std::string joints =
      "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,payload_kg,tool,payload_item";
  Table table{joints + ",x_mm,y_mm,z_mm\n", joints + "\n", {}};
  for (int k = 0; k < measured + poses; ++k) {
    const Carried carried{1 + k % 2, k % 3 == 0 ? 7 : 0, k % 4 < 2 ? 0.0 : 3.0};
    simulator::Row row = StillRow();
    std::string line;
    for (int i = 0; i < 6; ++i) {
      const simulator::Joint& joint = cell.joints[static_cast<std::size_t>(i)];
      const double q_deg =
          (joint.min_rad + share(random) * (joint.max_rad - joint.min_rad)) / simulator::kDeg;
      line += fmt::format("{:.7f},", q_deg);
      row.q_rad[i] = q_deg * simulator::kDeg;
    }
    line += fmt::format("{},{},{}", carried.payload_kg, carried.tool, carried.item);
    const Eigen::Vector3d tip_m = TipOf(carried, row);
    if (k >= measured) {
      table.poses += line + '\n';
      table.truth.push_back(tip_m);
      continue;
    }
    for (int axis = 0; axis < 3; ++axis) {
      line += fmt::format(",{:.6f}", 1e3 * (tip_m[axis] + noise(random)));
    }
    table.measured += line + '\n';
  }
  return table;
}

/// The block of one table of a TOML text, without its header line.
std::string BlockOf(const std::string& text, const std::string& header) {
  const auto start = text.find(header) + header.size();
  return text.substr(start, text.find("\n[", start) - start);
}

std::string CellText(const simulator::Tool& tool) {
  const TemporaryFolder folder;
  simulator::Cell cell = simulator::ReadyCell("ur10");
  cell.sigma_m = kSigma_m;
  cell.tool = tool;
  cell.payload_cog_m = kPayloadCog_m;
  simulator::WriteCell(cell, folder.path() + "/cell.toml");
  return files::ReadTextFile(folder.path() + "/cell.toml").value();
}

void Replace(std::string& text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  REQUIRE(at != std::string::npos);
  text.replace(at, from.size(), to);
}

/// A cell with [[tool]] 1 and 2 and [[payload.item]] 7 and 8; no row carries item 8.
std::string TwoToolsText() {
  std::string text = CellText(ToolOf(1));
  const std::string second = BlockOf(CellText(ToolOf(2)), "[tool]");
  Replace(text, "[tool]", "[[tool]]\nnumber = 2" + second + "\n[[tool]]\nnumber = 1");
  Replace(text, "\n[measurement]",
          fmt::format("\n[[payload.item]]\nnumber = 7\nmass_kg = {}\ncog_mm = [-80, 60, 100]\n\n"
                      "[[payload.item]]\nnumber = 8\nmass_kg = 1\ncog_mm = [-80, 60, 100]\n\n"
                      "[measurement]",
                      kItem_kg));
  return text;
}

class Desk {
 public:
  std::string Write(const std::string& name, const std::string& text) const {
    REQUIRE(files::WriteTextFile(At(name), text));
    return At(name);
  }
  std::string At(const std::string& name) const { return folder_.path() + "/" + name; }
  Answer Diagnose() const {
    return RunCommand(cli::AddDiagnoseCommand,
                      fmt::format("diagnose {} {} --write-model {} --json {}", At("cell.toml"),
                                  At("measured.csv"), At("corrected.toml"), At("d.json")));
  }
  Answer Predict(const std::string& cell) const {
    return RunCommand(cli::AddPredictCommand, fmt::format("predict {} {} --out {}", At(cell),
                                                          At("poses.csv"), At("predicted.csv")));
  }
  /// Predicted tips [m], and how many of them are extrapolated.
  std::vector<Eigen::Vector3d> Predicted(int& extrapolated) const {
    std::istringstream lines(files::ReadTextFile(At("predicted.csv")).value());
    std::string line;
    std::getline(lines, line);
    std::vector<Eigen::Vector3d> tips;
    extrapolated = 0;
    while (std::getline(lines, line)) {
      double u_mm = 0;
      int outside = 0;
      Eigen::Vector3d mm;
      std::replace(line.begin(), line.end(), ',', ' ');
      std::istringstream cells(line);
      REQUIRE(cells >> mm[0] >> mm[1] >> mm[2] >> u_mm >> outside);
      tips.emplace_back(1e-3 * mm);
      extrapolated += outside;
    }
    return tips;
  }

 private:
  TemporaryFolder folder_;
};

double Rms(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  REQUIRE(a.size() == b.size());
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k] - b[k]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(a.size()));
}

}  // namespace

TEST_CASE("one diagnosis of two tools and a payload item finds the compliance and predicts both") {
  const Desk desk;
  const Table table = Rows(72, 40);
  desk.Write("cell.toml", TwoToolsText());
  desk.Write("measured.csv", table.measured);
  desk.Write("poses.csv", table.poses);
  const Answer answer = desk.Diagnose();
  INFO(answer.err << answer.out);
  REQUIRE(answer.exit_code == 0);
  const std::string json = files::ReadTextFile(desk.At("d.json")).value();
  CHECK_THAT(json, Contains("\"verdict\": \"explained\"") && Contains("joint_compliance"));
  const std::string corrected = files::ReadTextFile(desk.At("corrected.toml")).value();
  CHECK_THAT(corrected, Contains("tools = [1, 2]") && Contains("payload_items = [0, 7]"));

  int extrapolated = 0;
  REQUIRE(desk.Predict("cell.toml").exit_code == 0);
  const double declared_m = Rms(desk.Predicted(extrapolated), table.truth);
  const Answer predicted = desk.Predict("corrected.toml");
  INFO(predicted.err);
  REQUIRE(predicted.exit_code == 0);
  const double corrected_m = Rms(desk.Predicted(extrapolated), table.truth);
  CHECK(declared_m > 5e-4);
  CHECK(corrected_m < kSigma_m);
  CHECK(extrapolated < 20);

  // The item that was never measured is extrapolated, and its radius is wider.
  std::string never = table.poses;
  std::size_t renamed = 0;
  for (std::size_t at = 0; (at = never.find(",7\n", at)) != std::string::npos; ++at) {
    never.replace(at, 3, ",8\n");
    ++renamed;
  }
  desk.Write("poses.csv", never);
  const Answer unmeasured = desk.Predict("corrected.toml");
  CHECK_THAT(unmeasured.err, Contains("payload item 8 was not measured (measured: 0, 7)"));
  int more = 0;
  desk.Predicted(more);
  CHECK(more >= static_cast<int>(renamed));
  CHECK(more > extrapolated);
}

TEST_CASE("a pose that bends the tool beyond linear theory is named with its line") {
  const Desk desk;
  desk.Write("cell.toml", CellText(ToolOf(1)));
  const std::string header = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,payload_kg\n";
  desk.Write("poses.csv", header + "10,-80,60,10,20,30,3\n10,-80,60,10,20,30,600\n");
  const Answer answer = desk.Predict("cell.toml");
  CHECK_THAT(answer.err, Contains("poses.csv:3: warning: the tool bends by ") &&
                             Contains("linear beam theory holds up to 5 %") &&
                             !Contains("poses.csv:2: warning"));
}

TEST_CASE("rows that name what the cell does not declare are refused with line and remedy") {
  const Desk desk;
  Table table = Rows(20, 4);
  desk.Write("cell.toml", TwoToolsText());
  desk.Write("poses.csv", table.poses);
  const auto refusal = [&](const std::string& poses) {
    desk.Write("poses.csv", poses);
    const Answer answer = desk.Predict("cell.toml");
    CHECK(answer.exit_code == 1);
    return answer.err;
  };
  const std::string header = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,payload_kg";
  const std::string posture = "\n0,-90,60,10,20,30,0";
  CHECK_THAT(refusal(header + ",tool" + posture + ",1" + posture + ",3\n"),
             Contains("line 3: tool 3 is not declared, the cell declares 2, 1") &&
                 Contains("add a [[tool]] with number = 3"));
  CHECK_THAT(refusal(header + ",tool" + posture + ",gripper\n"),
             Contains("line 2: tool is empty or not a whole number"));
  CHECK_THAT(refusal(header + posture + "\n"), Contains("has no column tool"));
  CHECK_THAT(refusal(header + ",tool,payload_item" + posture + ",1,5\n"),
             Contains("line 2: payload_item 5 is not declared, the cell declares "
                      "[[payload.item]] 7, 8"));

  std::string text = TwoToolsText();
  Replace(text, "number = 1", "number = 2");
  desk.Write("cell.toml", text);
  CHECK_THAT(desk.Predict("cell.toml").err,
             Contains("number: 2 is already the number of the tool in line"));
  desk.Write("measured.csv", table.measured);
  CHECK(desk.Diagnose().exit_code == 1);
}

TEST_CASE("a cell with one [tool] reads as before, whatever a column tool holds") {
  const Desk desk;
  const std::string header = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,payload_kg";
  const std::string posture = "10,-80,60,10,20,30,3";
  const std::string plain = CellText(ToolOf(2));
  std::string numbered = plain;
  Replace(numbered, "[tool]", "[[tool]]\nnumber = 4");
  desk.Write("plain.toml", plain);
  desk.Write("numbered.toml", numbered);
  desk.Write("poses.csv", header + "\n" + posture + "\n");
  REQUIRE(desk.Predict("plain.toml").exit_code == 0);
  int extrapolated = 0;
  const Eigen::Vector3d tip = desk.Predicted(extrapolated).front();
  simulator::Row row = StillRow();
  row.q_rad << 10, -80, 60, 10, 20, 30;
  row.q_rad *= simulator::kDeg;
  row.payload_kg = 3;
  const simulator::Cell cell = CellFor({2, 0, 3.0});
  CHECK((simulator::Tips(cell, {}, {row}).front() - tip).norm() < 2e-7);

  REQUIRE(desk.Predict("numbered.toml").exit_code == 0);
  CHECK(desk.Predicted(extrapolated).front() == tip);
  desk.Write("poses.csv", header + ",tool\n" + posture + ",gripper\n");
  REQUIRE(desk.Predict("plain.toml").exit_code == 0);
  CHECK(desk.Predicted(extrapolated).front() == tip);
}

}  // namespace plumbline::numbered_tools_test
