// The broker configuration of config/plant with a real publisher, and with a cell that lies.
#include <filesystem>

#include "app/plant/rights/rights.h"
#include "tests/app/plant/broker/certificates.h"
#include "tests/app/plant/publish/fleet_station.h"
#include "tests/app/plant/rights/plant_client.h"

namespace plumbline::rights_process_test {

using namespace plumbline::plant;
using namespace plumbline::test;

namespace {

constexpr const char* kHonest = "hall 3/cell-7";
constexpr const char* kLiar = "line/cell-8";

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  REQUIRE(text.find(from) != std::string::npos);
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  return text;
}

/// The supplied files in a folder, with passwords, certificates and ports of their own. The
/// password of each user is "secret of USER".
struct PlantBroker {
  TemporaryFolder folder;
  const int cells_port = FreePort(), plant_port = FreePort();
  std::vector<std::string> users = {kHonest, kLiar};  ///< admitted at its start
  std::string passwords;
  std::optional<BrokerProcess> process;

  static std::string SecretOf(const std::string& user) { return "secret of " + user; }

  /// @return  false if something is not installed here
  bool Start() {
    if (MosquittoProgram().empty()) {
      WARN("SKIPPED: no mosquitto here (apt install mosquitto)");
      return false;
    }
    const std::string at = folder.path();
    if (!MakeAuthority(at, "plant-ca") || !MakeBrokerCertificate(at, "plant-ca")) {
      WARN("SKIPPED: no openssl here to make certificates with");
      return false;
    }
    for (const std::string& user : users) Admit(user);
    std::string services;
    for (const char* user : {"collect", "sparkplug"}) {
      services = WithPasswordLine(services, *PasswordLine(user, SecretOf(user)));
    }
    std::ofstream(at + "/plant.passwd") << services;
    std::filesystem::copy("config/plant/plant.acl", at + "/plant.acl");
    std::string text = FileText("config/plant/mosquitto.conf");
    text = Replaced(text, "/etc/mosquitto/plumbline/", at + "/");
    text = Replaced(text, "/run/mosquitto/", at + "/");
    text = Replaced(text, "/var/lib/mosquitto/", at + "/");
    text = Replaced(text, "log_dest syslog", "log_dest stderr\nuser root");
    text = Replaced(text, "listener 8883", fmt::format("listener {} 127.0.0.1", cells_port));
    text = Replaced(text, "listener 8884", fmt::format("listener {} 127.0.0.1", plant_port));
    process.emplace(text, plant_port);  // opened last
    return true;
  }
  /// As `plumbline plant cell add` does.
  void Admit(const std::string& user) {
    passwords = WithPasswordLine(passwords, *PasswordLine(user, SecretOf(user)));
    std::ofstream(folder.path() + "/cells.passwd") << passwords;
    const BrokerUsers known = UsersIn(passwords);
    std::ofstream(folder.path() + "/cells.acl") << AclText(known.cells, known.bridged_groups);
  }
  PlantClient::Options Of(const std::string& user, const std::string& client_id = "") const {
    return {.port = cells_port,
            .client_id = client_id.empty() ? user : client_id,
            .user = user,
            .password = SecretOf(user),
            .ca = folder.path() + "/plant-ca.pem"};
  }
  PlantClient::Options OfPlant(const std::string& user) const {
    auto options = Of(user);
    options.port = plant_port;
    return options;
  }
  std::string StationLines() const {
    std::ofstream(folder.path() + "/password") << SecretOf(kHonest) << "\n";
    return fmt::format(
        "port = {}\ntls_ca = \"{}/plant-ca.pem\"\nusername = \"{}\"\npassword_file = "
        "\"{}/password\"\ngroup = \"hall 3\"\n",
        cells_port, folder.path(), kHonest, folder.path());
  }
};

constexpr const char* kAll = "plumblineV1/#";

}  // namespace

