// plumbline-fleet against Debian's mosquitto, with both killed in turn.
#include <algorithm>
#include <cmath>
#include <set>

#include "app/plant/publish/fleet_loop.h"
#include "tests/app/plant/broker/certificates.h"
#include "tests/app/plant/publish/fleet_station.h"
#include "tests/app/plant/publish/historian.h"

namespace plumbline::fleet_process_test {

using namespace plumbline::plant;
using namespace plumbline::test;

namespace {

constexpr const char* kOurs = "plumblineV1/plumbline/+/cell-7";

bool HasBroker() {
  const bool has = !MosquittoProgram().empty();
  if (!has) WARN("SKIPPED: no mosquitto here (apt install mosquitto)");
  return has;
}

std::string PortLine(const BrokerProcess& broker) {
  return fmt::format("port = {}\n", broker.port());
}

/// Messages as a consumer stores them: each (stream, seq) once.
std::vector<Heard> Stream(const Historian& historian) {
  std::set<std::int64_t> known;
  std::vector<Heard> kept;
  for (const Heard& one : historian.All()) {
    if (one.json.contains("seq") && known.insert(one.json.at("seq").get<std::int64_t>()).second)
      kept.push_back(one);
  }
  return kept;
}

}  // namespace

TEST_CASE("a daemon with 5000 points is not reported as silent") {
  if (!HasBroker()) return;
  const BrokerProcess broker;
  const Historian historian(broker.port(), kOurs);
  FleetStation station(PortLine(broker), 5000);
  station.Start();
  INFO(station.Log());
  REQUIRE(historian.Awaits("NDATA", 3));
  CHECK(historian.Of("NDATA")[0].json.at("points") == 5000);
  CHECK(historian.Of("NALARM").empty());
}

TEST_CASE("birth, states, alarms, points, models, lenses and probes are published") {
  if (!HasBroker()) return;
  const BrokerProcess broker;
  const Historian historian(broker.port(), kOurs);
  FleetStation station(PortLine(broker));
  station.Start();
  INFO(station.Log());
  REQUIRE(historian.Awaits("NBIRTH"));
  const auto birth = historian.Of("NBIRTH").front().json;
  CHECK(birth.at("schema") == 1);
  CHECK(birth.at("cell") == "KR 210 R2700 extra");
  CHECK(birth.at("points").size() == 2);
  CHECK(birth.at("points")[0].at("id") == 1);
  REQUIRE(historian.Awaits("NDATA", 3));
  CHECK(historian.Of("NDATA")[0].json.at("points_valid") == 1);
  REQUIRE(historian.Awaits("NPOINT"));
  CHECK(historian.Of("NPOINT")[0].json.at("reason") == "ok");
  REQUIRE(historian.Awaits("NMODEL"));
  CHECK(historian.Of("NMODEL")[0].json.at("before").is_null());
  CHECK(historian.Of("NALARM").empty());

  station.feed->Set([](cell::ViewState& state) {
    state.alarms = alarm::kRobotStale;
    state.model_version = 2;
    state.points[0].translation_B = Vec3(0.002, 0, 0);
    state.cameras.resize(1);
    state.cameras[0].status.name = status::CameraName::kRear;
    state.cameras[0].status.configured = true;
    state.cameras[0].status.state = lens::ZoomState::kValid;
  });
  REQUIRE(historian.Awaits("NALARM"));
  REQUIRE(historian.Awaits("NMODEL", 2));
  REQUIRE(historian.Awaits("NPOINT", 2));
  REQUIRE(historian.Awaits("NLENS"));
  const auto begin = historian.Of("NALARM")[0].json;
  CHECK(begin.at("event") == "begin");
  CHECK(begin.at("word") == "alarms");
  CHECK(begin.at("bit") == 1);
  CHECK_FALSE(begin.at("meaning").get<std::string>().empty());
  CHECK(historian.Of("NMODEL")[1].json.at("before") == 1);
  CHECK(historian.Of("NPOINT")[1].json.at("correction_mm")[0] == 2);
  CHECK(historian.Of("NLENS")[0].json.at("lens") == "valid");
  CHECK(historian.Of("NLENS")[0].json.at("camera") == "rear");
  station.feed->Set([](cell::ViewState& state) { state.alarms = 0; });
  REQUIRE(historian.Awaits("NALARM", 2));
  CHECK(historian.Of("NALARM")[1].json.at("event") == "end");

  // Version 2 has no file yet; its cell is published once it has one.
  REQUIRE(historian.Awaits("NCELL"));
  const auto declared = historian.Of("NCELL")[0].json;
  CHECK(declared.at("model") == 1);
  CHECK_THAT(declared.at("cell").get<std::string>(), Catch::Contains("KR 210 R2700 extra"));
  CHECK(station.Says("the cell is not published: "));
  station.WriteModel(2, "# applied\n");
  REQUIRE(historian.Awaits("NCELL", 2));
  const auto applied = historian.Of("NCELL")[1].json;
  CHECK(applied.at("model") == 2);
  CHECK_THAT(applied.at("cell").get<std::string>(), Catch::StartsWith("# applied"));
  CHECK(applied.at("fingerprint") == declared.at("fingerprint"));
  station.Signal(SIGHUP);
  REQUIRE(historian.Awaits("NBIRTH", 2));

  station.AddProbes(3);
  REQUIRE(historian.Awaits("NPROBE", 3));
  const std::vector<Heard> stream = Stream(historian);
  CHECK(std::count_if(stream.begin(), stream.end(), [](const Heard& one) {
          return one.type == "NCELL";
        }) == 2);  // not anew after the reload
  CHECK(historian.Of("NPROBE")[1].json.at("q").size() == 6);
  CHECK(historian.Of("NPROBE")[1].json.at("residual_mm")[2] == Approx(0.2));
  CHECK(historian.Of("NPROBE")[1].json.at("id") == 2);

  // In order, without gaps.
  std::int64_t seq = 0;
  for (const Heard& one : stream) CHECK(one.json.at("seq") == ++seq);

  // A consumer that subscribes later gets the retained birth and no death.
  const Historian later(broker.port(), kOurs, "later");
  REQUIRE(later.Awaits("NBIRTH"));
  CHECK(later.Of("NBIRTH")[0].retained);

  station.Signal(SIGTERM);
  CHECK(station.Wait() == 0);
  REQUIRE(historian.Awaits("NDEATH", 2));
  CHECK(historian.Of("NDEATH")[0].json.at("bdSeq") == birth.at("bdSeq"));
  CHECK(historian.Of("NDEATH")[1].json.at("clean_shutdown") == true);
}

TEST_CASE(
    "after kill -9 the broker publishes the retained will; the next birth has another bdSeq") {
  if (!HasBroker()) return;
  const BrokerProcess broker;
  const Historian historian(broker.port(), kOurs);
  FleetStation station(PortLine(broker));
  station.Start();
  REQUIRE(historian.Awaits("NDATA"));
  station.Kill();
  REQUIRE(historian.Awaits("NDEATH"));
  const auto birth = historian.Of("NBIRTH")[0].json, death = historian.Of("NDEATH")[0].json;
  CHECK(death.at("bdSeq") == birth.at("bdSeq"));
  CHECK(death.at("clean_shutdown") == false);
  station.Start();
  REQUIRE(historian.Awaits("NBIRTH", 2));
  CHECK(historian.Of("NBIRTH")[1].json.at("bdSeq") != birth.at("bdSeq"));
  CHECK(historian.Of("NBIRTH")[1].json.at("stream") == birth.at("stream"));
  const Historian later(broker.port(), kOurs, "later");
  REQUIRE(later.Awaits("NDEATH"));
  REQUIRE(later.Awaits("NBIRTH"));
  CHECK(later.Of("NDEATH")[0].retained);
  CHECK(later.Of("NDEATH")[0].json.at("bdSeq") != later.Of("NBIRTH")[0].json.at("bdSeq"));
}

TEST_CASE("messages survive a broker outage with a publisher crash: complete, once, in order") {
  if (!HasBroker()) return;
  BrokerProcess broker;
  const Historian historian(broker.port(), kOurs);
  FleetStation station(PortLine(broker), 40);
  station.AddProbes(5);  // before the first start: not new
  station.Start();
  INFO(station.Log());
  REQUIRE(historian.Awaits("NDATA"));
  // It has read the journal once, so that probes added from now on are new.
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  broker.Stop();
  REQUIRE(station.Says("messages are queued meanwhile"));
  for (int round = 1; round <= 8; ++round) {
    station.AddProbes(40);
    station.feed->Set([round](cell::ViewState& state) {
      for (cell::ViewPoint& point : state.points) point.translation_B.x() = 1e-3 * round;
      state.alarms = round % 2 ? alarm::kRobotStale : std::uint16_t{0};
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(700));
    if (round % 2 == 0) {
      station.Kill();
      station.Start();
    }
  }
  broker.Start();
  REQUIRE(historian.Awaits("NPROBE", 320));
  std::vector<Heard> stream;
  std::set<std::int64_t> probes;
  REQUIRE(Soon([&] {
    stream = Stream(historian);
    return stream.size() > 600;
  }));
  std::int64_t seq = 0, first_probe = 0;
  for (const Heard& one : stream) {
    REQUIRE(one.json.at("seq") == ++seq);  // nothing is lost, nothing out of order
    if (one.type != "NPROBE") continue;
    const std::int64_t id = one.json.at("id");
    if (first_probe == 0) first_probe = id;
    CHECK(id == first_probe + static_cast<std::int64_t>(probes.size()));
    CHECK(probes.insert(id).second);  // no probe is published under two numbers
  }
  CHECK(first_probe == 6);
  CHECK(probes.size() == 320);
  // Every alarm that began has ended before it begins again.
  bool on = false;
  for (const Heard& one : stream) {
    if (one.type != "NALARM" || one.json.at("word") != "alarms") continue;
    CHECK((one.json.at("event") == "begin") == !on);
    on = !on;
  }
  CHECK(station.Says("messages forwarded in"));
}

TEST_CASE("a publisher killed repeatedly while forwarding loses nothing and keeps the order") {
  if (!HasBroker()) return;
  constexpr std::size_t kProbes = 20000;
  const BrokerProcess broker;
  const Historian historian(broker.port(), kOurs);
  FleetStation station(PortLine(broker));
  std::filesystem::create_directories(station.state + "/fleet");
  {
    auto queue = FleetQueue::Open(station.state + "/fleet/queue.sqlite", 64'000'000);
    REQUIRE(queue);
    std::vector<Message> messages;
    for (std::size_t id = 1; id <= kProbes; ++id) {
      messages.push_back({MessageKind::kProbe, 1, fmt::format("{{\"id\":{}}}", id)});
    }
    REQUIRE(queue.value().Append(messages, ""));
  }
  std::size_t kills = 0;
  for (; kills < 200 && historian.Of("NPROBE").size() < kProbes; ++kills) {
    const std::size_t births = historian.Of("NBIRTH").size();
    station.Start();
    static_cast<void>(Soon([&] { return historian.Of("NBIRTH").size() > births; }, 5));
    std::this_thread::sleep_for(std::chrono::milliseconds(kills % 9));
    station.Kill();
  }
  station.Start();
  REQUIRE(Soon([&] {
    std::set<std::int64_t> ids;
    for (const Heard& one : historian.Of("NPROBE")) {
      ids.insert(one.json.at("id").get<std::int64_t>());
    }
    return ids.size() == kProbes;
  }));
  std::int64_t seq = 0;
  for (const Heard& one : Stream(historian)) REQUIRE(one.json.at("seq") == ++seq);
  const std::size_t twice = historian.Of("NPROBE").size() - kProbes;
  WARN(
      fmt::format("{} kills while {} probes were forwarded; {} came twice", kills, kProbes, twice));
  CHECK(kills > 3);
}

TEST_CASE("what a killed broker had not saved is published again; the historian misses nothing") {
  if (!HasBroker()) return;
  const bool repeats = GENERATE(true, false);
  constexpr std::size_t kProbes = 50;
  BrokerProcess broker;
  const auto witness = std::make_unique<Historian>(broker.port(), kOurs, "witness");
  auto historian = std::make_unique<Historian>(broker.port(), kOurs);
  FleetStation station(PortLine(broker) + (repeats ? "repeat_s = 120\n" : "repeat_s = 0\n"));
  station.Start();
  INFO(station.Log());
  REQUIRE(historian->Awaits("NDATA"));
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));  // the journal was read once
  std::set<std::int64_t> known;
  const auto collect = [&] {
    std::size_t probes = 0;
    for (const Heard& one : historian->All()) {
      if (!one.json.contains("seq")) continue;
      const bool fresh = known.insert(one.json.at("seq").get<std::int64_t>()).second;
      probes += fresh && one.type == "NPROBE" ? 1 : 0;
    }
    return probes;
  };
  CHECK(collect() == 0);
  // While the historian is away, the broker keeps its messages in memory.
  historian.reset();
  broker.Save();
  station.AddProbes(kProbes);
  REQUIRE(witness->Awaits("NPROBE", kProbes));
  std::this_thread::sleep_for(std::chrono::milliseconds(500));  // these are acknowledged
  broker.Kill();
  REQUIRE(station.Says("messages are queued meanwhile"));
  broker.Start();
  historian = std::make_unique<Historian>(broker.port(), kOurs);
  const std::size_t states = historian->Of("NDATA").size();
  if (!repeats) {  // otherwise this test would not test anything
    REQUIRE(historian->Awaits("NDATA", states + 5));
    CHECK(collect() == 0);
    return;
  }
  REQUIRE(historian->Awaits("NPROBE", kProbes));
  REQUIRE(historian->Awaits("NDATA", states + 5));
  CHECK(collect() == kProbes);
  CHECK(station.Says("recent ones are published again"));
  // The first session ended between two messages; nothing is missing anywhere.
  CHECK(*known.rbegin() - *known.begin() + 1 == static_cast<std::int64_t>(known.size()));
  std::int64_t before = 0;
  std::set<std::int64_t> repeated;
  for (const Heard& one : historian->All()) {
    if (!one.json.contains("seq")) continue;
    const std::int64_t seq = one.json.at("seq");
    if (repeated.insert(seq).second) {
      CHECK(seq > before);  // oldest first
      before = seq;
    }
  }
}

