// Every query of the PostgreSQL dashboard is prepared against the schema, as a reader.
#include <catch2/catch.hpp>
#include <regex>
#include <set>

#include "app/base/text/json_text.h"
#include "tests/app/plant/database/postgres_process.h"
#include "tests/file_text.h"

namespace plumbline::plant_dashboard_test {

using namespace plumbline::test;

namespace {

/// The query with Grafana's macros and variables expanded as Grafana 10 does for PostgreSQL.
std::string Expanded(std::string query) {
  const std::pair<const char*, const char*> macros[] = {
      {R"(\$__timeFilter\(([a-z]+)\))",
       "$1 BETWEEN '2026-11-01T00:00:00Z' AND '2026-11-30T00:00:00Z'"},
      {R"(\$__timeGroupAlias\(([a-z]+), *'1h'\))",
       "floor(extract(epoch from $1)/3600)*3600 AS \"time\""},
      {R"(\$line\b)", "'line 1','line 2'"},
      {R"(\$cell\b)", "1"}};
  for (const auto& [pattern, text] : macros) {
    query = std::regex_replace(query, std::regex(pattern), text);
  }
  return query;
}

}  // namespace

TEST_CASE("every query of the PostgreSQL dashboard fits the schema and a reader's rights") {
  if (PostgresPrograms().empty()) {
    WARN("SKIPPED: no PostgreSQL 15 here");
    return;
  }
  const PostgresProcess server;
  plant::Connection owner = server.ConnectToNewPlant();
  REQUIRE(owner.RunScript("CREATE ROLE r LOGIN IN ROLE plumbline_reader").ok());
  plant::Connection reader = server.Connect("r");
  REQUIRE(reader.RunScript("SET search_path = public").ok());  // as Grafana's connection
  const auto board = text::JsonOrNull(FileText("config/plant/grafana/plant-postgresql.json"));
  std::vector<std::pair<std::string, std::string>> queries;  // title, SQL
  std::set<int> ids;
  for (const auto& panel : board.at("panels")) {
    CHECK(ids.insert(panel.at("id").get<int>()).second);
    for (const auto& target : panel.at("targets")) {
      queries.emplace_back(panel.at("title"), target.at("rawSql"));
    }
  }
  for (const auto& variable : board.at("templating").at("list")) {
    if (variable.at("type") == "query") {
      queries.emplace_back(variable.at("name"), variable.at("query"));
    }
  }
  for (const auto& note : board.at("annotations").at("list")) {
    queries.emplace_back(note.at("name"), note.at("target").at("rawSql"));
  }
  CHECK(queries.size() >= 15);
  for (const auto& [title, sql] : queries) {
    CAPTURE(title, sql);
    const std::string expanded = Expanded(sql);
    CHECK(expanded.find('$') == std::string::npos);
    const auto prepared = reader.RunScript("PREPARE q AS " + expanded);
    INFO((prepared ? "" : prepared.error()));
    REQUIRE(prepared);
    const auto ran = reader.RunScript("EXECUTE q");  // PREPARE does not check rights
    INFO((ran ? "" : ran.error()));
    CHECK(ran);
    REQUIRE(reader.RunScript("DEALLOCATE q").ok());
  }
}

}  // namespace plumbline::plant_dashboard_test