TEST_CASE("a cell that lies about its name, reads, or sends a megabyte harms nobody") {
  PlantBroker broker;
  if (!broker.Start()) return;
  PlantClient collector(broker.OfPlant("collect"));
  REQUIRE(collector.Subscribe(kAll));
  FleetStation station(broker.StationLines());
  station.Start();
  INFO(station.Log());
  INFO(broker.process->Log());
  REQUIRE(collector.Hears("plumblineV1/hall 3/NBIRTH/cell-7"));
  REQUIRE(collector.Hears("plumblineV1/hall 3/NDATA/cell-7"));

  auto options = broker.Of(kLiar);
  options.will_topic = "plumblineV1/hall 3/NDEATH/cell-7";
  PlantClient liar(options);
  REQUIRE(liar.Connected());
  int marks = 0;
  // Its own messages arrive, in order: what it sent before has then been refused.
  const auto settled = [&] {
    const std::string mark = fmt::format("{{\"mark\":{}}}", ++marks);
    REQUIRE(liar.Publish("plumblineV1/line/NPROBE/cell-8", mark));
    REQUIRE(Soon([&] { return collector.Count("plumblineV1/line/NPROBE/cell-8", mark) == 1; }));
  };
  for (const char* topic : {"plumblineV1/hall 3/NPROBE/cell-7", "plumblineV1/line/NPROBE/cell-9",
                            "plumblineV1/line/NPROBE/cell-8/x", "plumblineV1/line/NPROBE",
                            "plumblineV1/other/NDATA/cell-8", "spBv1.0/line/NDATA/cell-8",
                            "$SYS/broker/version", "anything"}) {
    REQUIRE(liar.Publish(topic, "forged"));
  }
  settled();
  CHECK(collector.Count("", "forged") == 0);

  // A subscription is accepted, but nothing is delivered, not even what is retained.
  for (const char* filter : {"#", "plumblineV1/#", "$SYS/#", "$share/collect/plumblineV1/#",
                             "plumblineV1/hall 3/NBIRTH/cell-7", "plumblineV1/line/+/cell-8"}) {
    static_cast<void>(liar.Subscribe(filter));
  }
  const std::size_t states = collector.Count("plumblineV1/hall 3/NDATA/cell-7");
  REQUIRE(Soon([&] { return collector.Count("plumblineV1/hall 3/NDATA/cell-7") >= states + 3; }));
  settled();
  CHECK(liar.Count() == 0);

  // The connection is closed; its will, in another's name, is refused as well.
  static_cast<void>(liar.Publish("plumblineV1/line/NPROBE/cell-8", std::string(1'000'000, 'x')));
  REQUIRE(Soon([&] { return !liar.Connected(); }));
  CHECK(Soon([&] { return broker.process->Log().find(kLiar) != std::string::npos; }));
  station.AddProbes(5);
  REQUIRE(Soon([&] { return collector.Count("plumblineV1/hall 3/NPROBE/cell-7") == 5; }));
  CHECK(collector.Count("plumblineV1/hall 3/NDEATH/cell-7") == 0);
  CHECK(collector.Longest() < 10'000);
  CHECK(station.Log().find("messages are queued meanwhile") == std::string::npos);
}

TEST_CASE("a cell cannot take another's connection by its client id, name or password") {
  PlantBroker broker;
  if (!broker.Start()) return;
  PlantClient collector(broker.OfPlant("collect"));
  REQUIRE(collector.Subscribe(kAll));
  FleetStation station(broker.StationLines());
  station.Start();
  INFO(station.Log());
  REQUIRE(collector.Hears("plumblineV1/hall 3/NBIRTH/cell-7"));
  for (const char* id : {kHonest, "plumbline-hall 3-cell-7"}) {
    PlantClient thief(broker.Of(kLiar, id));
    REQUIRE(thief.Connected());
    REQUIRE(thief.Publish("plumblineV1/line/NPROBE/cell-8", id));
    REQUIRE(Soon([&] { return collector.Count("plumblineV1/line/NPROBE/cell-8", id) == 1; }));
  }
  auto wrong = broker.Of(kHonest);
  wrong.password = "guessed";
  CHECK_FALSE(PlantClient(wrong).Connected());
  wrong.user.clear();
  CHECK_FALSE(PlantClient(wrong).Connected());
  auto elsewhere = broker.OfPlant(kLiar);
  CHECK_FALSE(PlantClient(elsewhere).Connected());
  CHECK_FALSE(PlantClient(broker.Of("collect")).Connected());
  auto plain = broker.Of(kLiar);
  plain.ca.clear();
  CHECK_FALSE(PlantClient(plain).Connected());
  const std::size_t states = collector.Count("plumblineV1/hall 3/NDATA/cell-7");
  REQUIRE(Soon([&] { return collector.Count("plumblineV1/hall 3/NDATA/cell-7") >= states + 3; }));
  CHECK(collector.Count("plumblineV1/hall 3/NDEATH/cell-7") == 0);
  CHECK(station.Log().find("messages are queued meanwhile") == std::string::npos);
}

TEST_CASE("a cell is admitted by a reload; the plant's programs do what they need and no more") {
  PlantBroker broker;
  if (!broker.Start()) return;
  PlantClient collector(broker.OfPlant("collect")), sparkplug(broker.OfPlant("sparkplug"));
  REQUIRE(collector.Subscribe("$share/collect/plumblineV1/#"));
  REQUIRE(sparkplug.Subscribe("plumblineV1/#"));
  REQUIRE(sparkplug.Subscribe("spBv1.0/#"));
  CHECK_FALSE(PlantClient(broker.Of("Halle Süd/Zelle 9")).Connected());
  broker.Admit("Halle Süd/Zelle 9");
  broker.process->Reload();
  REQUIRE(Soon([&] { return PlantClient(broker.Of("Halle Süd/Zelle 9")).Connected(); }));
  PlantClient cell(broker.Of("Halle Süd/Zelle 9"));
  const char* const probe = "plumblineV1/Halle Süd/NPROBE/Zelle 9";
  REQUIRE(cell.Publish(probe, "{}"));
  REQUIRE(collector.Hears(probe));
  REQUIRE(sparkplug.Hears(probe));
  // Other cells keep their rights.
  PlantClient other(broker.Of(kLiar));
  REQUIRE(other.Publish("plumblineV1/line/NDATA/cell-8", "{}"));
  REQUIRE(collector.Hears("plumblineV1/line/NDATA/cell-8"));

  REQUIRE(collector.Publish("plumblineV1/line/NDATA/cell-8", "forged"));
  REQUIRE(collector.Publish("spBv1.0/line/NDATA/cell-8", "forged"));
  REQUIRE(sparkplug.Publish("plumblineV1/line/NDATA/cell-8", "forged"));
  REQUIRE(sparkplug.Publish("spBv1.0/line/NDATA/cell-8", "{}"));
  REQUIRE(sparkplug.Publish("spBv1.0/line/NCMD/cell-8", "rebirth"));
  REQUIRE(other.Publish("plumblineV1/line/NDATA/cell-8", "last"));
  REQUIRE(Soon([&] { return collector.Count("plumblineV1/line/NDATA/cell-8", "last") == 1; }));
  REQUIRE(sparkplug.Hears("spBv1.0/line/NCMD/cell-8"));  // written by itself here, by a host else
  CHECK(collector.Count("", "forged") == 0);
  CHECK(sparkplug.Count("", "forged") == 0);
  CHECK(sparkplug.Count("spBv1.0/line/NDATA/cell-8") == 0);
}

TEST_CASE("the broker of a line forwards its cells' messages, also those of an outage") {
  PlantBroker broker;
  broker.users.push_back(BridgeUserOf("line-3"));
  if (!broker.Start()) return;
  const TemporaryFolder folder;
  const std::string at = folder.path(), user = "line-3/cell-1";
  for (const char* name : {"plant-ca.pem", "broker.pem", "broker.key"}) {
    std::filesystem::copy(broker.folder.path() + "/" + name, at + "/" + name);
  }
  const std::string line = *PasswordLine(user, PlantBroker::SecretOf(user)) + "\n";
  std::ofstream(at + "/cells.passwd") << line;
  std::ofstream(at + "/cells.acl") << AclText(UsersIn(line).cells);
  const int port = FreePort();
  std::string text = FileText("config/plant/mosquitto-line-bridge.conf");
  text = Replaced(text, "/etc/mosquitto/plumbline/", at + "/");
  text = Replaced(text, "/run/mosquitto/", at + "/");
  text = Replaced(text, "/var/lib/mosquitto/", at + "/");
  text = Replaced(text, "log_dest syslog", "log_dest stderr\nuser root");
  text = Replaced(text, "listener 8883", fmt::format("listener {} 127.0.0.1", port));
  text = Replaced(text, "broker.plant.lan:8883", fmt::format("127.0.0.1:{}", broker.cells_port));
  text = Replaced(text, "THE-PASSWORD-OF-bridge-line-3",
                  PlantBroker::SecretOf(BridgeUserOf("line-3")));
  const BrokerProcess of_line(text, port);
  auto options = broker.OfPlant("collect");
  options.persistent = true;
  std::optional<PlantClient> collector(std::in_place, options);
  REQUIRE(collector->Subscribe(kAll));
  auto cell_options = broker.Of(user);
  cell_options.port = port;
  PlantClient cell(cell_options);
  INFO(of_line.Log());
  INFO(broker.process->Log());
  REQUIRE(cell.Publish("plumblineV1/line-3/NPROBE/cell-1", "before"));
  REQUIRE(collector->Hears("plumblineV1/line-3/NPROBE/cell-1"));
  collector.reset();
  broker.process->Stop();
  for (int k = 0; k < 100; ++k) {
    REQUIRE(cell.Publish("plumblineV1/line-3/NPROBE/cell-1", "during"));
  }
  REQUIRE(Soon([&] { return cell.Acknowledged() == 101; }));
  broker.process->Start();
  collector.emplace(options);
  REQUIRE(
      Soon([&] { return collector->Count("plumblineV1/line-3/NPROBE/cell-1", "during") == 100; }));
}

TEST_CASE("a collector that is away gets what came meanwhile, also from a broker restarted") {
  PlantBroker broker;
  if (!broker.Start()) return;
  auto options = broker.OfPlant("collect");
  options.persistent = true;
  options.client_id = "collect-1";
  const auto filter = GENERATE(as<std::string>(), kAll, "$share/collect/plumblineV1/#");
  {
    PlantClient collector(options);
    REQUIRE(collector.Subscribe(filter));
  }
  PlantClient cell(broker.Of(kLiar));
  for (int k = 0; k < 2000; ++k) {
    REQUIRE(cell.Publish("plumblineV1/line/NPROBE/cell-8", std::to_string(k)));
  }
  REQUIRE(Soon([&] { return cell.Acknowledged() == 2000; }));
  broker.process->Stop();
  broker.process->Start();
  PlantClient collector(options);
  REQUIRE(Soon([&] { return collector.Count("plumblineV1/line/NPROBE/cell-8") == 2000; }));
}

}  // namespace plumbline::rights_process_test
