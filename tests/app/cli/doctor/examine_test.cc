#include "app/cli/doctor/examine.h"

#include <sys/socket.h>
#include <sys/un.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "app/base/config/daemon_config_reader.h"
#include "app/base/text/json_text.h"
#include "app/cell/journal/journal.h"
#include "app/cell/view_link/view_client.h"
#include "drivers/os/descriptor.h"
#include "tests/app/cli/shell.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::examine_test {

using namespace plumbline::cli;
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

const CheckResult* Of(const CheckResults& found, const std::string& subject) {
  for (const CheckResult& result : found) {
    if (result.subject == subject) return &result;
  }
  return nullptr;
}

}  // namespace

TEST_CASE("a missing state directory and robot are the only two faults reported") {
  const Installation here;
  here.Configure("");
  const CheckResults found = Examine(here.file, "no-such-user-here");
  for (const CheckResult& result : found) {
    INFO(result.subject << ": " << result.finding);
    const bool expected = result.subject == "state directory" || result.subject == "robot";
    CHECK((result.health == Health::kFault) == expected);
    if (result.health >= Health::kWarning) CHECK_FALSE(result.remedy.empty());
  }
  REQUIRE(Of(found, "robot") != nullptr);
  CHECK_THAT(Of(found, "robot")->finding, Catch::Contains("127.0.0.1:1"));
  REQUIRE(Of(found, "daemon") != nullptr);
  CHECK(Of(found, "daemon")->health == Health::kWarning);
}

TEST_CASE("each fault of the configuration is a result, and the computer is checked nevertheless") {
  const Installation here;
  here.Configure("[correction]\nmax_rotation_deg = -1.0\n[plc]\nprot = 3\n");
  const CheckResults found = Examine(here.file, "no-such-user-here");
  int faults = 0;
  for (const CheckResult& result : found)
    faults += result.subject == "configuration" && result.health == Health::kFault;
  CHECK(faults == 2);
  CHECK(Of(found, "clock") != nullptr);
}

TEST_CASE("PLC access open to everybody is a warning with a remedy") {
  const Installation here;
  for (const auto& [plc, health] :
       {std::pair("[plc]\nlisten = \"0.0.0.0\"\n", Health::kWarning),
        std::pair("[plc]\nlisten = \"0.0.0.0\"\nallow = [\"192.168.0.10\"]\n", Health::kGood)}) {
    here.Configure(plc);
    const CheckResults found = Examine(here.file, "root");
    const CheckResult* const access = Of(found, "plc access");
    REQUIRE(access != nullptr);
    CHECK(access->health == health);
    if (health == Health::kWarning) CHECK_THAT(access->remedy, Catch::Contains("[plc]"));
  }
}

TEST_CASE("a camera that is not connected is a fault with a remedy") {
  const Installation here;
  std::filesystem::copy("config/bodies.toml", here.folder.path() + "/bodies.toml");
  here.Configure(
      "[camera]\nkind = \"v4l2\"\ndevice = \"NO-SUCH-SERIAL\"\n[tags]\nfile = \"bodies.toml\"\n");
  const CheckResults found = Examine(here.file, "root");
  const CheckResult* const camera = Of(found, "camera");
  REQUIRE(camera != nullptr);
  CHECK(camera->health == Health::kFault);
  CHECK_THAT(camera->finding, Catch::Contains("NO-SUCH-SERIAL"));
  CHECK_THAT(camera->remedy, Catch::Contains("plumbline cameras"));
}

TEST_CASE("a zoom camera in the network is asked; the remedy speaks of the network") {
  for (const auto& [transport, port] : {std::pair("udp", "UDP"), {"tcp", "TCP"}}) {
    config::ZoomConfig zoom;
    zoom.kind = "visca";
    zoom.connection.visca.device = "127.0.0.1:1";  // nobody listens
    zoom.connection.visca.transport = transport;
    const CheckResult found = CheckZoomSensor(zoom, AccountByName("root"));
    CHECK(found.health == Health::kFault);
    CHECK_THAT(found.finding, Catch::Contains("127.0.0.1:1") &&
                                  Catch::Contains(std::string("refuses ") + port + " port 1"));
    CHECK_THAT(found.remedy, Catch::Contains("Enable VISCA over IP in the camera"));
  }
}

