#include "app/plant/database/schema.h"

#include <catch2/catch.hpp>

#include "tests/app/plant/database/postgres_process.h"

namespace plumbline::plant::schema_test {

using test::PostgresProcess;

TEST_CASE("the schema is created once, and each role has only its rights") {
  if (test::PostgresPrograms().empty()) {
    WARN("SKIPPED: no PostgreSQL 15 here");
    return;
  }
  const PostgresProcess server;
  Connection owner = server.Connect();
  CHECK_FALSE(RequireSchema(owner).ok());
  REQUIRE(Migrate(owner).value() == 0);
  REQUIRE(Migrate(owner).value() == CurrentSchema());
  REQUIRE(RequireSchema(owner).ok());
  REQUIRE(GrantRights(owner).ok());
  REQUIRE(GrantRights(owner).ok());
  REQUIRE(owner
              .RunScript("CREATE ROLE c LOGIN IN ROLE plumbline_collector;"
                         "CREATE ROLE r LOGIN IN ROLE plumbline_reader;"
                         "CREATE ROLE w LOGIN IN ROLE plumbline_worker")
              .ok());

  Connection collector = server.Connect("c"), reader = server.Connect("r");
  Connection worker = server.Connect("w");
  CHECK(collector.Run("INSERT INTO cell (line, node) VALUES ($1, $2)", {"line", "n'1\\"}).ok());
  CHECK(collector.Run("SELECT ensure_month('2026-03-31T23:00Z'), ensure_month('2026-03-02')").ok());
  CHECK_FALSE(collector.Run("DELETE FROM cell").ok());
  CHECK(collector.last_state() == "42501");
  CHECK_FALSE(collector.Run("INSERT INTO job (kind, key) VALUES ('x', 'y')").ok());

  CHECK(reader.Run("SELECT node FROM cell")->Text(0, 0) == "n'1\\");
  CHECK_FALSE(reader.Run("INSERT INTO cell (line, node) VALUES ('a', 'b')").ok());
  CHECK_FALSE(reader.Run("SELECT drop_old()").ok());
  CHECK(worker.Run("INSERT INTO job (kind, key) VALUES ('diagnose', '1')").ok());
  CHECK_FALSE(worker.Run("DELETE FROM job").ok());

  // Only the owner decides how long messages are kept.
  CHECK_FALSE(collector.Run("UPDATE setting SET retention_months = 1").ok());
  CHECK(collector.Run("SELECT ensure_month(now() - interval '30 months')").ok());
  CHECK(collector.Run("SELECT drop_old()")->Integer(0, 0) == 5);
  CHECK(owner.Run("UPDATE setting SET retention_months = 0").ok());
  CHECK(collector.Run("SELECT drop_old()")->Integer(0, 0) == 0);
}

TEST_CASE("a partition holds the month of UTC") {
  if (test::PostgresPrograms().empty()) {
    WARN("SKIPPED: no PostgreSQL 15 here");
    return;
  }
  const PostgresProcess server("timezone = 'Asia/Tokyo'");
  Connection owner = server.ConnectToNewPlant();
  REQUIRE(owner
              .RunScript(
                  "SET timezone = 'America/New_York'; SELECT ensure_month('2026-03-31T23:59:59Z')")
              .ok());
  const char* const insert =
      "INSERT INTO alarm VALUES (1, 1, $1, $2, 'alarms', 0, true, 'robot stale')";
  CHECK(owner.Run(insert, {1, "2026-03-01T00:00:00Z"}).ok());
  CHECK(owner.Run(insert, {2, "2026-03-31T23:59:59Z"}).ok());
  CHECK_FALSE(owner.Run(insert, {3, "2026-04-01T00:00:00Z"}).ok());
  CHECK_FALSE(owner.Run(insert, {1, "2026-03-01T00:00:00Z"}).ok());
  CHECK(owner.last_state() == "23505");
}

}  // namespace plumbline::plant::schema_test
