// Identity of a store: whether an SQLite file belongs to this product, and which schema it has.
#pragma once

#include "app/base/sqlite/database.h"

namespace plumbline::sqlite {

/// Identification that a store writes into the header of its file.
struct StoreIdentity {
  std::int64_t application_id;  ///< PRAGMA application_id, shown by file(1)
  int schema;                   ///< PRAGMA user_version of this version of the product
  const char* name;             ///< with its article: "a plumbline journal"

  /// SQL that marks a new file as such a store.
  std::string Mark() const;
};

/// Schema of an open file: identity.schema, or 0 if its tables have not been created yet.
/// Errors: the file cannot be read, belongs to another program, or has another schema.
Result<std::int64_t> SchemaOf(Database& database, const StoreIdentity& identity);

/// The same for a reader, which cannot create tables: also an error if the file is empty.
Result<void> RequireCurrentSchema(Database& database, const StoreIdentity& identity);

/// Error message "PATH: WHAT: the database's problem".
Error Failure(const Database& database, std::string_view what);

}  // namespace plumbline::sqlite
