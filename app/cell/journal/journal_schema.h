// SQL schema of the journal.
#pragma once

#include "app/base/sqlite/database.h"

namespace plumbline::cell {

inline constexpr int kJournalSchema = 9;

inline constexpr sqlite::StoreIdentity kJournalIdentity{0x504C4A31, kJournalSchema,  // "PLJ1"
                                                        "a plumbline journal"};

/// Creates the tables of an empty file.
Result<void> CreateSchema(sqlite::Database& database);

}  // namespace plumbline::cell
