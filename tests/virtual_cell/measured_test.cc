// Comparison with recorded data, if available: the world against another simulator's truth,
// and real joint rows streamed through the registers.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/virtual_cell/running_cell.h"

namespace virtual_cell::measured_test {
namespace {

std::string Measured(const std::string& path) {
  const char* folder = std::getenv("PLUMBLINE_MEASURED");
  std::string full = (folder != nullptr ? folder : "../shared/measured") + ("/" + path);
  if (!std::filesystem::exists(full)) {
    WARN("SKIPPED: " << full << " is not available (set PLUMBLINE_MEASURED)");
    return "";
  }
  return full;
}

/// The first three columns of each row below the header [mm].
std::vector<Vec3> ReadTips(const std::string& path) {
  std::vector<Vec3> tips;
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream text(line);
    Vec3 p;
    char comma = 0;
    text >> p.x() >> comma >> p.y() >> comma >> p.z();
    tips.push_back(p);
  }
  return tips;
}

TEST_CASE("the world agrees with another simulator except for large-displacement terms",
          "[measured]") {
  const std::string folder = Measured("example-03");
  if (folder.empty()) return;
  const CellDescription cell = ReadCellFile(folder + "/cell.toml");
  const World world(cell);
  const std::vector<ReplayRow> rows = ReadJointRows(folder + "/test_poses.csv", cell.size());
  const std::vector<Vec3> truth = ReadTips(folder + "/test_truth.csv");
  REQUIRE(rows.size() == truth.size());
  double sum = 0, largest = 0, sag = 0;
  const Arm arm = ArmFromDescription(cell);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double payload = rows[i].payload_kg.value_or(0);
    const Vec3 tip_mm =
        1e3 * world.Settle({.q = rows[i].q, .payload_kg = payload}).X_WT.translation();
    const double apart = (tip_mm - truth[i]).norm();
    sum += apart * apart;
    largest = std::max(largest, apart);
    const Vec3 nominal = cell.X_WB * NominalTip(cell, arm, rows[i].q).translation();
    sag = std::max(sag, (truth[i] - 1e3 * nominal).norm());
  }
  const double rms = std::sqrt(sum / static_cast<double>(rows.size()));
  INFO("difference: RMS " << rms << " mm, max " << largest << " mm, at sags up to " << sag
                          << " mm");
  CHECK(rms < 0.05);
  CHECK(largest < 0.15);
  CHECK(sag > 1);
}

/// Streams the first rows of a data set and compares the last one with the registers.
void Stream(const std::string& folder, Profile profile) {
  const CellDescription cell = ReadCellFile(folder + "/cell.toml");
  VirtualCellOptions options;
  options.profile = profile;
  options.replay = ReadJointRows(folder + "/measured.csv", cell.size());
  options.replay.resize(std::min<std::size_t>(options.replay.size(), 50));
  options.row_rate_hz = 100;
  const Joints last = options.replay.back().q;
  RunningCell running(World(cell), BuiltinProgram(cell), options);
  RegisterClient robot("robot", running.robot(), 1, 5);
  const bool fine = profile == Profile::kUr;
  CHECK(Eventually([&] {
    const RegisterBank now = robot.Read(fine ? 150 : 0, 2 * cell.size());
    for (int i = 0; i < cell.size(); ++i) {
      const double told = fine ? 1e-6 * static_cast<std::int32_t>(now.Long(2 * i))
                               : static_cast<double>(now.Float(2 * i));
      if (std::abs(told - last[i]) > 1e-6) return false;
    }
    return true;
  }));
}

TEST_CASE("a real UR10 streams through both profiles", "[measured]") {
  const std::string folder = Measured("real-ur10-random");
  if (folder.empty()) return;
  Stream(folder, Profile::kUr);
  Stream(folder, Profile::kGeneric);
}

TEST_CASE("a real arm of seven joints streams through both profiles", "[measured]") {
  const std::string folder = Measured("real-iiwa7");
  if (folder.empty()) return;
  Stream(folder, Profile::kUr);
  Stream(folder, Profile::kGeneric);
}

}  // namespace
}  // namespace virtual_cell::measured_test
