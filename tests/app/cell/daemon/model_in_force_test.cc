#include "app/cell/daemon/model_in_force.h"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <fstream>

#include "app/cell/model_store/usable_model.h"
#include "tests/app/cell/daemon/demo_config.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::model_in_force_test {

using namespace plumbline::cell;
using namespace plumbline::test;

namespace {

/// A configuration in its own folder, with a model applied in place of its cell file.
struct Applied {
  TemporaryFolder folder;
  std::string file = folder.path() + "/plumbline.toml";
  std::string cell = FileText("tests/virtual_cell/demo/cockpit-cell.toml");
  config::FaultList faults;

  explicit Applied(const std::string& addition) {
    std::ofstream(file) << DemoConfig("127.0.0.1:502", "universal-robots-fine");
    REQUIRE(ReadConfigInForce(file, faults));  // its cell file is version 1
    auto store = cell::ModelStore::Open(folder.path() + "/state");
    REQUIRE(store.ok());
    REQUIRE(store.value().Propose(cell + addition, {}, "").ok());
    REQUIRE(store.value().Apply(2).ok());
  }
};

}  // namespace

TEST_CASE("sessions of an applied model leave base and tip as declared") {
  Applied applied(
      "\n[[session]]\nid = \"1\"\nbase_xyz_mm = [1.0, 2.0, 3.0]\n"
      "[[session]]\nid = \"2\"\nbase_xyz_mm = [1003.0, -2.0, 0.0]\ntip_mm = [0, 0.5, 901]\n");
  const auto in_force = ReadConfigInForce(applied.file, applied.faults);
  CAPTURE(FaultsText(applied.faults));
  REQUIRE(in_force);
  CHECK(in_force->models.applied == 2);
  const model::CellModel& cell = in_force->config.machine.cell;
  CHECK(cell.robot.X_WB.p == Vec3::Zero());
  CHECK((cell.tool.tcp_F - Vec3(0, 0, 1.2)).norm() < 1e-12);
  CHECK(cell.sessions.empty());
}

TEST_CASE("a running daemon keeps its state directory, and the model applied there") {
  Applied applied("\n# version 2\n");
  const std::string state = applied.folder.path() + "/state";
  std::ofstream(applied.file) << WithLine(DemoConfig("127.0.0.1:502", "universal-robots-fine"), "",
                                          "state_directory", "\"elsewhere\"");
  const auto in_force = ReadConfigInForce(applied.file, applied.faults, RunningDaemon{state});
  REQUIRE(in_force);
  CHECK(in_force->config.state_directory == state);
  CHECK(in_force->configured_state_directory == applied.folder.path() + "/elsewhere");
  CHECK(in_force->models.applied == 2);
  CHECK_FALSE(std::filesystem::exists(applied.folder.path() + "/elsewhere"));
}

namespace {

bool Warns(const config::FaultList& faults, const std::string& words) {
  return FaultsText(faults).find(words) != std::string::npos && !faults.HasFaults();
}

}  // namespace

TEST_CASE("with many points only some postures are checked, once") {
  Applied applied("\n# version 2\n");
  std::string text = DemoConfig("127.0.0.1:502", "universal-robots-fine");
  for (int id = 100; id < 130; ++id) {
    text += fmt::format("\n[[point]]\nid = {}\nname = \"p{}\"\nxyz_mm = [2000, 0, 1500]\n", id, id);
  }
  std::ofstream(applied.file) << text;
  const auto in_force = ReadConfigInForce(applied.file, applied.faults);
  const std::string told = FaultsText(applied.faults);
  CAPTURE(told);
  REQUIRE(in_force);
  CHECK(in_force->models.applied == 2);
  const auto at = told.find("only the postures of the first 20 points were checked;");
  REQUIRE(at != std::string::npos);
  CHECK(told.find("points were checked;", at + 40) == std::string::npos);
}

TEST_CASE("an unreadable declared version leaves the applied one in force") {
  Applied applied("\n# version 2\n");
  const std::string state = applied.folder.path() + "/state";
  std::filesystem::remove(state + "/models/0001.toml");
  const auto in_force = ReadConfigInForce(applied.file, applied.faults);
  REQUIRE(in_force);
  CHECK(in_force->models.applied == 2);
  CHECK(in_force->set_aside.empty());
  CHECK(Warns(applied.faults, "the declared version 1 cannot be read"));
}

