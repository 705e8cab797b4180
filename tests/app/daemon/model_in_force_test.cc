#include "app/daemon/model_in_force.h"

#include <catch2/catch.hpp>
#include <fstream>

#include "tests/app/daemon/demo_config.h"
#include "tests/app/temporary_folder.h"

using namespace plumbline;
using namespace plumbline::test;

namespace {

/// A configuration in a folder of its own, with that model applied in place of its cell file.
struct Applied {
  TemporaryFolder folder;
  std::string file = folder.path() + "/plumbline.toml";
  std::string cell = FileText("tests/virtual_cell/demo/cockpit-cell.toml");
  FaultList faults;

  explicit Applied(const std::string& addition) {
    std::ofstream(file) << DemoConfig("127.0.0.1:502", "universal-robots-fine");
    REQUIRE(ReadConfigInForce(file, faults));  // its cell file is version 1
    auto store = ModelStore::Open(folder.path() + "/state");
    REQUIRE(store.ok());
    REQUIRE(store.value().Propose(cell + addition, {}, "").ok());
    REQUIRE(store.value().Apply(2).ok());
  }
};

}  // namespace

TEST_CASE("base and tip of an applied model are those of its last session") {
  Applied applied(
      "\n[[session]]\nid = \"1\"\nbase_xyz_mm = [1.0, 2.0, 3.0]\n"
      "[[session]]\nid = \"2\"\nbase_xyz_mm = [1003.0, -2.0, 0.0]\ntip_mm = [0, 0.5, 901]\n");
  const auto in_force = ReadConfigInForce(applied.file, applied.faults);
  CAPTURE(FaultsText(applied.faults));
  REQUIRE(in_force);
  CHECK(in_force->models.applied == 2);
  const CellModel& cell = in_force->config.machine.cell;
  CHECK((cell.robot.X_WB.p - Vec3(1.003, -0.002, 0)).norm() < 1e-12);
  CHECK((cell.tool.tcp_F - Vec3(0, 0.0005, 0.901)).norm() < 1e-12);
}

TEST_CASE("a daemon at work keeps its state directory, and the model that is applied there") {
  Applied applied("\n# version 2\n");
  const std::string state = applied.folder.path() + "/state";
  std::ofstream(applied.file) << WithLine(DemoConfig("127.0.0.1:502", "universal-robots-fine"), "",
                                          "state_directory", "\"elsewhere\"");
  const auto in_force = ReadConfigInForce(applied.file, applied.faults, state);
  REQUIRE(in_force);
  CHECK(in_force->config.state_directory == state);
  CHECK(in_force->asked_state_directory == applied.folder.path() + "/elsewhere");
  CHECK(in_force->models.applied == 2);
  CHECK_FALSE(std::filesystem::exists(applied.folder.path() + "/elsewhere"));
}
