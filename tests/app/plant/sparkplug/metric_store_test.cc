#include "app/plant/sparkplug/metric_store.h"

#include <catch2/catch.hpp>
#include <set>

#include "app/plant/sparkplug/kept_points.h"

namespace plumbline::plant {
namespace {

CellMessage Decoded(CellTopic topic, const std::string& text) {
  auto message = CellMessageFromText(topic, text);
  INFO((message ? std::string() : message.error()));
  REQUIRE(message);
  return std::move(message).value();
}

CellMessage Birth(std::int64_t bdSeq = 1000) {
  return Decoded(CellTopic::kBirth,
                 R"({"timestamp":)" + std::to_string(bdSeq) + R"(,"bdSeq":)" +
                     std::to_string(bdSeq) +
                     R"(,"schema":1,"version":"0.1.0","cell":"arm","joints":2,"stream":"a",)"
                     R"("points":[{"id":7,"name":"P7"}],"waiting":0,)"
                     R"("dropped":{"states":0,"changes":0,"others":0}})");
}

CellMessage Death(std::int64_t bdSeq) {
  return Decoded(CellTopic::kDeath, R"({"timestamp":1,"bdSeq":)" + std::to_string(bdSeq) + "}");
}

std::string Head(int seq, std::int64_t utc_ms) {
  return R"({"stream":"a","seq":)" + std::to_string(seq) + R"(,"timestamp":)" +
         std::to_string(utc_ms) + ",";
}

CellMessage Probe(int seq, std::int64_t utc_ms, double size_mm) {
  return Decoded(CellTopic::kProbe, Head(seq, utc_ms) + R"("id":5,"residual_size_mm":)" +
                                        std::to_string(size_mm) + "}");
}

CellMessage Point(int seq, const std::string& correction) {
  return Decoded(CellTopic::kPoint,
                 Head(seq, 2000) + R"("point":7,"correction_mm":)" + correction + "}");
}

CellMessage State(int seq, int alarms, const std::string& q) {
  return Decoded(CellTopic::kState, Head(seq, 3000) + R"("alarms":)" + std::to_string(alarms) +
                                        R"(,"warnings":0,"q":)" + q + "}");
}

CellMessage Alarm(int seq, const char* event) {
  return Decoded(CellTopic::kAlarm, Head(seq, 2500) + R"("word":"alarms","event":")" + event +
                                        R"(","meaning":"robot input stale"})");
}

const Metric& Named(const MetricStore& store, const std::string& name) {
  for (const Metric& metric : store.All()) {
    if (metric.name == name) return metric;
  }
  FAIL("no metric " << name);
  return store.All().front();
}

std::set<std::string> Changes(MetricStore& store) {
  std::set<std::string> names;
  for (const MetricStore::Change& change : store.TakeChanges())
    names.insert(store.All()[change.index].name);
  return names;
}

constexpr const char* kStaleAlarm = "Alarms/alarms/robot input stale";

TEST_CASE("A cell is online unless its death has the number of its birth") {
  MetricStore store;
  CHECK_FALSE(store.online());
  store.Apply(Death(1000));
  store.Apply(Birth(1000));
  CHECK_FALSE(store.online());
  store.Apply(Birth(2000));
  CHECK(store.online());
  CHECK(store.births() == 2);
  store.Apply(Death(1000));  // of the connection before, delivered late
  CHECK(store.online());
  CHECK(store.Apply(Birth(2000)) == MetricStore::Outcome::kRepeated);
  CHECK(store.births() == 2);
  store.Apply(Death(2000));
  CHECK_FALSE(store.online());
}

TEST_CASE("A birth declares the metrics of all messages, with unknown values") {
  MetricStore store;
  store.Apply(Birth());
  const std::size_t declared = store.size();
  CHECK(Named(store, "Points/7/Correction/X").quality == Quality::kStale);
  CHECK(Named(store, "Joints/2").quality == Quality::kStale);
  CHECK(Named(store, "Cell/Arm").value == MetricValue("arm"));
  store.Apply(Probe(1, 2000, 0.5));
  store.Apply(Point(2, "[1,2,3]"));
  store.Apply(State(3, 0, "[1,2]"));
  store.Apply(Alarm(4, "begin"));
  CHECK(store.size() == declared);
  store.Published();
  store.Apply(Birth(5000));
  CHECK(Named(store, "Points/7/Correction/X").value == MetricValue(1.0));
}

