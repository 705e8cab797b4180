// The cells of config/cells, and the measured cells if available, are read without faults.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <iostream>

#include "app/base/config/cell_reader.h"
#include "tests/app/base/config/wrong_line.h"

namespace plumbline::ready_cells_test {

using namespace plumbline::config;

namespace {

TEST_CASE("Every supplied cell is read without faults") {
  const std::vector<std::pair<std::string, int>> cells = {
      {"ur5", 6},    {"ur10", 6},  {"ur10-typical", 6}, {"kr210", 6},
      {"irb120", 6}, {"iiwa7", 7}, {"xarm6", 6}};
  for (const auto& [name, joints] : cells) {
    FaultList faults;
    const auto cell = ReadCell("config/cells/" + name + ".toml", faults);
    CAPTURE(name, FaultsText(faults));
    REQUIRE(cell);
    CHECK(faults.All().empty());
    CHECK(cell->robot.size() == joints);
    for (const model::Joint& joint : cell->robot.joints) CHECK(joint.max - joint.min > 1);
  }
}

TEST_CASE("Every file of config/cells is a cell") {
  for (const auto& entry : std::filesystem::directory_iterator("config/cells")) {
    if (entry.path().extension() != ".toml") continue;
    FaultList faults;
    ReadCell(entry.path().string(), faults);
    CAPTURE(FaultsText(faults));
    CHECK_FALSE(faults.HasFaults());
  }
}

TEST_CASE("Every measured cell is read without faults", "[measured]") {
  const char* given = std::getenv("PLUMBLINE_MEASURED");
  const std::filesystem::path measured = given != nullptr ? given : "../shared/measured";
  if (!std::filesystem::is_directory(measured)) {
    WARN("SKIPPED: no folder " << measured.string() << "; set PLUMBLINE_MEASURED");
    std::cout << "SKIPPED: no measured cells\n";
    return;
  }
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(measured)) {
    const auto file = entry.path() / "cell.toml";
    if (!std::filesystem::exists(file)) continue;
    FaultList faults;
    const bool read = ReadCell(file.string(), faults).has_value();
    CAPTURE(FaultsText(faults));
    CHECK(read);
    CHECK_FALSE(faults.HasFaults());
    ++count;
  }
  CHECK(count > 0);
}

}  // namespace
}  // namespace plumbline::ready_cells_test