TEST_CASE(
    "only a changed meaning of the cell file sets the applied model aside, not a changed text") {
  Applied applied("\n# version 2\n");
  const std::string state = applied.folder.path() + "/state";
  const std::string cell_file = applied.folder.path() + "/cell.toml";
  const auto declare = [&](const std::string& text) {
    std::ofstream(cell_file) << text;
    std::ofstream(applied.file) << WithLine(DemoConfig("127.0.0.1:502", "universal-robots-fine"),
                                            "", "cell", "\"" + cell_file + "\"");
    const auto in_force = ReadConfigInForce(applied.file, applied.faults);
    CAPTURE(FaultsText(applied.faults));
    REQUIRE(in_force);
    return *in_force;
  };
  const auto same = declare("# a comment\n\n" + applied.cell);
  CHECK(same.models.applied == 2);
  CHECK(same.set_aside.empty());

  const std::string edited = WithLine(applied.cell, "", "base_xyz_mm", "[0.0, 0.0, 1.5]");
  config::FaultList before_it_is_read;
  std::ofstream(cell_file) << edited;
  cell::CheckModelStore(state, cell_file, before_it_is_read);
  CHECK(Warns(before_it_is_read, "at its next start or reload the daemon sets version 2 aside"));
  for (const char* when : {"at the reload", "at a restart"}) {
    CAPTURE(when);
    const auto aside = declare(edited);
    CHECK(aside.models.applied == aside.models.declared);
    CHECK_THAT(aside.set_aside,
               Catch::Contains("model version 2 is set aside") &&
                   Catch::Contains("robot.base_xyz_mm [0, 0, 0] -> [0, 0, 1.5]") &&
                   Catch::Contains("`plumbline model apply 2 --state " + state + "`"));
  }
  config::FaultList told;
  cell::CheckModelStore(state, cell_file, told);
  CHECK(Warns(told, "model version 2 is set aside"));

  auto store = cell::ModelStore::Open(state);
  REQUIRE(store.value().Apply(3).ok());
  CHECK(declare(edited).set_aside.empty());
}

TEST_CASE("an applied model that was changed after its fit is reported, with its file") {
  Applied applied(
      "\n[domain]\nq_deg = [[-9, 9], [-9, 9], [-9, 9], [-9, 9], [-9, 9], [-9, 9]]\n"
      "residual_sigma_mm = 0.05\nfingerprint = \"0123456789abcdef\"\n");
  const std::string state = applied.folder.path() + "/state";
  config::FaultList told;
  cell::CheckModelStore(state, "", told);
  const auto in_force = ReadConfigInForce(applied.file, applied.faults);
  REQUIRE(in_force);
  CHECK(in_force->models.applied == 2);
  CHECK_FALSE(in_force->config.machine.cell.domain->as_validated);
  for (const config::FaultList* faults : {&told, &applied.faults}) {
    const std::string text = FaultsText(*faults);
    INFO(text);
    CHECK(Warns(*faults, "does not match: the model was edited after it was fitted"));
    const auto at = text.find(state + "/models/0002.toml:");
    REQUIRE(at != std::string::npos);
    CHECK(text.find("edited after it was fitted", text.find("was fitted", at) + 10) ==
          std::string::npos);
  }
}

TEST_CASE("a changed label in the cell file needs no new model") {
  Applied applied("\n# version 2\n");
  const std::string cell_file = applied.folder.path() + "/cell.toml";
  std::ofstream(cell_file) << WithLine(applied.cell, "robot", "name",
                                       "\"our arm\"\nmodel = \"KR 210\"");
  std::ofstream(applied.file) << WithLine(DemoConfig("127.0.0.1:502", "universal-robots-fine"), "",
                                          "cell", "\"" + cell_file + "\"");
  const auto in_force = ReadConfigInForce(applied.file, applied.faults);
  REQUIRE(in_force);
  CHECK(in_force->models.applied == 2);
  CHECK(in_force->config.machine.cell.robot.name == "our arm");
  CHECK(in_force->config.machine.cell.robot.identity.model == "KR 210");
}

