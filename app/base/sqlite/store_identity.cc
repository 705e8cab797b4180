#include "app/base/sqlite/store_identity.h"

#include <fmt/format.h>

namespace plumbline::sqlite {

std::string StoreIdentity::Mark() const {
  return fmt::format("PRAGMA application_id={}; PRAGMA user_version={}", application_id, schema);
}

Result<std::int64_t> SchemaOf(Database& database, const StoreIdentity& identity) {
  // SQLite detects a file that is not a database when it first reads it.
  const Result<std::int64_t> tables = database.IntegerOf("SELECT count(*) FROM sqlite_master");
  if (!tables) return Failure(database, "cannot be read");
  const Result<std::int64_t> schema = database.IntegerOf("PRAGMA user_version");
  if (!schema) return schema;
  const Result<std::int64_t> application = database.IntegerOf("PRAGMA application_id");
  if (!application) return application;
  if (*tables > 0 && *application != identity.application_id) {
    return Error{fmt::format("{}: is a database, but not {}; move the file away", database.path(),
                             identity.name)};
  }
  if (*schema > identity.schema) {
    return Error{
        fmt::format("{}: written by a newer plumbline (schema {}, this one knows {}); install that "
                    "version again, or move the file away to start a new one",
                    database.path(), *schema, identity.schema)};
  }
  if (*tables > 0 && *schema < identity.schema) {
    return Error{
        fmt::format("{}: written by a development version before 0.1.0 (schema {}, this one knows "
                    "{}); move the file away to start a new one",
                    database.path(), *schema, identity.schema)};
  }
  return *tables == 0 ? 0 : *schema;
}

Result<void> RequireCurrentSchema(Database& database, const StoreIdentity& identity) {
  const Result<std::int64_t> schema = SchemaOf(database, identity);
  if (!schema) return schema.failure();
  if (*schema != 0) return {};
  return Error{fmt::format("{}: is empty, not {} yet", database.path(), identity.name)};
}

Error Failure(const Database& database, std::string_view what) {
  return Error{fmt::format("{}: {}: {}", database.path(), what, database.Problem())};
}

}  // namespace plumbline::sqlite
