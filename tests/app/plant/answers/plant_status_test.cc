// What `plumbline plant status` says of a real database.
#include "app/plant/answers/plant_status.h"

#include <catch2/catch.hpp>
#include <sstream>

#include "app/base/terminal/terminal_output.h"
#include "app/base/text/json_text.h"
#include "app/plant/answers/status_text.h"
#include "tests/app/plant/answers/plant_rows.h"
#include "tests/app/plant/database/postgres_process.h"

namespace plumbline::plant_status_test {

using namespace plumbline::plant;
using namespace plumbline::test;
using Catch::Contains;

namespace {

PlantState StateOf(Connection& connection) {
  auto plant = ReadPlantState(connection);
  INFO((plant ? "" : plant.error()));
  REQUIRE(plant);
  return std::move(plant).value();
}

}  // namespace

TEST_CASE("the status of a plant: absent, alarmed and lossy cells, unreadable messages") {
  if (PostgresPrograms().empty()) {
    WARN("SKIPPED: no PostgreSQL 15 here");
    return;
  }
  const PostgresProcess server;
  Connection owner = server.ConnectToNewPlant();
  CHECK_FALSE(NeedsPerson(StateOf(owner)));
  CHECK_THAT(StatusText(StateOf(owner)), Contains("0 cells"));
  FillPlant(owner, 30, 3);
  CHECK_FALSE(NeedsPerson(StateOf(owner)));
  CHECK_THAT(StatusText(StateOf(owner)), Contains("30 cells: 30 OK"));

  const auto run = [&](const char* statement) {
    const auto done = owner.Run(statement);
    INFO((done ? "" : done.error()));
    REQUIRE(done);
  };
  // Dropped messages are explained; new gaps may still be filled.
  run("INSERT INTO stream (cell, stream, first_seq, next_seq, dropped) VALUES (3, 1, 1, 1000, 50), "
      "(4, 1, 1, 1000, 20), (5, 1, 1, 9, 0)");
  run("INSERT INTO gap VALUES (3, 1, 100, 149, now() - interval '1 day'), "
      "(4, 1, 100, 149, now() - interval '1 day'), (5, 1, 2, 3, now())");
  auto plant = StateOf(owner);
  CHECK(plant.cells[3 - 1].name != "");
  std::map<std::int64_t, const CellState*> by_key;
  for (const CellState& cell : plant.cells) by_key[cell.cell] = &cell;
  CHECK(by_key[3]->missing == 50);
  CHECK(by_key[3]->unexplained == 0);
  CHECK(by_key[4]->unexplained == 30);
  CHECK(by_key[5]->missing == 2);
  CHECK(by_key[5]->unexplained == 0);
  CHECK(NeedsPerson(plant));

  // Whatever a cell sends in its state, the others are shown.
  run("UPDATE cell SET state = '{\"drift_statistic\": 1e400, \"proposed_model\": \"; DROP\", "
      "\"health_reason\": {\"a\": [1]}}', health = 2 WHERE cell = 1");
  run("UPDATE cell SET state = '[1, 2]' WHERE cell = 2");
  run("UPDATE cell SET state = NULL, health = 77, name = E'\\u202e\\u001b[2Jevil' WHERE cell = 6");
  run("UPDATE cell SET death = birth, clean_shutdown = true WHERE cell = 7");
  run("UPDATE cell SET death = birth, clean_shutdown = false WHERE cell = 8");
  run("UPDATE cell SET last_received = now() - interval '1 hour' WHERE cell = 9");
  run("UPDATE cell SET birth = NULL WHERE cell = 10");
  run("UPDATE cell SET limited = 12, limited_reason = 'too many', limited_last = now() "
      "WHERE cell = 11");
  run("UPDATE cell SET state_utc = now() - interval '1 hour', waiting = 4321 WHERE cell = 12");
  run("UPDATE cell SET state_utc = now() + interval '4 hours' WHERE cell = 13");
  run("INSERT INTO dead_letter (topic, reason, messages, bytes, payload) "
      "VALUES ('plumblineV1/x', 'is not JSON', 7, 3, 'abc')");
  run("INSERT INTO job (kind, key, finished, failed) VALUES ('diagnose', '1', now(), 'x')");
  plant = StateOf(owner);
  const std::string text = StatusText(plant);
  INFO(text);
  for (const char* const line :
       {"▲ 7 unreadable: is not JSON", "▲ 1 job failed within a day", "ALARM      line 1/",
        "shut down", "offline for", "connected, but silent for 60 min",
        "has not announced itself yet", "messages refused: too many", "catching up, its state is",
        "backlog      1 cell is catching up, at most 60 min behind; 4321 messages",
        "30 messages lost, unexplained", "refused      12 messages", "its clock was 4 h ahead",
        "7  is not JSON, for example"}) {
    CHECK_THAT(text, Contains(line));
  }
  // 80 columns, and nothing that a terminal would execute.
  std::ostringstream shown;
  {
    const terminal::TerminalOutput output(shown, 80, false);
    shown << terminal::ForReading << text;
  }
  CHECK_THAT(shown.str(), !Contains("\x1b"));
  std::istringstream lines(shown.str());
  for (std::string line; std::getline(lines, line);) {
    INFO(line);
    CHECK(terminal::ColumnsOf(line) <= 80);
  }
  const auto json = text::JsonOrNull(StatusJson(plant));
  CHECK(json.at("schema") == 1);
  CHECK(json.at("needs_person") == true);
  CHECK(json.at("cells").size() == 30);
  std::vector<std::string> names;
  for (const auto& [name, value] : json.at("cells").at(0).items()) names.push_back(name);
  CHECK(names == std::vector<std::string>{"arm_model", "arm_series", "findings", "health", "last",
                                          "line", "missing", "model", "name", "node", "online",
                                          "page", "proposed_model", "queued", "refused", "state",
                                          "state_time", "unexplained", "version"});

  // The collector's silence is one finding, not thirty.
  run("UPDATE cell SET last_received = now() - interval '2 hours'");
  CHECK_THAT(StatusText(StateOf(owner)),
             Contains("no message from any cell for 2 h: check plumbline-collect"));
}

}  // namespace plumbline::plant_status_test