TEST_CASE("if the store's state cannot be read, the cell file is never used in its place") {
  Applied applied("\n# version 2\n");
  const std::string state = applied.folder.path() + "/state";
  const std::string file = state + "/models/state.json";
  const std::string damage = GENERATE("missing", "", "{\"applied\": ");
  CAPTURE(damage);
  std::filesystem::remove(file);
  if (damage != "missing") std::ofstream(file) << damage;
  CHECK_FALSE(ReadConfigInForce(applied.file, applied.faults));
  config::FaultList told;
  cell::CheckModelStore(state, "", told);
  for (const config::FaultList* faults : {&applied.faults, &told}) {
    const std::string text = FaultsText(*faults);
    INFO(text);
    CHECK(faults->HasFaults());
    CHECK(text.find("it is unknown which model was in force") != std::string::npos);
    CHECK(text.find("`plumbline model apply N --state " + state + "`") != std::string::npos);
  }
  REQUIRE(cell::ModelStore::Open(state).value().Apply(2).ok());
  config::FaultList now;
  const auto in_force = ReadConfigInForce(applied.file, now);
  REQUIRE(in_force);
  CHECK(in_force->models.applied == 2);
}

TEST_CASE("correction continues without a usable or writable store") {
  Applied applied("\n# version 2\n");
  const std::string state = applied.folder.path() + "/state";
  const std::string models = state + "/models";
  SECTION("no store, and none can be created") {
    std::filesystem::remove_all(models);
    std::ofstream(models) << "a file in the way";
    const auto in_force = ReadConfigInForce(applied.file, applied.faults);
    REQUIRE(in_force);
    CHECK(in_force->models == cell::ModelState{});
    CHECK(in_force->set_aside.empty());
    CHECK(Warns(applied.faults, "models are not stored"));
  }
  // As on a full or read-only disk, the lock file cannot be opened for writing.
  const auto forbid_writing = [&models] {
    std::filesystem::remove(models + "/lock");
    std::filesystem::create_directory(models + "/lock");
  };
  SECTION("nothing to write: the applied model is in force") {
    forbid_writing();
    const auto in_force = ReadConfigInForce(applied.file, applied.faults);
    REQUIRE(in_force);
    CHECK(in_force->models.applied == 2);
    CHECK_FALSE(applied.faults.HasFaults());
  }
  SECTION("an edit that cannot be recorded: the cell file is in force, with a warning") {
    const std::string cell_file = applied.folder.path() + "/cell.toml";
    std::ofstream(cell_file) << WithLine(applied.cell, "", "base_xyz_mm", "[0.0, 0.0, 1.5]");
    std::ofstream(applied.file) << WithLine(DemoConfig("127.0.0.1:502", "universal-robots-fine"),
                                            "", "cell", "\"" + cell_file + "\"");
    forbid_writing();
    const auto in_force = ReadConfigInForce(applied.file, applied.faults);
    REQUIRE(in_force);
    CHECK(in_force->config.machine.cell.robot.X_WB.p.z() == Approx(1.5e-3));
    CHECK_THAT(in_force->set_aside, Catch::Contains("model version 2 is set aside") &&
                                        Catch::Contains("could not be recorded"));
    CHECK(Warns(applied.faults, "the model store cannot be written"));
  }
}

TEST_CASE("a reload changes nothing if the store cannot be opened and may hold a model") {
  Applied applied("\n# version 2\n");
  const std::string state = applied.folder.path() + "/state";
  const std::string models = state + "/models";
  // A link to itself cannot be followed, even by root.
  std::filesystem::rename(models, models + ".kept");
  std::filesystem::create_symlink("models", models);
  const std::string unknown = "whether a model was applied is not known: " + models;
  config::FaultList of_reload;
  CHECK_FALSE(ReadConfigInForce(applied.file, of_reload, RunningDaemon{state}));
  const std::string text = FaultsText(of_reload);
  INFO(text);
  CHECK(of_reload.HasFaults());
  CHECK_THAT(text, Catch::Contains(unknown) &&
                       Catch::Contains("The cell file is not used in its place. Make " + models));

  config::FaultList of_start;
  const auto started = ReadConfigInForce(applied.file, of_start);
  REQUIRE(started);
  CHECK(started->models == cell::ModelState{});
  CHECK_THAT(started->set_aside, Catch::Contains(unknown) && Catch::Contains("then reload"));
  CHECK(Warns(of_start, "models are not stored"));

  std::filesystem::remove(models);
  std::filesystem::rename(models + ".kept", models);
  config::FaultList now;
  const auto in_force = ReadConfigInForce(applied.file, now, RunningDaemon{state});
  REQUIRE(in_force);
  CHECK(in_force->models.applied == 2);
  CHECK(in_force->set_aside.empty());
}

