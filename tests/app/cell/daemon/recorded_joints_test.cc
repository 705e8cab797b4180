// Real arms' recorded joints through the whole Modbus path, where the recordings are there.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "app/base/config/cell_reader.h"
#include "app/measure/table/csv.h"
#include "tests/app/cell/daemon/daemon_process.h"
#include "tests/virtual_cell/running_cell.h"

namespace plumbline::recorded_joints_test {

using namespace plumbline::test;
using virtual_cell::Eventually;
using virtual_cell::RegisterClient;
using virtual_cell::RunningCell;

namespace {

constexpr double kRateHz = 4;
constexpr std::size_t kRows = 12;

std::string Measured(const std::string& set) {
  const char* folder = std::getenv("PLUMBLINE_MEASURED");
  const auto path =
      std::filesystem::absolute(folder != nullptr ? folder : "../shared/measured") / set;
  if (std::filesystem::exists(path)) return path.string();
  WARN("SKIPPED: " << path << " is not there (set PLUMBLINE_MEASURED)");
  return "";
}

std::string Config(const std::string& robot, const std::string& profile, const std::string& cell) {
  const std::string here = std::filesystem::current_path().string();
  return "cell = \"" + cell + "\"\nstate_directory = \"state\"\n[robot]\nprofile = \"" + here +
         "/config/profiles/" + profile +
         ".toml\"\nhost = \"127.0.0.1\"\nport = " + robot.substr(robot.find(':') + 1) +
         "\n[payload]\nsource = \"fixed\"\nmass_kg = 0.0\n[plc]\nlisten = \"127.0.0.1\"\nport = 0\n"
         "[[point]]\nid = 1\nname = \"any\"\nframe = \"base\"\nxyz_mm = [400.0, 100.0, "
         "500.0]\nrpy_deg = [180.0, 0.0, 0.0]\n";
}

}  // namespace

TEST_CASE("recorded joints arrive as they were recorded", "[measured]") {
  struct Case {
    const char* set;
    virtual_cell::Profile profile;
    const char* map;
    double tolerance_deg;  ///< half a register's step, and the file's 1e-5 degree
  };
  const Case cases[] = {
      {"real-ur10-random", virtual_cell::Profile::kUr, "universal-robots", 0.0287 + 1e-4},
      {"real-ur10-random", virtual_cell::Profile::kUr, "universal-robots-fine", 1e-4},
      {"real-iiwa7", virtual_cell::Profile::kGeneric, "generic-7", 1e-4},
  };
  for (const Case& c : cases) {
    CAPTURE(c.set, c.map);
    const std::string folder = Measured(c.set);
    if (folder.empty()) continue;
    std::string profile = c.map;
    TemporaryFolder own;
    if (profile == "generic-7") {
      // The generic profile with a seventh joint; a recorded arm has no tool pose to compare with.
      std::string map = FileText("config/profiles/generic.toml");
      const auto joints = map.find("[0, 2, 4, 6, 8, 10]");
      REQUIRE(joints != std::string::npos);
      map.replace(joints, 19, "[0, 2, 4, 6, 8, 10, 12]");
      std::ofstream(own.path() + "/map.toml") << map;
    }
    config::FaultList faults;
    const auto cell = config::ReadCell(folder + "/cell.toml", faults);
    REQUIRE(cell);
    auto table = measure::ReadTable(folder + "/measured.csv", cell->robot.joints, faults);
    REQUIRE(table);
    table->rows.resize(kRows);

    virtual_cell::VirtualCellOptions options;
    options.profile = c.profile;
    options.row_rate_hz = kRateHz;
    for (const measure::MeasuredRow& row : table->rows) {
      virtual_cell::ReplayRow& played = options.replay.emplace_back();
      played.q = row.q;
    }
    const auto description = virtual_cell::ReadCellFile(folder + "/cell.toml");
    RunningCell robot(virtual_cell::World(description, {}),
                      virtual_cell::BuiltinProgram(description), options);
    std::string config = Config(robot.robot(), profile, folder + "/cell.toml");
    if (profile == "generic-7") {
      const auto at = config.find(std::filesystem::current_path().string() + "/config/profiles");
      const auto end = config.find('"', at);
      config.replace(at, end - at, own.path() + "/map.toml");
    }
    DaemonProcess daemon(config);
    RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
    const auto largest_error_deg = [&](const measure::MeasuredRow& row) {
      const auto inputs = plc.Read(300, 52);
      double error = (inputs.Word(0) & 1) != 0 ? 0 : 999;
      for (Eigen::Index k = 0; k < row.q.size(); ++k) {
        const double q_deg = static_cast<double>(inputs.Float(4 + 2 * static_cast<int>(k)));
        error = std::max(error, std::abs(q_deg - row.q[k] * 180 / M_PI));
      }
      return error;
    };
    // The last row stays; those before it are seen while they pass.
    std::size_t seen = 0;
    CHECK(Eventually([&] {
      for (std::size_t k = 0; k < table->rows.size(); ++k) {
        if (largest_error_deg(table->rows[k]) <= c.tolerance_deg) seen = std::max(seen, k + 1);
      }
      return seen == table->rows.size();
    }));
    INFO(daemon.Log());
    CHECK(seen == kRows);
  }
}

}  // namespace plumbline::recorded_joints_test
