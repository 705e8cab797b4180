// SQL schema of the journal, and migration of older schemas.
#pragma once

#include "app/base/sqlite/store_identity.h"

namespace plumbline::cell {

inline constexpr int kJournalSchema = 9;

inline constexpr sqlite::StoreIdentity kJournalIdentity{0x504C4A31, kJournalSchema,  // "PLJ1"
                                                        "a plumbline journal"};

/// Creates the tables of an empty file or converts those of an older schema, in one transaction.
Result<void> MigrateSchema(sqlite::Database& database);

}  // namespace plumbline::cell