TEST_CASE("a reload does not put the cell file in force if the store's file system is unmounted") {
  Applied applied("\n# version 2\n");
  const std::string state = applied.folder.path() + "/state";
  const auto started = ReadConfigInForce(applied.file, applied.faults);
  REQUIRE(started);
  const RunningDaemon at_work{state, started->models};
  std::filesystem::rename(state + "/models", state + "/models.kept");
  config::FaultList gone;
  CHECK_FALSE(ReadConfigInForce(applied.file, gone, at_work));
  INFO(FaultsText(gone));
  CHECK_THAT(FaultsText(gone), Catch::Contains("is empty, although version 2 of it is in force") &&
                                   Catch::Contains("Mount its file system again"));
  std::filesystem::remove_all(state + "/models");
  std::filesystem::rename(state + "/models.kept", state + "/models");
  config::FaultList back;
  const auto again = ReadConfigInForce(applied.file, back, at_work);
  REQUIRE(again);
  CHECK(again->models.applied == 2);
}

TEST_CASE("a store lost between two starts is reported until a version is applied") {
  Applied applied("\n# version 2\n");
  const std::string state = applied.folder.path() + "/state";
  const std::string models = state + "/models";
  const std::string used_by = GENERATE("configuration", "journal.sqlite");
  CAPTURE(used_by);
  std::ofstream(state + "/" + used_by) << applied.file << '\n';
  std::filesystem::remove_all(models);
  for (const char* when : {"at the first start without it", "at the next"}) {
    CAPTURE(when);
    const auto started = ReadConfigInForce(applied.file, applied.faults);
    REQUIRE(started);
    CHECK(started->models.applied == 1);
    CHECK(started->models.declared == 1);
    CHECK_THAT(started->set_aside,
               Catch::Contains("was found empty, although this state directory was used before") &&
                   Catch::Contains("points are corrected by the cell file") &&
                   Catch::Contains("Restore " + models + " from the backup") &&
                   Catch::Contains("`plumbline model apply 1 --state " + state + "`"));
  }
  config::FaultList of_check;
  cell::CheckModelStore(state, "", of_check);
  CHECK(Warns(of_check, "was found empty"));
  SECTION("the cell file is confirmed") {
    REQUIRE(cell::ModelStore::Open(state).value().Apply(1).ok());
    config::FaultList now;
    const auto confirmed = ReadConfigInForce(applied.file, now);
    REQUIRE(confirmed);
    CHECK(confirmed->set_aside.empty());
    CHECK(confirmed->models == cell::ModelState{1, 1, 0, {1}});
  }
  SECTION("the cell file is edited meanwhile") {
    const std::string cell_file = applied.folder.path() + "/cell.toml";
    std::ofstream(cell_file) << WithLine(applied.cell, "", "base_xyz_mm", "[0.0, 0.0, 1.5]");
    std::ofstream(applied.file) << WithLine(DemoConfig("127.0.0.1:502", "universal-robots-fine"),
                                            "", "cell", "\"" + cell_file + "\"");
    const auto edited = ReadConfigInForce(applied.file, applied.faults);
    REQUIRE(edited);
    CHECK(edited->models.applied == 2);
    CHECK_THAT(edited->set_aside, Catch::Contains("was found empty") &&
                                      Catch::Contains("`plumbline model apply 2 --state "));
  }
}

TEST_CASE("a lost store is reported even if it cannot be written; a fresh directory is not") {
  const TemporaryFolder folder;
  const std::string file = folder.path() + "/plumbline.toml", state = folder.path() + "/state";
  std::ofstream(file) << DemoConfig("127.0.0.1:502", "universal-robots-fine");
  config::FaultList faults;
  SECTION("lost") {
    std::filesystem::create_directories(state + "/models/lock");  // cannot be locked
    std::ofstream(state + "/configuration") << file << '\n';
    const auto started = ReadConfigInForce(file, faults);
    REQUIRE(started);
    CHECK_THAT(started->set_aside, Catch::Contains("was found empty"));
    CHECK(Warns(faults, "the model store cannot be written"));
  }
  SECTION("fresh") {
    const auto started = ReadConfigInForce(file, faults);
    REQUIRE(started);
    CHECK(started->set_aside.empty());
    CHECK_FALSE(started->models.set_aside);
    // The daemon records its configuration path once it has started; the next start finds
    // version 1.
    std::ofstream(state + "/configuration") << file << '\n';
    CHECK(ReadConfigInForce(file, faults)->set_aside.empty());
  }
}