TEST_CASE("Only what changes is published, except that each probe is an event") {
  MetricStore store;
  store.Apply(Birth());
  store.Apply(Point(1, "[1,2,3]"));
  store.Published();
  store.Apply(Point(2, "[1,2,4]"));
  CHECK(Changes(store) == std::set<std::string>{"Points/7/Correction/Z"});
  CHECK_FALSE(store.has_changes());
  store.Apply(Probe(3, 2000, 0.5));
  Changes(store);
  store.Apply(Probe(4, 2000, 0.5));
  CHECK(Changes(store) == std::set<std::string>{"Probe/Id", "Probe/Residual/Size"});
  CHECK(store.Apply(Probe(4, 2000, 0.5)) == MetricStore::Outcome::kRepeated);
  CHECK_FALSE(store.has_changes());
}

TEST_CASE("Messages older than the birth are historical, and live with the first newer one") {
  MetricStore store;
  store.Apply(Birth(1000));
  store.Published();
  store.Apply(Probe(1, 999, 0.5));
  CHECK(Named(store, "Probe/Id").historical);
  Changes(store);
  store.Apply(Point(2, "[1,2,3]"));
  CHECK_FALSE(Named(store, "Probe/Id").historical);
  CHECK(Changes(store).count("Probe/Id") == 1);
  CHECK(Named(store, "Probe/Id").utc_ms == 999);
}

TEST_CASE("After missing messages points are stale and alarms follow the state's word") {
  MetricStore store;
  store.Apply(Birth());
  store.Apply(Alarm(1, "begin"));
  store.Apply(Point(2, "[1,2,3]"));
  CHECK(store.Apply(State(3, 2, "[1,2]")) == MetricStore::Outcome::kApplied);
  CHECK(store.Apply(State(5, 0, "[1,2]")) == MetricStore::Outcome::kMissed);
  CHECK(Named(store, "Points/7/Correction/X").quality == Quality::kStale);
  CHECK(Named(store, kStaleAlarm).value == MetricValue(false));
  store.Apply(Alarm(6, "begin"));
  store.Apply(State(7, 0, "[1,2]"));  // without a gap the alarm's own messages count
  CHECK(Named(store, kStaleAlarm).value == MetricValue(true));
  store.Apply(Point(8, "[1,2,3]"));
  CHECK(Named(store, "Points/7/Correction/X").quality == Quality::kGood);
}

TEST_CASE("Points survive a restart, and are stale if messages are missing after it") {
  MetricStore store;
  store.Apply(Birth());
  store.Apply(Point(1, "[1,2,3]"));
  const KeptPoints kept = {{{"group", "cell-7"}, store.ToKeep()}};
  const auto read = KeptPointsFromText(TextOfKeptPoints(kept));
  REQUIRE(read);
  for (const int next : {2, 3}) {
    MetricStore fresh;
    fresh.Restore(read->at({"group", "cell-7"}));
    CHECK(fresh.Apply(State(next, 0, "[1,2]")) ==
          (next == 2 ? MetricStore::Outcome::kApplied : MetricStore::Outcome::kMissed));
    fresh.Apply(Birth());
    CHECK(Named(fresh, "Points/7/Correction/Z").value == MetricValue(3.0));
    CHECK(Named(fresh, "Points/7/Correction/Z").unit == std::string("mm"));
    CHECK(Named(fresh, "Points/7/Correction/Z").quality ==
          (next == 2 ? Quality::kGood : Quality::kStale));
    CHECK(fresh.ToKeep().values.size() == (next == 2 ? 3 : 0));
  }
  for (const char* other : {"", "{", "[]", R"({"schema":2})", R"({"schema":1})",
                            R"({"schema":1,"cells":[1]})", R"({"schema":1,"cells":[{}]})"}) {
    CHECK_FALSE(KeptPointsFromText(other));
  }
}