TEST_CASE("beside a daemon, neither the robot nor a zoom camera in the network is asked") {
  const Installation here;
  here.Configure("");
  config::FaultList faults;
  const auto config = config::ReadDaemonConfig(here.file, faults);
  REQUIRE(config);
  std::filesystem::create_directory(config->state_directory);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string path = cell::ViewSocketOf(config->state_directory);
  REQUIRE(path.size() < sizeof address.sun_path);
  path.copy(address.sun_path, path.size());
  const os::Descriptor listener(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
  REQUIRE(bind(listener.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  REQUIRE(listen(listener.get(), 1) == 0);
  bool runs = false;
  const CheckResults found = CheckDaemon(*config, runs);
  CHECK(runs);
  REQUIRE(Of(found, "robot") != nullptr);
  CHECK(Of(found, "robot")->health == Health::kNotChecked);
  config::ZoomConfig zoom;
  zoom.kind = "visca";
  zoom.connection.visca.device = "127.0.0.1:1";
  zoom.connection.visca.transport = "udp";
  CHECK(CheckZoomSensor(zoom, AccountByName("root"), runs).health == Health::kNotChecked);
}

TEST_CASE("a HID gauge that is not connected is a fault with a remedy") {
  config::GaugeConfig gauge;
  gauge.artefact = "dial";
  gauge.connection.kind = gauge::GaugeKind::kHid;
  gauge.connection.hid = {0xF00D, 0x2F03, ""};
  const CheckResult found = CheckGauge(gauge, AccountByName("root"));
  CHECK(found.health == Health::kFault);
  CHECK(found.subject == "gauge dial");
  CHECK(found.finding == "HID F00D:2F03 is not connected");
  CHECK_THAT(found.remedy, Catch::Contains("lsusb"));
}

TEST_CASE("free space, file system and existence of the state directory are checked") {
  const TemporaryFolder folder;
  CHECK(CheckStateDirectory(folder.path(), AccountByName("root")).health != Health::kNotChecked);
  CHECK(CheckStateDirectory("/proc", AccountByName("root")).health == Health::kFault);
  CHECK(CheckStateDirectory("/nonexistent", AccountByName("root")).health == Health::kFault);
  CHECK(CheckSystemJournal("/nonexistent").health == Health::kWarning);
  CHECK(CheckSystemJournal(folder.path()).health == Health::kGood);
}

TEST_CASE("plumbline doctor reports faults in its exit code") {
  const Installation here;
  here.Configure("");
  const Answer answer = Shell("doctor " + here.file + " --json");
  CHECK(answer.exit_code == 1);
  CHECK_THAT(answer.output, Catch::Contains("\"what\": \"robot\""));
  const Answer by_name = Shell("doctor --config " + here.file + " --json");
  CHECK(by_name.exit_code == 1);
  CHECK_THAT(by_name.output, Catch::Contains("\"what\": \"robot\""));
  for (const auto& result : text::JsonOrNull(answer.output)) {
    CHECK_FALSE(result.at("detail").get<std::string>().empty());
    CHECK(result.at("told") == result.at("detail"));
  }
}

TEST_CASE("the doctor finds the damaged rows of a journal") {
  const test::TemporaryFolder folder;
  CHECK(CheckJournal(folder.path()).empty());
  const std::string file = folder.path() + "/journal.sqlite";
  const std::vector<model::Joint> joints(1);
  {
    auto journal = cell::Journal::Open(file);
    REQUIRE(journal);
    cell::JournalRow row;
    row.q = model::JointVector::Zero(1);
    REQUIRE(journal.value().Append({row, row, row}, joints));
  }
  REQUIRE(CheckJournal(folder.path()).size() == 1);
  CHECK(CheckJournal(folder.path()).front().health == Health::kGood);
  {
    auto database = sqlite::Database::Open(file, sqlite::Database::Mode::kWrite);
    REQUIRE(database);
    REQUIRE(database.value().Run("UPDATE measurement SET session = 'x' WHERE id = 2"));
  }
  const CheckResults found = CheckJournal(folder.path());
  REQUIRE(found.size() == 1);
  CHECK(found.front().health == Health::kFault);
  CHECK_THAT(found.front().finding, Catch::Contains("row 2 changed since written"));
  CHECK_THAT(found.front().remedy, Catch::Contains("plumbline journal salvage"));
}

TEST_CASE("an unreachable broker and a missing password file are faults") {
  const Installation here;
  here.Configure("[mqtt]\nhost = \"127.0.0.1\"\nport = 1\n");
  const CheckResults found = Examine(here.file, "no-such-user-here");
  const CheckResult* const broker = Of(found, "broker");
  REQUIRE(broker != nullptr);
  CHECK(broker->health == Health::kFault);
  CHECK_THAT(broker->finding, Catch::Contains("127.0.0.1:1: Connection refused"));
  CHECK_FALSE(broker->remedy.empty());
  here.Configure(
      "[mqtt]\nhost = \"127.0.0.1\"\nport = 1\nusername = \"u\"\npassword_file = \"none\"\n");
  const CheckResults other = Examine(here.file, "no-such-user-here");
  CHECK_THAT(Of(other, "broker")->finding, Catch::Contains("none"));
}

}  // namespace plumbline::examine_test
