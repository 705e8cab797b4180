// Mapping between lens entries and rows of the store's table.
#pragma once

#include <optional>

#include "app/base/sqlite/database.h"
#include "app/vision/lens_store/lens_entry.h"

namespace plumbline::vision {

/// Creates the table, its index, and triggers that refuse to change or remove a row.
extern const char* const kLensSchema;
extern const char* const kInsertLens;
extern const char* const kSelectLens;  ///< all rows, unordered

inline constexpr int kLensSchemaVersion = 4;
/// Inserts under the entry's id, or the next free one if that is 0.
/// @param statement  prepared from kInsertLens
bool InsertLens(sqlite::Statement& statement, const LensEntry& entry);

/// @param row  of kSelectLens
/// @return     nullopt if the row is damaged: a missing or invalid value (FaultOf) or a wrong
///             checksum
std::optional<LensEntry> ReadLensEntry(const sqlite::Statement& row);
/// Likewise, without verifying the checksum.
std::optional<LensEntry> ReadLensValues(const sqlite::Statement& row);
std::int64_t RowId(const sqlite::Statement& row);

}  // namespace plumbline::vision
