#include "app/plant/database/schema.h"

#include <fmt/format.h>

#include "app/plant/database/migrations.h"

namespace plumbline::plant {
namespace {

/// Any number, the same in every version of the program.
constexpr const char* kLock = "SELECT pg_advisory_xact_lock(5066611)";

}  // namespace

int CurrentSchema() {
  return static_cast<int>(Migrations().size());
}

Result<SchemaState> ReadSchema(Connection& connection) {
  const auto present = connection.Run("SELECT to_regclass('plumbline.schema_version') IS NOT NULL");
  if (!present) return present.failure();
  if (!present->Bool(0, 0)) return SchemaState{};
  const auto version =
      connection.Run("SELECT coalesce(max(version), 0) FROM plumbline.schema_version");
  if (!version) return version.failure();
  return SchemaState{static_cast<int>(version->Integer(0, 0))};
}

Result<int> Migrate(Connection& connection) {
  DatabaseTransaction transaction(connection);
  if (!transaction.begun()) return transaction.begun().failure();
  if (const auto locked = connection.Run(kLock); !locked) return locked.failure();
  const auto found = ReadSchema(connection);
  if (!found) return found.failure();
  if (found->version > CurrentSchema()) {
    return Error{
        fmt::format("the database has schema {}, this program knows up to {}; update "
                    "plumbline on this machine",
                    found->version, CurrentSchema())};
  }
  for (int version = found->version; version < CurrentSchema(); ++version) {
    const auto done = connection.RunScript(Migrations()[static_cast<std::size_t>(version)]);
    if (!done) return Error{fmt::format("migration {}: {}", version + 1, done.error())};
    const auto noted =
        connection.Run("INSERT INTO plumbline.schema_version (version) VALUES ($1)", {version + 1});
    if (!noted) return noted.failure();
  }
  if (const auto done = transaction.Commit(); !done) return done.failure();
  return found->version;
}

Result<void> RequireSchema(Connection& connection) {
  const auto found = ReadSchema(connection);
  if (!found) return found.failure();
  if (found->version == CurrentSchema()) return {};
  if (found->version == 0) {
    return Error{"the database has no tables of a plant; create them with `plumbline plant init`"};
  }
  return Error{fmt::format(
      "the database has schema {}, this program needs {}; {}", found->version, CurrentSchema(),
      found->version < CurrentSchema() ? "bring it forward with `plumbline plant init`"
                                       : "update plumbline on this machine")};
}

Result<void> GrantRights(Connection& connection) {
  return connection.RunScript(kRights);
}

}  // namespace plumbline::plant
