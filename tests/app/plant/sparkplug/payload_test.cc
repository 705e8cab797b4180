#include "app/plant/sparkplug/payload.h"

#include <catch2/catch.hpp>

#include "app/plant/sparkplug/sparkplug_config.h"

namespace plumbline::plant {
namespace {

/// Metric `name` of type Boolean, as a host encodes it.
std::string WriteOf(const std::string& name, bool value) {
  const std::string metric = "\x0a" + std::string(1, static_cast<char>(name.size())) + name +
                             "\x20\x0b\x70" + std::string(1, value ? '\x01' : '\0');
  return "\x08\x01\x12" + std::string(1, static_cast<char>(metric.size())) + metric;
}

TEST_CASE("A death contains bdSeq alone, without a sequence number") {
  const std::string expected =
      "\x08\x05"  // timestamp
      "\x12\x0d\x0a\x05"
      "bdSeq"
      "\x18\x05\x20\x04\x58\x03";  // name, timestamp, Int64, long value
  CHECK(NodeDeath(3, 5) == expected);
}

TEST_CASE("Only a true Node Control/Rebirth asks for a birth") {
  const auto rebirth = CommandFromPayload(WriteOf("Node Control/Rebirth", true));
  REQUIRE(rebirth);
  CHECK((rebirth->rebirth && rebirth->ignored.empty()));
  const auto declined = CommandFromPayload(WriteOf("Node Control/Rebirth", false));
  REQUIRE(declined);
  CHECK_FALSE(declined->rebirth);
  const auto other = CommandFromPayload(WriteOf("Model/In force", true));
  REQUIRE(other);
  CHECK((!other->rebirth && other->ignored == std::vector<std::string>{"Model/In force"}));
  CHECK_FALSE(CommandFromPayload("\xff\xff"));
  CHECK_FALSE(CommandFromPayload(std::string(kMaxCommand_bytes + 1, '\0')));
}

TEST_CASE("A host's STATE needs both members") {
  const auto state = HostStateFromText(R"({"online":true,"timestamp":12})");
  REQUIRE(state);
  CHECK((state->online && state->utc_ms == 12));
  for (const char* other : {"", "ONLINE", "{}", R"({"online":1,"timestamp":1})",
                            R"({"online":true})", R"({"online":true,"timestamp":"1"})"}) {
    CHECK_FALSE(HostStateFromText(other));
  }
}

std::string FaultsOf(const std::string& text) {
  config::FaultList faults;
  SparkplugConfigFromText(text, "/nowhere/plant.toml", faults);
  return config::FaultsText(faults);
}

TEST_CASE("Without a broker of its own, Sparkplug uses that of the cells") {
  config::FaultList faults;
  const auto config = SparkplugConfigFromText(
      "[broker]\nhost = \"b\"\ntls_ca = \"ca.pem\"\n[sparkplug]\nprimary_host = \"scada\"\n",
      "/etc/plumbline/plant.toml", faults);
  REQUIRE(config);
  CHECK((config->hosts.host == "b" && config->hosts.port == 8883));
  CHECK(config->cells.tls_ca == "/etc/plumbline/ca.pem");
  CHECK((config->primary_host == "scada" && config->max_nodes == 2000));
  const auto two = SparkplugConfigFromText(
      "[broker]\nhost = \"b\"\n[sparkplug.broker]\nhost = \"h\"\nport = 1884\n", "plant.toml",
      faults);
  REQUIRE(two);
  CHECK((two->cells.host == "b" && two->hosts.host == "h" && two->hosts.port == 1884));
}

TEST_CASE("Faults of the configuration are named with line and key") {
  CHECK(FaultsOf("[broker]\nprot = 1\n").find(":2 broker.prot") != std::string::npos);
  CHECK(FaultsOf("[broker]\nhost = \"a\"\npassword = \"secret\"\n").find("secret") ==
        std::string::npos);
  CHECK(FaultsOf("[broker]\nhost = \"a\"\npassword = \"secret\"\n").find("password_file") !=
        std::string::npos);
  CHECK(FaultsOf("[broker]\nhost = \"a\"\n[sparkplug]\nmax_nodes = 0\n").find("max_nodes") !=
        std::string::npos);
  CHECK(FaultsOf("[broker]\nhost = \"a\"\n[sparkplug]\nprimary_host = \"a/b\"\n")
            .find("primary_host") != std::string::npos);
  CHECK(FaultsOf("[broker]\nhost = \"a\"\n[database]\nuri = \"x\"\n").empty());
}

}  // namespace
}  // namespace plumbline::plant
