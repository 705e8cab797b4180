// The journal's tables, and how older ones become these.
#pragma once

#include <optional>

#include "app/sqlite/database.h"

namespace plumbline {

inline constexpr int kJournalSchema = 5;

/// What a file that opened is: nothing where it is a journal up to this version or an empty file,
/// else why it is none.
std::optional<Error> WhyNoJournal(Database& database);

/// Makes the tables of an empty file, converts those of an older version; all or nothing.
Result<void> MigrateSchema(Database& database);

}  // namespace plumbline
