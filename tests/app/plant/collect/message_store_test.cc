#include "app/plant/collect/message_store.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <random>
#include <thread>

#include "tests/app/plant/collect/plant_messages.h"
#include "tests/app/plant/database/postgres_process.h"

namespace plumbline::plant::message_store_test {

constexpr double kNow_s = 1'795'260'031;
constexpr std::int64_t kNow_ms = 1'795'260'031'000;

std::string Answer(Connection& database, const char* question) {
  const auto rows = database.Run(question);
  INFO(question);
  INFO((rows ? "" : rows.error()));
  REQUIRE(rows.ok());
  std::string text;
  for (int i = 0; i < rows->size(); ++i) {
    if (i > 0) text += ";";
    text += rows->Text(i, 0);
  }
  return text;
}

TEST_CASE("what cells publish arrives once, in any order, from several collectors") {
  if (test::PostgresPrograms().empty()) {
    WARN("SKIPPED: no PostgreSQL 15 here");
    return;
  }
  const test::PostgresProcess server;
  Connection database = server.ConnectToNewPlant();
  REQUIRE(database.RunScript("CREATE ROLE c LOGIN IN ROLE plumbline_collector").ok());
  constexpr int kMessages = 2000;
  std::vector<Received> messages;
  for (const char* node : {"cell-1", "cell-2", "cell-3"}) {
    test::PublishingCell cell;
    cell.node = node;
    for (int seq = 1; seq <= kMessages; ++seq) {
      if (seq == 700 || (seq >= 900 && seq < 910)) continue;  // lost
      // Over two months, and more than a day each.
      const std::int64_t utc_ms = kNow_ms - 40 * 86'400'000LL + 1'500'000LL * seq;
      messages.push_back(seq % 10 == 0   ? cell.State(seq, utc_ms)
                         : seq % 50 == 1 ? cell.Alarm(seq, utc_ms)
                                         : cell.Probe(seq, utc_ms));
    }
  }
  const auto deliver = [&](unsigned seed) {
    Admission admission(50, 5'000'000);
    MessageStore store = MessageStore::On(server.Connect("c"), admission).value();
    std::vector<Received> mine = messages;
    std::shuffle(mine.begin(), mine.end(), std::mt19937(seed));
    for (std::size_t from = 0; from < mine.size(); from += 500) {
      const std::size_t count = std::min<std::size_t>(500, mine.size() - from);
      const auto written = store.Write(std::span(mine).subspan(from, count), kNow_s);
      if (!written) throw std::runtime_error(written.error());
    }
    return store.counts();
  };
  StoreCounts other;
  std::thread second([&] { other = deliver(2); });
  const StoreCounts counts = deliver(1);
  second.join();
  CHECK(counts.stored + other.stored == static_cast<std::int64_t>(messages.size()));
  CHECK(counts.repeated + other.repeated == static_cast<std::int64_t>(messages.size()));

  CHECK(Answer(database, "SELECT count(*) FROM probe") ==
        std::to_string(3 * (2000 - 200 - 40 - 8)));
  CHECK(Answer(database, "SELECT count(*) FROM alarm") == std::to_string(3 * 39));
  CHECK(Answer(database, "SELECT first_seq || '-' || last_seq FROM gap ORDER BY cell, first_seq") ==
        "700-700;900-909;700-700;900-909;700-700;900-909");
  CHECK(Answer(database, "SELECT first_seq || ' ' || next_seq FROM stream") ==
        "1 2001;1 2001;1 2001");
  CHECK(Answer(database, "SELECT sum(probes)::bigint FROM cell_day") ==
        Answer(database, "SELECT count(*) FROM probe"));
  CHECK(Answer(database, "SELECT sum(states) FROM cell_day") == std::to_string(3 * 198));
  CHECK(Answer(database, "SELECT count(DISTINCT state_utc) FROM cell") == "1");
  CHECK(Answer(database, "SELECT missing FROM cell_now ORDER BY cell") == "11;11;11");
}

TEST_CASE("a row has the values of its message") {
  if (test::PostgresPrograms().empty()) {
    WARN("SKIPPED: no PostgreSQL 15 here");
    return;
  }
  const test::PostgresProcess server;
  Connection database = server.ConnectToNewPlant();
  Admission admission(50, 5'000'000);
  const std::string begin = R"({"stream":"80000001","seq":)";
  const std::string probe =
      begin +
      R"(1,"timestamp":1795260031123,"journal":1700000000123,"id":9007199254740993,)"
      R"("source":"pl\tc\\","session":"S\u00e4ge","model":3,"measured_mm":[1200.0625,-400,1e-7],)"
      R"("predicted_mm":[1,2,3],"residual_mm":[0.25,-1e-42,0],"residual_size_mm":0.25,)"
      R"("payload_kg":null,"temp_C":-21.5,"wild":false,"alarm":true,"quarantined":false,)"
      R"("q":[0.1,-90.2,1e300],"tool":7})";
  const std::string bare =
      begin +
      R"(2,"timestamp":951782400000,"journal":1,"id":-1,"source":"","session":"1","model":0,)"
      R"("wild":true,"alarm":false,"quarantined":true,"q":[]})";
  const std::string alarm =
      begin + R"(3,"timestamp":1795260031123,"word":"alarms","bit":-3,"event":"begin",)"
              R"("meaning":"stale"})";
  REQUIRE(database.Run("UPDATE setting SET retention_months = 0").ok());
  MessageStore keeping = MessageStore::On(server.Connect(), admission).value();
  REQUIRE(keeping
              .Write(std::vector<Received>{{"plumblineV1/l/NPROBE/n", probe},
                                           {"plumblineV1/l/NPROBE/n", bare},
                                           {"plumblineV1/l/NALARM/n", alarm}},
                     kNow_s)
              .ok());
  CHECK(keeping.counts().dead_letters == 0);
  CHECK(
      Answer(database,
             "SELECT concat_ws(' ', stream, seq, to_char(utc AT TIME ZONE 'UTC', 'YYYY-MM-DD "
             "HH24:MI:SS.MS'), journal, id, model, x_mm, y_mm, z_mm, dx_mm, dy_mm, dz_mm, size_mm, "
             "payload_kg IS NULL, temp_c, wild, alarm, quarantined, source = E'pl\tc\\\\', "
             "session, q, more) FROM probe ORDER BY seq") ==
      "2147483649 1 2026-11-21 11:20:31.123 1700000000123 9007199254740993 3 1200.0625 -400 1e-07 "
      "0.25 -1e-42 0 0.25 t -21.5 f t f t S\u00e4ge {0.1,-90.2,1e+300} {\"tool\": 7, "
      "\"predicted_mm\": [1, 2, 3]};"
      "2147483649 2 2000-02-29 00:00:00.000 1 -1 0 t t f t f 1 {}");
  CHECK(Answer(database, "SELECT concat_ws(' ', word, bit, meaning, begins) FROM alarm") ==
        "alarms -3 stale t");
}

TEST_CASE("what cannot be stored is a dead letter and does not hold up the rest") {
  if (test::PostgresPrograms().empty()) {
    WARN("SKIPPED: no PostgreSQL 15 here");
    return;
  }
  const test::PostgresProcess server;
  Connection database = server.ConnectToNewPlant();
  Admission admission(50, 5'000'000);
  MessageStore store = MessageStore::On(server.Connect(), admission).value();
  const test::PublishingCell cell;
  std::vector<Received> messages;
  for (int seq = 1; seq <= 100; ++seq) messages.push_back(cell.Probe(seq, kNow_ms + seq));
  messages[10].payload = messages[10].payload.substr(0, 100);  // torn; its number is known
  messages[20].payload = "\x01\x02";                           // not a message at all
  messages[30].topic = "elsewhere";
  messages[40] = cell.Probe(41, kNow_ms + 10 * 86'400'000LL);  // a clock in the future
  // Readable, but no integer of a row holds it.
  messages[50].payload.replace(messages[50].payload.find("\"model\":3"), 9, "\"model\":3000000000");
  const auto at = messages[60].payload.find("\"source\":\"plc\"");
  messages[60].payload.replace(at, 14, "\"source\":\"\xff\xfe\"");  // not UTF-8
  messages[70].payload.replace(messages[70].payload.find("\"source\":\"plc\""), 14,
                               "\"source\":\"p\\u0000\"");  // no text of the database holds it
  REQUIRE(store.Write(messages, kNow_s).ok());
  CHECK(store.counts().dead_letters == 7);
  CHECK(Answer(database, "SELECT count(*) FROM probe") == "93");
  CHECK(Answer(database, "SELECT sum(messages) FROM dead_letter WHERE reason <> ''") == "7");
  // The numbers that could be read are not missing; the others are.
  CHECK(Answer(database, "SELECT first_seq FROM gap ORDER BY 1") == "21;31");
  // The evidence is the message itself.
  CHECK(Answer(database,
               "SELECT encode(payload, 'escape') FROM dead_letter WHERE topic = "
               "'elsewhere'") == messages[30].payload);
  // Their repetition adds nothing but what has no number.
  REQUIRE(store.Write(messages, kNow_s).ok());
  CHECK(Answer(database, "SELECT count(*) FROM probe") == "93");
  CHECK(Answer(database, "SELECT sum(messages) FROM dead_letter") == "9");
  // A row that is there although the ledger does not know of it.
  REQUIRE(database.RunScript("DELETE FROM gap; DELETE FROM stream").ok());
  REQUIRE(store.Write(std::span(messages).first(5), kNow_s).ok());
  CHECK(Answer(database, "SELECT count(*) FROM probe") == "93");
}

TEST_CASE("a cell that sends too much is refused, named, and costs the others nothing") {
  if (test::PostgresPrograms().empty()) {
    WARN("SKIPPED: no PostgreSQL 15 here");
    return;
  }
  const test::PostgresProcess server;
  Connection database = server.ConnectToNewPlant();
  Admission admission(50, 5'000'000);
  MessageStore store = MessageStore::On(server.Connect(), admission).value();
  test::PublishingCell flood, good;
  flood.node = "flood";
  std::vector<Received> messages;
  for (int seq = 1; seq <= 20'000; ++seq) {
    messages.push_back(flood.Probe(seq, kNow_ms));
    if (seq % 1000 == 0) messages.push_back(good.Probe(seq / 1000, kNow_ms + seq));
  }
  REQUIRE(store.Write(messages, kNow_s).ok());
  CHECK(store.counts().refused == 20'000 - static_cast<int>(Admission::kBurst));
  CHECK(Answer(database, "SELECT node || ' ' || limited FROM cell WHERE limited > 0") ==
        "flood 15000");
  CHECK(Answer(database, "SELECT sum(messages) FROM refused") == "15000");
  CHECK(Answer(database,
               "SELECT count(*) FROM probe p JOIN cell USING (cell) WHERE node = 'cell-1'") ==
        "20");
  // They are missing, and may come again.
  CHECK(Answer(database, "SELECT count(*) FROM gap") == "0");
  CHECK(Answer(database, "SELECT max(next_seq) FROM stream") == "5001");
}

TEST_CASE("a birth before a backlog of hours costs none of it") {
  if (test::PostgresPrograms().empty()) {
    WARN("SKIPPED: no PostgreSQL 15 here");
    return;
  }
  const test::PostgresProcess server;
  Connection database = server.ConnectToNewPlant();
  Admission admission(50, 5'000'000);
  MessageStore store = MessageStore::On(server.Connect(), admission).value();
  const test::PublishingCell cell;
  std::vector<Received> messages = {
      {"plumblineV1/line-1/NBIRTH/cell-1", R"({"timestamp":1,"bdSeq":5})"}};
  for (int seq = 1; seq <= 7200; ++seq) {
    messages.push_back(cell.State(seq, kNow_ms - 3'600'000 + 500 * seq));
  }
  REQUIRE(store.Write(messages, kNow_s).ok());
  CHECK(store.counts().refused == 0);
  CHECK(store.counts().stored == 7200);
}

TEST_CASE("a hostile cell can neither stop the others nor fill the tables") {
  if (test::PostgresPrograms().empty()) {
    WARN("SKIPPED: no PostgreSQL 15 here");
    return;
  }
  const test::PostgresProcess server;
  Connection database = server.ConnectToNewPlant();
  Admission admission(50, 5'000'000);
  MessageStore store = MessageStore::On(server.Connect(), admission).value();
  test::PublishingCell bad, good;
  bad.node = "bad";
  std::vector<Received> messages;
  // Numbers at the end of their range, and every other one.
  for (const char* seq : {"9223372036854775807", "9007199254740992", "5"}) {
    messages.push_back(bad.Probe(4, kNow_ms));
    std::string& text = messages.back().payload;
    text.replace(text.find("\"seq\":4"), 7, std::string("\"seq\":") + seq);
  }
  for (int seq = 10; seq < 4000; seq += 2) messages.push_back(bad.Probe(seq, kNow_ms));
  for (int stream = 0; stream < 500; ++stream) {
    test::PublishingCell renewed = bad;
    renewed.stream = fmt::format("{:08x}", 0xB0000 + stream);
    messages.push_back(renewed.Probe(7, kNow_ms));
  }
  for (int camera = 0; camera < 100; ++camera) {
    messages.push_back(bad.Message(
        MessageKind::kLens, 5000 + camera, kNow_ms,
        fmt::format(R"({{"camera":"{}","lens":"valid","reason":"ready"}})",
                    std::string(camera == 50 ? 8000 : 3, static_cast<char>('a' + camera % 26)) +
                        std::to_string(camera))));
  }
  messages.push_back(
      {"plumblineV1/line-1/NCELL/bad",
       R"({"stream":"0000a001","seq":6000,"timestamp":1795260031000,"fingerprint":"f",)"
       R"("installed":"infinity","cell":"x"})"});
  for (int k = 0; k < 1000; ++k) messages.push_back({"plumblineV1/line-1//bad", "x"});
  messages.push_back(good.Probe(1, kNow_ms));
  REQUIRE(store.Write(messages, kNow_s).ok());
  CHECK(Answer(database,
               "SELECT count(*) FROM probe JOIN cell USING (cell) WHERE node = 'cell-1'") == "1");
  CHECK(Answer(database, "SELECT count(*) <= 1001 FROM gap") == "t");
  CHECK(Answer(database, "SELECT count(*) FROM stream JOIN cell USING (cell) WHERE node = 'bad'") ==
        "100");
  CHECK(Answer(database, "SELECT count(*) FROM camera_now") == "16");
  CHECK(Answer(database, "SELECT count(*) FROM cell WHERE installed IS NOT NULL") == "0");
  CHECK(Answer(database, "SELECT count(*) < 10, sum(messages) FROM dead_letter") == "t");
  CHECK(Answer(database, "SELECT missing > 9e15::bigint / 10 FROM cell_now WHERE node = 'bad'") ==
        "t");
}

TEST_CASE("messages that only the database refuses are found at a bounded cost") {
  if (test::PostgresPrograms().empty()) {
    WARN("SKIPPED: no PostgreSQL 15 here");
    return;
  }
  const test::PostgresProcess server;
  Connection database = server.ConnectToNewPlant();
  // What the decoder does not know of.
  REQUIRE(database.RunScript("ALTER TABLE plumbline.probe ADD CHECK (payload_kg < 100)").ok());
  Admission admission(50, 5'000'000);
  MessageStore store = MessageStore::On(server.Connect(), admission).value();
  test::PublishingCell bad, good;
  bad.node = "bad";
  std::vector<Received> messages;
  for (int seq = 1; seq <= 1000; ++seq) {
    messages.push_back(bad.Probe(seq, kNow_ms));
    std::string& text = messages.back().payload;
    text.replace(text.find("\"payload_kg\":60"), 15, "\"payload_kg\":900");
    messages.push_back(good.Probe(seq, kNow_ms));
  }
  REQUIRE(store.Write(messages, kNow_s).ok());
  CHECK(Answer(database, "SELECT count(*) FROM probe") == "1000");
  // Some as letters, the rest of the batch by number.
  CHECK(Answer(database, "SELECT sum(messages) BETWEEN 20 AND 40 FROM dead_letter") == "t");
  CHECK(Answer(database,
               "SELECT limited + (SELECT sum(messages) FROM dead_letter) FROM cell WHERE "
               "node = 'bad'") == "1000");
}

TEST_CASE("births, deaths, files and lenses are those of the newest message") {
  if (test::PostgresPrograms().empty()) {
    WARN("SKIPPED: no PostgreSQL 15 here");
    return;
  }
  const test::PostgresProcess server;
  Connection database = server.ConnectToNewPlant();
  Admission admission(50, 5'000'000);
  MessageStore store = MessageStore::On(server.Connect(), admission).value();
  const test::PublishingCell cell;
  const std::string topic = "plumblineV1/line-1/";
  const auto birth = [](std::int64_t number, int dropped) {
    return fmt::format(
        R"({{"timestamp":1,"bdSeq":{},"version":"0.1.0","cell":"KR 210","stream":)"
        R"("0000a001","waiting":3,"dropped":{{"states":{},"changes":0,"others":0}}}})",
        number, dropped);
  };
  const auto file = [&](std::int64_t seq, std::int64_t utc_ms, const std::string& model) {
    return Received{
        topic + "NCELL/cell-1",
        fmt::format(R"({{"stream":"0000a001","seq":{},"timestamp":{},"fingerprint":"f{}",)"
                    R"("arm_model":"{}","installed":"2019-05-01","page":"","cell":"x"}})",
                    seq, utc_ms, seq, model)};
  };
  std::vector<Received> messages = {cell.Probe(5, kNow_ms),
                                    file(6, kNow_ms + 2, "KR 210 R2700-2"),
                                    file(7, kNow_ms + 1, "KR 120"),
                                    {topic + "NBIRTH/cell-1", birth(200, 4)},
                                    {topic + "NBIRTH/cell-1", birth(100, 2)},
                                    {topic + "NDEATH/cell-1", DeathText(100, 1, false)}};
  REQUIRE(store.Write(messages, kNow_s).ok());
  CHECK(Answer(database,
               "SELECT birth || ' ' || death || ' ' || online || ' ' || arm_model || ' ' || "
               "installed || ' ' || dropped || ' ' || (page IS NULL) FROM cell_now") ==
        "200 100 true KR 210 R2700-2 2019-05-01 4 true");
  CHECK(Answer(database, "SELECT count(*) FROM cell_file") == "2");
  // A state from a clock that was ahead is not the newest for ever.
  REQUIRE(store
              .Write(std::vector{cell.State(8, kNow_ms + 80'000'000), cell.State(9, kNow_ms + 5)},
                     kNow_s)
              .ok());
  CHECK(Answer(database, "SELECT state->>'seq' FROM cell") == "9");
  // A new queue counts from 1.
  test::PublishingCell renewed;
  renewed.stream = "0000a002";
  REQUIRE(store.Write(std::vector{renewed.Probe(3, kNow_ms)}, kNow_s).ok());
  CHECK(Answer(database, "SELECT first_seq || '-' || last_seq FROM gap") == "1-2");
  REQUIRE(
      store.Write(std::vector<Received>{{topic + "NDEATH/cell-1", DeathText(200, 1, true)}}, kNow_s)
          .ok());
  CHECK(Answer(database, "SELECT online FROM cell_now") == "f");
  REQUIRE(store.DropOld(kNow_s).ok());
}

}  // namespace plumbline::plant::message_store_test
