#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "app/base/config/mqtt_config.h"
#include "app/base/config/named_files.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::mqtt_reader_test {

using namespace plumbline::config;

namespace {

struct ReadMqtt {
  FaultList faults;
  MqttConfig mqtt;

  explicit ReadMqtt(const std::string& lines, const std::string& cell = "UR10") {
    TomlDocument document("[mqtt]\n" + lines, "/etc/plumbline.toml", faults);
    REQUIRE(document.parsed());
    const FileSource files = [](const std::string&) {
      return Result<std::string>(Error{"none is opened"});
    };
    mqtt = MqttFromToml(*document.Root().RequiredTable("mqtt"),
                        NamedFiles("/etc/plumbline.toml", files, "/data"), cell);
    document.ReportUnknownKeys();
  }
  std::string Told() const { return FaultsText(faults); }
};

}  // namespace

TEST_CASE("[mqtt]: every key is read, in SI; file names are relative to the configuration") {
  const ReadMqtt read(
      "host = \"broker.plant.lan\"\nport = 8884\ntls_ca = \"ca.pem\"\nusername = \"cell-7\"\n"
      "password_file = \"/run/secret\"\ngroup = \"hall 3\"\nnode = \"cell-7\"\n"
      "client_id = \"c7\"\nstate_s = 2.0\nchange_s = 0.5\npoint_change_mm = 0.1\nqueue_mb = 5\n"
      "repeat_s = 60.0\npage_url = \"https://cell7:8443/\"\njournal = false\n");
  INFO(read.Told());
  CHECK(read.faults.All().empty());
  CHECK(read.mqtt.host == "broker.plant.lan");
  CHECK(read.mqtt.port == 8884);
  CHECK(read.mqtt.tls_ca == "/etc/ca.pem");
  CHECK(read.mqtt.username == "cell-7");
  CHECK(read.mqtt.password_file == "/run/secret");
  CHECK(read.mqtt.group == "hall 3");
  CHECK(read.mqtt.node == "cell-7");
  CHECK(read.mqtt.client_id == "c7");
  CHECK(read.mqtt.state_period_s == 2);
  CHECK(read.mqtt.change_period_s == 0.5);
  CHECK(read.mqtt.point_change_m == Approx(1e-4));
  CHECK(read.mqtt.queue_bytes == 5'000'000);
  CHECK(read.mqtt.repeat_s == 60);
  CHECK(read.mqtt.page_url == "https://cell7:8443/");
  CHECK_FALSE(read.mqtt.journal);
}

TEST_CASE("[mqtt] with only a host: node and client id come from the cell, TLS from tls_ca") {
  const ReadMqtt read("host = \"10.0.0.5\"\n", "KR 210/left #2");
  CHECK(read.faults.All().empty());
  CHECK(read.mqtt.port == 1883);
  CHECK(read.mqtt.node == "KR 210-left -2");
  CHECK(read.mqtt.client_id == "plumbline-plumbline-KR 210-left -2");
  CHECK(ReadMqtt("host = \"10.0.0.5\"\ntls_ca = \"ca.pem\"\n").mqtt.port == 8883);
}

TEST_CASE("[mqtt]: page_url is a web address, which the plant's page may link to") {
  for (const char* url : {"javascript:alert(1)", "cell7:8443", "http://a b/", "http://<x>/"}) {
    const ReadMqtt read(std::string("host = \"b\"\npage_url = \"") + url + "\"\n");
    CHECK_THAT(read.Told(),
               Catch::Contains("mqtt.page_url: ") && Catch::Contains("is not a web address"));
  }
}

TEST_CASE("[mqtt]: a password file that every user may read is warned about") {
  const test::TemporaryFolder folder;
  const std::string file = folder.path() + "/password";
  std::ofstream(file) << "topsecret\n";
  const std::string lines =
      "host = \"b\"\nusername = \"u\"\ntls_ca = \"ca.pem\"\npassword_file = \"" + file + "\"\n";
  using std::filesystem::perms;
  std::filesystem::permissions(file, perms::owner_read | perms::others_read);
  const ReadMqtt open(lines);
  CHECK_FALSE(open.faults.HasFaults());
  CHECK_THAT(open.Told(), Catch::Contains("mqtt.password_file: warning: ") &&
                              Catch::Contains("is readable by every user of this computer") &&
                              Catch::Contains("restrict it: chmod o-r " + file) &&
                              !Catch::Contains("topsecret"));
  std::filesystem::permissions(file, perms::owner_read | perms::group_read);
  CHECK(ReadMqtt(lines).faults.All().empty());
}

TEST_CASE("[mqtt]: faults have place and remedy, and none contains a password") {
  using Catch::Contains;
  CHECK_THAT(ReadMqtt("port = 1883\n").Told(), Contains("mqtt.host"));
  CHECK_THAT(ReadMqtt("host = \"mqtt://broker\"\n").Told(),
             Contains("plumbline.toml:2 mqtt.host: \"mqtt://broker\" is not a plain host name"));
  CHECK_THAT(ReadMqtt("host = \"b\"\nport = 0\n").Told(),
             Contains("mqtt.port: 0 is outside 1..65535"));
  CHECK_THAT(ReadMqtt("host = \"b\"\nnode = \"a/b\"\n").Told(), Contains("without / + #"));
  CHECK_THAT(ReadMqtt("host = \"b\"\nqueue_mb = 0\n").Told(), Contains("outside 1..100000"));
  CHECK_THAT(ReadMqtt("host = \"b\"\npassword_file = \"p\"\n").Told(),
             Contains("needs a username"));
  CHECK_THAT(ReadMqtt("host = \"b\"\nusername = \"u\"\npassword_file = \"p\"\n").Told(),
             Contains("warning") && Contains("unencrypted"));
  const std::string told = ReadMqtt("host = \"b\"\npassword = \"topsecret\"\n").Told();
  CHECK_THAT(told, Contains("password_file") && !Contains("topsecret"));
  CHECK_THAT(ReadMqtt("host = \"b\"\nhots = \"c\"\n").Told(), Contains("hots"));
}

}  // namespace plumbline::mqtt_reader_test
