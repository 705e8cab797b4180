#include "app/doctor/examine.h"

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "app/doctor/computer.h"
#include "tests/app/cli/shell.h"
#include "tests/app/temporary_folder.h"

using namespace plumbline;
using test::Answer;
using test::Shell;
using test::TemporaryFolder;

namespace {

struct Installation {
  Installation() {
    std::filesystem::copy("config/cells", folder.path() + "/cells");
    std::filesystem::copy("config/profiles", folder.path() + "/profiles",
                          std::filesystem::copy_options::recursive);
  }
  void Configure(const std::string& more) const {
    std::ofstream(file) << "cell = \"cells/ur10.toml\"\nstate_directory = \"state\"\n"
                        << "[robot]\nprofile = \"profiles/universal-robots.toml\"\n"
                        << "host = \"127.0.0.1\"\nport = 1\n"
                        << "[[point]]\nid = 1\nxyz_mm = [700.0, 200.0, 300.0]\n"
                        << more;
  }
  TemporaryFolder folder;
  const std::string file = folder.path() + "/plumbline.toml";
};

const CheckedThing* Of(const CheckUp& found, const std::string& what) {
  for (const CheckedThing& thing : found) {
    if (thing.what == what) return &thing;
  }
  return nullptr;
}

}  // namespace

TEST_CASE("an installation without state directory and robot has just these two faults") {
  const Installation here;
  here.Configure("");
  const CheckUp found = Examine(here.file, "no-such-user-here");
  for (const CheckedThing& thing : found) {
    INFO(thing.what << ": " << thing.told);
    const bool expected = thing.what == "state directory" || thing.what == "robot";
    CHECK((thing.health == Health::kFault) == expected);
    if (thing.health >= Health::kWarning) CHECK_FALSE(thing.remedy.empty());
  }
  REQUIRE(Of(found, "robot") != nullptr);
  CHECK_THAT(Of(found, "robot")->told, Catch::Contains("127.0.0.1:1"));
  REQUIRE(Of(found, "daemon") != nullptr);
  CHECK(Of(found, "daemon")->health == Health::kWarning);
}

TEST_CASE(
    "each fault of the configuration is a thing, and the computer is looked at all the same") {
  const Installation here;
  here.Configure("[correction]\nmax_rotation_deg = -1.0\n[plc]\nprot = 3\n");
  const CheckUp found = Examine(here.file, "no-such-user-here");
  int faults = 0;
  for (const CheckedThing& thing : found)
    faults += thing.what == "configuration" && thing.health == Health::kFault;
  CHECK(faults == 2);
  CHECK(Of(found, "clock") != nullptr);
}

TEST_CASE("who may give commands is told, and what to do where that is everybody") {
  const Installation here;
  for (const auto& [plc, health] :
       {std::pair("[plc]\nlisten = \"0.0.0.0\"\n", Health::kWarning),
        std::pair("[plc]\nlisten = \"0.0.0.0\"\nallow = [\"192.168.0.10\"]\n", Health::kGood)}) {
    here.Configure(plc);
    const CheckUp found = Examine(here.file, "root");
    const CheckedThing* const access = Of(found, "plc access");
    REQUIRE(access != nullptr);
    CHECK(access->health == health);
    if (health == Health::kWarning) CHECK_THAT(access->remedy, Catch::Contains("[plc]"));
  }
}

TEST_CASE("a camera that is not plugged in is a fault with a remedy") {
  const Installation here;
  std::filesystem::copy("config/bodies.toml", here.folder.path() + "/bodies.toml");
  here.Configure(
      "[camera]\nkind = \"v4l2\"\ndevice = \"NO-SUCH-SERIAL\"\n[tags]\nfile = \"bodies.toml\"\n");
  const CheckUp found = Examine(here.file, "root");
  const CheckedThing* const camera = Of(found, "camera");
  REQUIRE(camera != nullptr);
  CHECK(camera->health == Health::kFault);
  CHECK_THAT(camera->told, Catch::Contains("NO-SUCH-SERIAL"));
  CHECK_THAT(camera->remedy, Catch::Contains("plumbline cameras"));
}

TEST_CASE("room on the disk and the kind of file system count") {
  const TemporaryFolder folder;
  CHECK(LookAtState(folder.path(), AccountOf("root")).health != Health::kNotLooked);
  CHECK(LookAtState("/proc", AccountOf("root")).health == Health::kFault);
  CHECK(LookAtState("/nonexistent", AccountOf("root")).health == Health::kFault);
  CHECK(LookAtJournal("/nonexistent").health == Health::kWarning);
  CHECK(LookAtJournal(folder.path()).health == Health::kGood);
}

TEST_CASE("the command answers by its exit code") {
  const Installation here;
  here.Configure("");
  const Answer answer = Shell("doctor " + here.file + " --json");
  CHECK(answer.exit_code == 1);
  CHECK_THAT(answer.told, Catch::Contains("\"what\": \"robot\""));
  const Answer by_name = Shell("doctor --config " + here.file + " --json");
  CHECK(by_name.exit_code == 1);
  CHECK_THAT(by_name.told, Catch::Contains("\"what\": \"robot\""));
}

TEST_CASE("a broker that is not there, and a password that everybody reads, are told") {
  const Installation here;
  here.Configure("[mqtt]\nhost = \"127.0.0.1\"\nport = 1\n");
  const CheckUp found = Examine(here.file, "no-such-user-here");
  const CheckedThing* const broker = Of(found, "broker");
  REQUIRE(broker != nullptr);
  CHECK(broker->health == Health::kFault);
  CHECK_THAT(broker->told, Catch::Contains("127.0.0.1:1: Connection refused"));
  CHECK_FALSE(broker->remedy.empty());
  here.Configure(
      "[mqtt]\nhost = \"127.0.0.1\"\nport = 1\nusername = \"u\"\npassword_file = \"none\"\n");
  const CheckUp other = Examine(here.file, "no-such-user-here");
  CHECK_THAT(Of(other, "broker")->told, Catch::Contains("none"));
}