TEST_CASE("nothing is recorded in a directory that another daemon owns") {
  Applied applied("\n# version 2\n");
  const std::string state = applied.folder.path() + "/state";
  const auto as_of_disk = [&state] { return FileText(state + "/models/state.json"); };
  const std::string before = as_of_disk();
  const RunningDaemon second{state, {}, false};
  config::FaultList same_cell;
  const auto same = ReadConfigInForce(applied.file, same_cell, second);
  REQUIRE(same);
  CHECK(same->models.applied == 2);

  const std::string own_cell = applied.folder.path() + "/own-cell.toml";
  std::ofstream(own_cell) << WithLine(applied.cell, "payload", "cog_mm", "[0.0, 0.0, 700.0]");
  std::string text = DemoConfig("127.0.0.1:502", "universal-robots-fine");
  std::ofstream(applied.file) << WithLine(text, "", "cell", "\"" + own_cell + "\"");
  config::FaultList other_cell;
  const auto other = ReadConfigInForce(applied.file, other_cell, second);
  INFO(FaultsText(other_cell));
  REQUIRE(other);
  CHECK(other->models == cell::ModelState{});
  CHECK(other->config.machine.cell.payload_cog_F->z() == Approx(0.7));
  CHECK(Warns(other_cell, "belongs to another cell"));
  CHECK(as_of_disk() == before);

  std::ofstream(applied.file) << text + "\n[monitoring]\nenabled = true\n";
  config::FaultList loop;
  CHECK_FALSE(ReadConfigInForce(applied.file, loop, second));
  CHECK_THAT(FaultsText(loop), Catch::Contains("[monitoring] cannot be enabled here"));
}

TEST_CASE("an unrecorded cell file that cannot be recorded leaves the applied model in force") {
  const TemporaryFolder folder;
  const std::string file = folder.path() + "/plumbline.toml";
  const std::string state = folder.path() + "/state";
  std::ofstream(file) << DemoConfig("127.0.0.1:502", "universal-robots-fine");
  {
    auto store = cell::ModelStore::Open(state);
    REQUIRE(store.ok());
    const std::string cell = FileText("tests/virtual_cell/demo/cockpit-cell.toml");
    REQUIRE(store.value().Propose(cell + "\n# version 1\n", {}, "").ok());
    REQUIRE(store.value().Apply(1).ok());
  }
  std::filesystem::remove(state + "/models/lock");
  std::filesystem::create_directory(state + "/models/lock");  // as on a full or read-only disk
  config::FaultList faults;
  const auto in_force = ReadConfigInForce(file, faults);
  INFO(FaultsText(faults));
  REQUIRE(in_force);
  CHECK(in_force->models == cell::ModelState{0, 1, 0, {1}});
  CHECK(in_force->set_aside.empty());
  CHECK(Warns(faults, "the cell file cannot be recorded in the model store"));
  CHECK(Warns(faults, "Version 1 stays in force"));
}

TEST_CASE("an applied model that the daemon cannot use is reported with its own file") {
  Applied applied(
      "\n[[effect]]\nid = \"approach_lag\"\nparameters = [ { name = \"q1\", value = 0.001 } ]\n");
  const std::string state = applied.folder.path() + "/state";
  CHECK_FALSE(ReadConfigInForce(applied.file, applied.faults));
  const std::string text = FaultsText(applied.faults);
  INFO(text);
  CHECK(text.find(state + "/models/0002.toml") != std::string::npos);
  CHECK(text.find("\"approach_lag\" depends on the robot's last moves") != std::string::npos);
  CHECK(text.find("`plumbline model rollback --state " + state + "`") != std::string::npos);
  CHECK(text.find("cockpit-cell.toml") == std::string::npos);
}

TEST_CASE("an unusable applied model is reported by `check` as by the daemon") {
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
  config::FaultList told;
  cell::CheckModelStore(state, "", told);
  for (const config::FaultList* faults : {&applied.faults, &told}) {
    const std::string text = FaultsText(*faults);
    INFO(text);
    CHECK(text.find("models/0002") != std::string::npos);
    CHECK(text.find("version 2 is in force, but cannot be used") != std::string::npos);
    CHECK(text.find("`plumbline model apply 1 --state " + state + "`") != std::string::npos);
    CHECK(text.find("cockpit-cell.toml") == std::string::npos);
  }
}

}  // namespace plumbline::model_in_force_test
