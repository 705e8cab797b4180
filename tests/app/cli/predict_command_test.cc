// Predictions compared with another simulator's results, if the recorded sets are available.
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <new>
#include <sstream>
#include <string>

#include "app/base/config/cell_reader.h"
#include "app/cli/commands.h"
#include "app/cli/tip_prediction.h"
#include "tests/app/cli/run_command.h"

namespace {

std::atomic<std::size_t> g_allocated_bytes = 0;  // by this program so far; freed or not

}  // namespace

// Out of line, because the compiler reports an inlined free as a mismatch.
[[gnu::noinline]] void* operator new(std::size_t bytes) {
  g_allocated_bytes += bytes;
  void* const memory = std::malloc(bytes);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace plumbline::predict_command_test {

using namespace plumbline::cli;

TEST_CASE("example-03 has no hidden effect: the declared model matches it to the last digits") {
  const char* folder = std::getenv("PLUMBLINE_MEASURED");
  const std::string set =
      std::string(folder != nullptr ? folder : "../shared/measured") + "/example-03";
  if (!std::filesystem::exists(set)) {
    WARN("SKIPPED: " << set << " is not there (set PLUMBLINE_MEASURED)");
    return;
  }
  config::FaultList faults;
  const auto cell = config::ReadCell(set + "/cell.toml", faults);
  REQUIRE(cell);
  const auto poses = measure::ReadTable(set + "/test_poses.csv", cell->robot.joints, faults);
  const auto measured = measure::ReadTable(set + "/measured.csv", cell->robot.joints, faults);
  REQUIRE(poses);
  REQUIRE(measured);

  const auto predicted = Predict(*cell, *poses, {});
  REQUIRE(predicted.ok());
  std::ifstream truth(set + "/test_truth.csv");
  std::string header;
  std::getline(truth, header);
  double square_sum = 0, largest = 0;
  for (const Prediction& prediction : *predicted) {
    double x = 0, y = 0, z = 0;
    char comma = 0;
    truth >> x >> comma >> y >> comma >> z;
    const double error_mm = (1e3 * prediction.p_WT - Vec3(x, y, z)).norm();
    square_sum += error_mm * error_mm;
    largest = std::max(largest, error_mm);
  }
  CHECK(std::sqrt(square_sum / static_cast<double>(predicted->size())) < 4e-4);
  CHECK(largest < 1e-3);

  const auto fitted = Predict(*cell, *measured, {});
  REQUIRE(fitted.ok());
  double residual = 0;
  for (std::size_t k = 0; k < fitted->size(); ++k) {
    residual += ((*fitted)[k].p_WT - *measured->rows[k].measured_W).squaredNorm();
  }
  CHECK(1e3 * std::sqrt(residual / static_cast<double>(fitted->size())) ==
        Approx(0.087).margin(0.005));
}

namespace {

/// A folder with a cell and poses for it, and `plumbline predict` in this process.
class PredictFolder {
 public:
  PredictFolder() {
    std::filesystem::create_directories(path_);
    std::filesystem::copy_file("tests/virtual_cell/demo/cockpit-cell.toml", File("cell.toml"));
  }
  ~PredictFolder() { std::filesystem::remove_all(path_); }
  PredictFolder(const PredictFolder&) = delete;
  PredictFolder& operator=(const PredictFolder&) = delete;

  std::string File(const std::string& name) const { return path_ + "/" + name; }
  std::string Content(const std::string& name) const {
    std::ifstream file(File(name));
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
  }
  std::ptrdiff_t Files() const {
    return std::distance(std::filesystem::directory_iterator(path_),
                         std::filesystem::directory_iterator());
  }
  void WritePoses(const std::string& rows) const {
    std::ofstream(File("poses.csv")) << "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,payload_kg\n"
                                     << rows;
  }
  int Run(const std::string& out, const std::string& more = "") {
    const test::Answer answer =
        test::RunCommand(AddPredictCommand, "predict " + File("cell.toml") + " " +
                                                File("poses.csv") + " --out " + File(out) + more);
    told = answer.err;
    return answer.exit_code;
  }
  std::string told;

 private:
  std::string path_ = "/tmp/plumbline_predict_" + std::to_string(getpid());
};

const std::string kGoodRow = "0,-90,90,0,0,0,60\n";

}  // namespace

TEST_CASE("a time outside the fitted range of an effect of time is extrapolated") {
  const std::string file = "tests/virtual_cell/demo/cockpit-cell.toml";
  config::FaultList faults;
  auto cell = config::ReadCell(file, faults);
  REQUIRE(cell);
  model::WrittenEffect drift;
  drift.id = "thermal_drift";
  for (const auto& [name, value, unit] : {std::tuple("x", 1.0, "mm"),
                                          {"y", 0.0, "mm"},
                                          {"z", 0.0, "mm"},
                                          {"time_constant", 600.0, "s"}}) {
    model::EffectParameter parameter;
    parameter.name = name;
    parameter.value = value;
    parameter.unit = unit;
    drift.parameters.push_back(parameter);
  }
  drift.seen_t_s = model::Interval{100, 5000};
  cell->effects = {drift};
  model::Domain domain;
  domain.q.assign(static_cast<std::size_t>(cell->robot.size()), model::Interval{-7, 7});
  cell->domain = domain;
  const auto extrapolated = [&](const std::string& csv) {
    const auto poses = measure::TableFromCsv(csv, "poses.csv", cell->robot.joints, faults);
    INFO(config::FaultsText(faults));
    REQUIRE(poses);
    std::vector<bool> of_rows;
    const auto predicted = Predict(*cell, *poses, {});
    REQUIRE(predicted.ok());
    for (const Prediction& one : *predicted) of_rows.push_back(one.extrapolated);
    return of_rows;
  };
  const std::string joints = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg";
  const std::string pose = "0,-90,90,0,0,0";
  CHECK(extrapolated("t_s," + joints + "\n99," + pose + "\n100," + pose + "\n5000," + pose +
                     "\n5001," + pose + "\n") == std::vector<bool>{true, false, false, true});
  // Not recorded: the drift may be anything between its start and its end.
  CHECK(extrapolated(joints + "\n" + pose + "\n") == std::vector<bool>{true});
  const auto radius_mm = [&](const std::string& csv) {
    const auto poses = measure::TableFromCsv(csv, "poses.csv", cell->robot.joints, faults);
    return 1e3 * Predict(*cell, *poses, {}).value().front().radius.radius_m;
  };
  CHECK(radius_mm(joints + "\n" + pose + "\n") >
        radius_mm("t_s," + joints + "\n5000," + pose + "\n") + 0.99);
}

TEST_CASE("an event at a row of the fitted file precedes every pose of another file") {
  PredictFolder folder;
  folder.WritePoses(kGoodRow + kGoodRow);
  REQUIRE(folder.Run("without.csv") == 0);
  CHECK_THAT(folder.told, !Catch::Contains("depends on the row number"));
  std::ofstream(folder.File("cell.toml"), std::ios::app)
      << "\n[[effect]]\nid = \"step_event\"\nscope = []\nparameters = [\n"
         "  { name = \"row\", value = 20.5, unit = \"1\" },\n"
         "  { name = \"x\", value = 3.0, unit = \"mm\" },\n"
         "  { name = \"frame\", value = \"base\" },\n]\n";
  REQUIRE(folder.Run("with.csv") == 0);
  CHECK_THAT(
      folder.told,
      Catch::Contains(
          "warning: step_event depends on the row number in the file that it was fitted to"));
  const auto x_of_rows = [&](const std::string& file) {
    std::istringstream lines(folder.Content(file));
    std::string line;
    std::getline(lines, line);
    std::vector<double> x_mm;
    while (std::getline(lines, line)) x_mm.push_back(std::stod(line));
    return x_mm;
  };
  const std::vector<double> without = x_of_rows("without.csv"), with = x_of_rows("with.csv");
  REQUIRE(with.size() == 2);
  for (std::size_t k = 0; k < 2; ++k) CHECK(with[k] - without[k] == Approx(3).margin(1e-3));
}

TEST_CASE("a row with an impossible payload is reported and skipped") {
  PredictFolder folder;
  folder.WritePoses(kGoodRow + "0,-90,90,0,0,0,-1\n0,-90,90,0,0,0,5001\n");
  CHECK(folder.Run("out.csv") == 1);
  CHECK_THAT(folder.told, Catch::Contains("poses.csv:3 payload_kg: warning: -1 is outside 0..5000; "
                                          "row not used"));
  CHECK_THAT(folder.told, Catch::Contains("poses.csv:4 payload_kg: warning: 5001 is outside"));
  CHECK_THAT(folder.told, Catch::Contains("out.csv: 1 pose predicted") &&
                              Catch::Contains("lines 3, 4 could not be read"));
  folder.WritePoses(kGoodRow);
  CHECK(folder.Run("out.csv") == 0);
  CHECK(folder.Run("no/such/folder.csv") == 2);
}

TEST_CASE("predict says why poses are extrapolated") {
  PredictFolder folder;
  folder.WritePoses(kGoodRow + "0,-90,90,360,0,0,60\n0,-90,90,362,0,0,60\n");
  CHECK(folder.Run("out.csv") == 0);
  CHECK_THAT(folder.told, Catch::Contains("3 poses predicted, 2 extrapolated") &&
                              Catch::Contains("extrapolated in 2 poses: q4 is 360 deg, limits: "
                                              "-350 to 350 deg (line 3)"));
}

TEST_CASE("a missing payload column is reported and every row counts as extrapolated") {
  PredictFolder folder;
  std::ofstream(folder.File("poses.csv"))
      << "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,payload_g\n0,-90,90,0,0,0,60000\n";
  CHECK(folder.Run("out.csv") == 0);
  CHECK_THAT(folder.told,
             Catch::Contains("payload_g: warning: is not a column of the format: treated as an "
                             "additional signal; did you mean payload_kg?") &&
                 Catch::Contains("a payload of 0 kg is assumed") &&
                 Catch::Contains("1 extrapolated"));
  CHECK_THAT(folder.Content("out.csv"), Catch::EndsWith(",1,assumed\n"));
  folder.WritePoses(kGoodRow);
  CHECK(folder.Run("out.csv") == 0);
  CHECK_THAT(folder.told, !Catch::Contains("not recorded") && Catch::Contains("0 extrapolated"));
}

TEST_CASE("an assumed radius names what is not declared, or what it rests on instead") {
  using Catch::Contains;
  PredictFolder folder;
  folder.WritePoses(kGoodRow);
  CHECK(folder.Run("out.csv") == 0);
  CHECK_THAT(folder.told,
             Contains("the cell declares its joints, links and payload; the radii rest "
                      "on a typical compliance of the tool's coupling") &&
                 Contains("--deflection-sd") && !Contains("Declare"));

  std::string cell = folder.Content("cell.toml");
  const auto remove = [&](const std::string& line) {
    const auto at = cell.find(line);
    REQUIRE(at != std::string::npos);
    cell.erase(at, line.size());
  };
  remove("compliance_rad_per_Nm = 4.0e-7\n");
  remove("compliance_rad_per_Nm = 2.5e-6\n");
  std::ofstream(folder.File("cell.toml")) << cell;
  CHECK(folder.Run("out.csv") == 0);
  CHECK_THAT(folder.told, Contains("Declare compliance_rad_per_Nm of joints 2 and 5, or fit the"));
}

TEST_CASE("a cell with an unknown frame or tool is predicted only if these are given") {
  const char* measured_as[] = {"\n[measurement]\nkind = \"position\"\nframe = \"unaligned\"\n",
                               "\n[measurement]\nkind = \"position\"\ntool = \"unknown\"\n"};
  for (const char* measurement : measured_as) {
    CAPTURE(measurement);
    PredictFolder folder;
    folder.WritePoses(kGoodRow);
    const std::string whole = folder.Content("cell.toml");
    const std::string cell = whole.substr(0, whole.find("\n[measurement]")) + measurement;
    std::ofstream(folder.File("cell.toml")) << cell;
    CHECK(folder.Run("out.csv") == 1);
    CHECK_THAT(folder.told,
               Catch::Contains("--align MEASURED.csv") && Catch::Contains("out.csv: not written"));
    CHECK_FALSE(std::filesystem::exists(folder.File("out.csv")));
    std::ofstream(folder.File("cell.toml"))
        << cell << "[[session]]\nid = \"1\"\nbase_xyz_mm = [1.0, 2.0, 3.0]\n";
    CHECK(folder.Run("out.csv") == 0);
  }
}

TEST_CASE("where a correction has faded the frames are those of the declared model") {
  PredictFolder folder;
  folder.WritePoses(kGoodRow);
  const std::string whole = folder.Content("cell.toml");
  const std::string cell = whole.substr(0, whole.find("\n[measurement]")) +
                           "\n[measurement]\nkind = \"position\"\nframe = \"unaligned\"\n"
                           "tool = \"unknown\"\n";
  const std::string declared =
      "base_xyz_mm = [1.0, 2.0, 3.0]\nbase_rpy_deg = [0.1, -0.2, 0.3]\n"
      "tip_mm = [4.0, 5.0, 600.0]\n";
  const auto tip_of = [&](const std::string& frames, const std::string& domain) {
    std::ofstream(folder.File("cell.toml")) << cell << "[[session]]\nid = \"1\"\n"
                                            << frames << domain;
    CHECK(folder.Run("out.csv") == 0);
    const std::string out = folder.Content("out.csv");
    const std::string row = out.substr(out.find('\n') + 1);
    Vec3 tip_mm;
    std::sscanf(row.c_str(), "%lf,%lf,%lf", &tip_mm.x(), &tip_mm.y(), &tip_mm.z());
    return tip_mm;
  };
  const std::string both =
      "base_xyz_mm = [7.0, 8.0, 9.0]\ntip_mm = [0.0, 0.0, 600.0]\ndeclared_base_xyz_mm = [1.0, "
      "2.0, 3.0]\ndeclared_base_rpy_deg = [0.1, -0.2, 0.3]\ndeclared_tip_mm = [4.0, 5.0, 600.0]\n";
  const auto domain = [](const std::string& q) {
    return "[domain]\nq_deg = [[-360, 360], [-360, 360], [-360, 360], [-360, 360], [-360, 360], "
           "[-360, 360]]\npayload_kg = [0, 100]\nresidual_sigma_mm = 0.05\ndistant_sigma_mm = "
           "10000\n"
           "declared_sigma_mm = 0.001\nposes_deg = [[" +
           q + "]]\n";
  };
  const Vec3 faded = tip_of(both, domain("180, 90, -90, 180, 180, 180"));
  // Gravity stays that of the corrected base, 6 mrad aside.
  CHECK((faded - tip_of(declared, "")).norm() < 0.2);
  const Vec3 near = tip_of(both, domain("0, -90, 90, 0, 0, 0"));
  CHECK((near - tip_of(both, "")).norm() < 1e-4);
  CHECK((near - faded).norm() > 5);
}

TEST_CASE("poses without a temperature are reported if the model was fitted at some") {
  PredictFolder folder;
  folder.WritePoses(kGoodRow);
  std::ofstream(folder.File("cell.toml"), std::ios::app)
      << "\n[domain]\nq_deg = [[-360, 360], [-360, 360], [-360, 360], [-360, 360], [-360, 360], "
         "[-360, 360]]\ntemp_C = [18, 28]\n";
  CHECK(folder.Run("out.csv") == 0);
  CHECK_THAT(folder.told, Catch::Contains("has no column temp_C; the radius holds for the measured "
                                          "18.0 to 28.0 degC"));
}

TEST_CASE("--out - is standard output, as everywhere") {
  PredictFolder folder;
  folder.WritePoses(kGoodRow);
  const test::Answer answer =
      test::RunCommand(AddPredictCommand, "predict " + folder.File("cell.toml") + " " +
                                              folder.File("poses.csv") + " --out -");
  CHECK(answer.exit_code == 0);
  CHECK_THAT(answer.out, Catch::StartsWith("x_mm,y_mm,z_mm,u_mm,extrapolated,basis\n"));
  CHECK_FALSE(std::filesystem::exists("-"));
}

TEST_CASE("--out must not be an input") {
  PredictFolder folder;
  folder.WritePoses(kGoodRow);
  const std::string before = folder.Content("poses.csv");
  std::filesystem::create_hard_link(folder.File("poses.csv"), folder.File("same.csv"));
  for (const char* out : {"poses.csv", "cell.toml", "same.csv"}) {
    CAPTURE(out);
    CHECK(folder.Run(out) == 2);
    CHECK_THAT(folder.told, Catch::Contains("--output would overwrite the input "));
  }
  CHECK(folder.Content("poses.csv") == before);

  std::ofstream(folder.File("measured.csv")) << "measured\n";
  CHECK(folder.Run("measured.csv", " --align " + folder.File("measured.csv")) == 2);
  CHECK(folder.Content("measured.csv") == "measured\n");
}

TEST_CASE("measured rows that cannot be read: exit 1, and nothing is written") {
  PredictFolder folder;
  folder.WritePoses(kGoodRow);
  CHECK(folder.Run("out.csv", " --align " + folder.File("absent.csv")) == 1);
  CHECK_THAT(folder.told, Catch::Contains("absent.csv: cannot be read") &&
                              Catch::Contains("out.csv: not written"));
  CHECK_FALSE(std::filesystem::exists(folder.File("out.csv")));
}

TEST_CASE("a refused prediction leaves an older output unchanged and reports it") {
  PredictFolder folder;
  std::ofstream(folder.File("out.csv")) << "older\n";
  folder.WritePoses("0,-90,90,0,0,0,60\n");
  std::ofstream(folder.File("cell.toml")) << "schema = 1\n";
  CHECK(folder.Run("out.csv") == 1);
  CHECK_THAT(folder.told, Catch::Contains("out.csv: not written"));
  CHECK(folder.Content("out.csv") == "older\n");
  CHECK(folder.Files() == 3);
}

TEST_CASE("the uncertainty of an alignment widens the radius") {
  config::FaultList faults;
  const auto cell = config::ReadCell("tests/virtual_cell/demo/cockpit-cell.toml", faults);
  REQUIRE(cell);
  const auto poses =
      measure::TableFromCsv("q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,payload_kg\n" + kGoodRow,
                            "poses.csv", cell->robot.joints, faults);
  REQUIRE(poses);
  const auto bare = Predict(*cell, *poses, {});
  REQUIRE(bare.ok());
  const double narrow_m = bare->front().radius.radius_m;
  constexpr double kTip_m = 0.05;
  measure::FrameCovariances frames;
  measure::FrameCovariance of_tip = measure::FrameCovariance::Zero();
  of_tip.bottomRightCorner<3, 3>() = kTip_m * kTip_m * Mat3::Identity();
  frames[""] = {of_tip};
  const auto wide = Predict(*cell, *poses, {}, frames);
  REQUIRE(wide.ok());
  // 95 % of a ball of three equal deviations: sqrt of chi2_3's quantile, 7.815.
  CHECK(wide->front().radius.radius_m ==
        Approx(std::hypot(narrow_m, kTip_m * std::sqrt(7.815))).epsilon(0.01));
}

TEST_CASE("a payload of unknown mass has its declared centre of gravity") {
  config::FaultList faults;
  auto cell = config::ReadCell("config/cells/kr210.toml", faults);
  REQUIRE(cell);
  const auto poses =
      measure::TableFromCsv("q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n0,-90,90,0,0,0\n",
                            "poses.csv", cell->robot.joints, faults);
  REQUIRE(poses);
  const auto radius_m = [&](double centre_m) {
    cell->payload_cog_F = Vec3(0, 0, centre_m);
    const auto predicted = Predict(*cell, *poses, {});
    REQUIRE(predicted.ok());
    return predicted->front().radius.radius_m;
  };
  CHECK(radius_m(1.0) > 1.1 * radius_m(0.0));
}

TEST_CASE("every row is reported as done once, in order") {
  config::FaultList faults;
  const auto cell = config::ReadCell("tests/virtual_cell/demo/cockpit-cell.toml", faults);
  REQUIRE(cell);
  std::string csv = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,payload_kg\n";
  for (int k = 0; k < 300; ++k) csv += kGoodRow;
  const auto poses = measure::TableFromCsv(csv, "poses.csv", cell->robot.joints, faults);
  REQUIRE(poses);
  std::vector<std::size_t> told;
  REQUIRE(Predict(*cell, *poses, {}, {}, [&](std::size_t done) { told.push_back(done); }).ok());
  CHECK(told == std::vector<std::size_t>{0, 64, 128, 192, 256});
}

TEST_CASE("run time grows linearly with rows and sessions") {
  config::FaultList faults;
  auto cell = config::ReadCell("tests/virtual_cell/demo/cockpit-cell.toml", faults);
  REQUIRE(cell);
  const auto allocated_for = [&](int rows, int sessions) {
    cell->sessions.clear();
    for (int s = 0; s < sessions; ++s) {
      cell->sessions.push_back({"s" + std::to_string(s), cell->robot.X_WB});
    }
    std::string csv = "session,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,payload_kg\n";
    for (int k = 0; k < rows; ++k) csv += "s" + std::to_string(k % sessions) + "," + kGoodRow;
    const std::size_t before = g_allocated_bytes.load();
    const auto poses = measure::TableFromCsv(csv, "poses.csv", cell->robot.joints, faults);
    REQUIRE(poses);
    const auto predicted = Predict(*cell, *poses, {});
    REQUIRE(predicted.ok());
    CHECK(predicted->size() == static_cast<std::size_t>(rows));
    return static_cast<double>(g_allocated_bytes - before);
  };
  CHECK(allocated_for(8000, 1) < 5 * allocated_for(2000, 1));
  CHECK(allocated_for(800, 800) < 5 * allocated_for(200, 200));
}

}  // namespace plumbline::predict_command_test
