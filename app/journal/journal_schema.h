// SQL schema of the journal, and migration of older schemas.
#pragma once

#include <optional>

#include "app/sqlite/database.h"

namespace plumbline::journal {

inline constexpr int kJournalSchema = 5;

/// Why an open file is not a usable journal; nullopt if it is a journal of this or an older schema,
/// or an empty file.
std::optional<Error> JournalFileFault(sqlite::Database& database);

/// Creates the tables of an empty file or converts those of an older schema, in one transaction.
Result<void> MigrateSchema(sqlite::Database& database);

}  // namespace plumbline::journal