TEST_CASE("a flickering connection does not repeat the same messages each time") {
  if (!HasBroker()) return;
  const BrokerProcess broker;
  const Historian historian(broker.port(), kOurs);
  FleetStation station(PortLine(broker));
  const double start_s = MonotonicSeconds();
  constexpr std::size_t kRestarts = 9;
  for (std::size_t k = 1; k <= kRestarts; ++k) {
    station.Start();
    REQUIRE(historian.Awaits("NBIRTH", k));
    REQUIRE(historian.Awaits("NDATA", k));
    station.Kill();
  }
  std::size_t first = 0;
  for (const Heard& one : historian.All()) first += one.json.value("seq", 0) == 1 ? 1 : 0;
  const double passes = std::floor((MonotonicSeconds() - start_s) / FleetLoop::kRepeatPause_s);
  CHECK(static_cast<double>(first) <=
        3 + passes);  // itself, one not acknowledged in time, one pass
  station.Start();
  REQUIRE(historian.Awaits("NBIRTH", kRestarts + 1));
  std::int64_t seq = 0;
  for (const Heard& one : Stream(historian)) REQUIRE(one.json.at("seq") == ++seq);
}

TEST_CASE("beyond the bound states are dropped first, and their number is published") {
  if (!HasBroker()) return;
  BrokerProcess broker;
  const Historian historian(broker.port(), kOurs);
  FleetStation station(PortLine(broker) + "queue_mb = 1\n", 400);
  station.Start();
  REQUIRE(historian.Awaits("NDATA"));
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  broker.Stop();
  station.AddProbes(200);
  double offset_m = 0;
  REQUIRE(Soon([&] {
    offset_m += 1e-3;
    station.feed->Set([offset_m](cell::ViewState& state) {
      for (cell::ViewPoint& point : state.points) point.translation_B.x() = offset_m;
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    return station.Log().find("queue is full") != std::string::npos;
  }));
  std::this_thread::sleep_for(std::chrono::milliseconds(1000));
  broker.Start();
  REQUIRE(historian.Awaits("NPROBE", 200));
  REQUIRE(historian.Awaits("NLOST"));
  const auto lost = historian.Of("NLOST")[0].json;
  CHECK(lost.at("states") > 0);
  CHECK(lost.at("others") == 0);
  CHECK(station.Says("dropped since the queue was created"));
  CHECK(historian.Of("NBIRTH").back().json.at("dropped").at("states") >= lost.at("states"));
  std::int64_t before = 0;
  for (const Heard& one : Stream(historian)) {
    CHECK(one.json.at("seq") > before);  // gaps, but in order
    before = one.json.at("seq").get<std::int64_t>();
  }
}

TEST_CASE("a wrong password is logged; a corrected one is used without a restart") {
  if (!HasBroker()) return;
  const TemporaryFolder folder;
  const std::string users = folder.path() + "/users", secret = folder.path() + "/secret";
  std::ofstream(users) << "cell-7:right\n";
  if (std::system(("mosquitto_passwd -U " + users).c_str()) != 0) {
    WARN("SKIPPED: no mosquitto_passwd here");
    return;
  }
  const BrokerProcess broker("allow_anonymous false\npassword_file " + users + "\n");
  std::ofstream(secret) << "wrong\n";
  FleetStation station(PortLine(broker) + "username = \"cell-7\"\npassword_file = \"" + secret +
                       "\"\n");
  station.Start();
  INFO(station.Log());
  REQUIRE(station.Says("not authorised"));
  CHECK(station.Log().find("wrong\n") == std::string::npos);
  std::ofstream(secret) << "right\n";
  REQUIRE(station.Says(" connected, "));
}

TEST_CASE("TLS with a private CA; a broker of another CA is refused") {
  if (!HasBroker()) return;
  const TemporaryFolder folder;
  const std::string at = folder.path();
  if (!MakeAuthority(at, "theirs") || !MakeAuthority(at, "ours") ||
      !MakeBrokerCertificate(at, "ours")) {
    WARN("SKIPPED: no openssl here to make certificates with");
    return;
  }
  const BrokerProcess broker("allow_anonymous true\ncertfile " + at + "/broker.pem\nkeyfile " + at +
                             "/broker.key\n");
  FleetStation station(PortLine(broker) + "tls_ca = \"" + at + "/theirs.pem\"\n");
  station.Start();
  REQUIRE(station.Says("certificate verify failed"));
  station.Configure(PortLine(broker) + "tls_ca = \"" + at + "/ours.pem\"\n");
  station.Signal(SIGHUP);
  REQUIRE(station.Says(" connected, "));
  station.Configure(PortLine(broker) + "tls_ca = \"" + at + "/broker.key\"\n");
  station.Signal(SIGHUP);
  REQUIRE(station.Says("no certificate or crl found"));
  station.Configure(PortLine(broker) + "tls_ca = \"" + at + "/none.pem\"\n");
  station.Signal(SIGHUP);
  REQUIRE(station.Says("contains no readable CA certificates"));
  station.Signal(SIGTERM);
  CHECK(station.Wait() == 0);
}

TEST_CASE("a missing daemon is published as an alarm of its own") {
  if (!HasBroker()) return;
  const BrokerProcess broker;
  const Historian historian(broker.port(), kOurs);
  FleetStation station(PortLine(broker));
  station.feed.reset();
  station.Start();
  REQUIRE(historian.Awaits("NBIRTH"));
  REQUIRE(historian.Awaits("NALARM"));
  CHECK(historian.Of("NALARM")[0].json.at("word") == "fleet");
  CHECK(historian.Of("NDATA").empty());
  station.feed.emplace(station.state, 1);
  REQUIRE(historian.Awaits("NALARM", 2));
  CHECK(historian.Of("NALARM")[1].json.at("event") == "end");
  REQUIRE(historian.Awaits("NDATA"));
  CHECK(station.Says("receiving data from plumblined again"));
}

TEST_CASE("it does not start without [mqtt], with a faulty one, or with an invalid queue") {
  FleetStation station("");
  std::ofstream(station.state + "/fleet") << "a file";
  station.Start();
  CHECK(station.Wait() == 2);
  station.Configure("port = 0\n");
  station.Start();
  CHECK(station.Wait() == 1);
  CHECK(station.Says("mqtt.port: 0 is outside 1..65535"));
  std::ofstream(station.config) << WithLine(DemoConfig("127.0.0.1:1", "universal-robots-fine"), "",
                                            "state_directory", "\"" + station.state + "\"");
  station.Start();
  CHECK(station.Wait() == 1);
  CHECK(station.Says("has no [mqtt] section"));
}

}  // namespace plumbline::fleet_process_test