TEST_CASE("What is null as a whole is unknown in its parts") {
  MetricStore store;
  store.Apply(Birth());
  store.Apply(Point(1, "[1,2,3]"));
  store.Apply(State(2, 0, "[1,2]"));
  store.Apply(Point(3, "null"));
  store.Apply(State(4, 0, "null"));
  for (const char* name : {"Points/7/Correction/X", "Points/7/Correction/Z", "Joints/2"}) {
    CHECK(Named(store, name).quality == Quality::kBad);
    CHECK(Named(store, name).value == MetricValue());
  }
}

TEST_CASE("The number of metrics is bounded") {
  MetricStore store;
  store.Apply(Birth());
  for (int k = 0; store.refused() == 0; ++k) {
    REQUIRE(k < 20000);
    store.Apply(Decoded(CellTopic::kPoint, Head(k + 1, 2000) + R"("name":"n","point":)" +
                                               std::to_string(100 + k) + "}"));
  }
  CHECK(store.size() == MetricStore::kMaxMetrics);
}

TEST_CASE("Each alarm and warning has a metric of its own") {
  std::set<std::string> names;
  for (const AlarmBit& bit : AlarmBits()) names.insert(bit.metric);
  CHECK(names.size() == AlarmBits().size());
  CHECK(AlarmMetric("warnings", "joints too coarse: over 0.1 mm (a/b)") ==
        "Alarms/warnings/joints too coarse");
  CHECK(AlarmMetric("fleet", "#+/") == "Alarms/fleet/unnamed");
}

TEST_CASE("A message of another form is refused as a whole") {
  const auto refused = [](CellTopic topic, const std::string& text) {
    const auto message = CellMessageFromText(topic, text);
    return message ? std::string("accepted") : message.error();
  };
  CHECK(refused(CellTopic::kProbe, "[1]") == "not a JSON object");
  CHECK(refused(CellTopic::kProbe, "{") == "is not JSON");
  CHECK(refused(CellTopic::kProbe, "{}") == "timestamp: not a value of its type or range");
  CHECK(refused(CellTopic::kProbe, Head(1, 1) + R"("id":"x"})") ==
        "id: not a value of its type or range");
  CHECK(refused(CellTopic::kProbe, Head(1, 1) + R"("model":3000000000})") ==
        "model: not a value of its type or range");
  CHECK(refused(CellTopic::kPoint, Head(1, 1) + R"("point":1,"correction_mm":[1,2]})") ==
        "correction_mm: not a value of its type or range");
  CHECK(refused(CellTopic::kProbe, Head(1, 1) + R"("source":")" +
                                       std::string(kMaxMetricText_bytes + 1, 'x') + "\"}") ==
        "source: not a value of its type or range");
  CHECK(refused(CellTopic::kProbe, std::string(kMaxCellMessage_bytes + 1, ' ')) ==
        "longer than 1 MB");
  CHECK(refused(CellTopic::kProbe, Head(1, 1) + R"("new_field":[{}]})") == "accepted");
}

TEST_CASE("Topics of cells are recognised, and no others") {
  const auto address = CellAddressFromTopic("plumblineV1/line 3/NPROBE/cell-7");
  REQUIRE(address);
  CHECK((address->group == "line 3" && address->node == "cell-7" &&
         address->topic == CellTopic::kProbe));
  for (const char* other :
       {"", "plumblineV1/", "plumblineV1/g/NPROBE/", "plumblineV1//NPROBE/n", "plumblineV1/g/n",
        "plumblineV1/g/NCMD/n", "spBv1.0/g/NDATA/n", "plumblineV1/g/NPROBE/n/d"}) {
    CHECK_FALSE(CellAddressFromTopic(other));
  }
}

}  // namespace
}  // namespace plumbline::plant
