#include "app/daemon/model_in_force.h"

#include <catch2/catch.hpp>
#include <fstream>

#include "app/model_store/usable_model.h"
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

namespace {

bool Warns(const FaultList& faults, const std::string& words) {
  return FaultsText(faults).find(words) != std::string::npos && !faults.HasFaults();
}

}  // namespace

TEST_CASE("what takes an applied model out of force is told, or does not") {
  Applied applied("\n# version 2\n");
  const std::string state = applied.folder.path() + "/state";
  const std::string models = state + "/models/";
  SECTION("the declared version cannot be read: the applied one stays") {
    std::filesystem::remove(models + "0001.toml");
    const auto in_force = ReadConfigInForce(applied.file, applied.faults);
    REQUIRE(in_force);
    CHECK(in_force->models.applied == 2);
    CHECK(Warns(applied.faults, "version 1, the declared one, cannot be read"));
  }
  SECTION("nobody knows which was applied") {
    std::filesystem::remove(models + "state.json");
    const auto in_force = ReadConfigInForce(applied.file, applied.faults);
    REQUIRE(in_force);
    CHECK(in_force->models.applied == in_force->models.declared);
    CHECK(Warns(applied.faults, "which of the 2 versions was in force is not known"));
    CHECK(Warns(applied.faults, "`plumbline model apply N --state " + state + "`"));
  }
  SECTION("the cell file changed") {
    auto store = ModelStore::Open(state);
    REQUIRE(store.value().Declare("schema = 1\n# another\n", "cell.toml").ok());
    REQUIRE(store.value().Apply(2).ok());
    const auto in_force = ReadConfigInForce(applied.file, applied.faults);
    REQUIRE(in_force);
    CHECK(in_force->models.applied == in_force->models.declared);
    CHECK(Warns(applied.faults, "version 2 is no longer in force: the cell file changed"));
  }
}

TEST_CASE("an applied model that cannot be used is named, by check as by the daemon") {
  Applied applied("\n# version 2\n");
  const std::string state = applied.folder.path() + "/state";
  const std::string file = state + "/models/0002.toml";
  const std::string part = GENERATE(".toml", ".json");
  INFO(part);
  std::filesystem::permissions(file, std::filesystem::perms::owner_all);
  if (part == ".toml") {
    std::ofstream(file, std::ios::trunc).close();
  } else {
    std::filesystem::remove(state + "/models/0002.json");
  }
  CHECK_FALSE(ReadConfigInForce(applied.file, applied.faults));
  FaultList told;
  AddFaultsOfAppliedModel(state, told);
  for (const FaultList* faults : {&applied.faults, &told}) {
    const std::string text = FaultsText(*faults);
    INFO(text);
    CHECK(text.find("models/0002") != std::string::npos);
    CHECK(text.find("version 2 is in force, but cannot be used") != std::string::npos);
    CHECK(text.find("`plumbline model apply 1 --state " + state + "`") != std::string::npos);
    CHECK(text.find("cockpit-cell.toml") == std::string::npos);
  }
}
