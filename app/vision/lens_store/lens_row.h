// Mapping between lens entries and rows of the store's table, with schema migration.
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
/// Migrates the tables of an older version within the caller's transaction. Every lens retains its
/// id. Older schemas:
///  - 1 stored a pupil shift that had not been measured (0) and no uncertainty;
///  - 2 stored lenses of five distortion coefficients only, which are trusted in the whole image;
///  - 3 stored no declarations: its lenses have none.
/// @param damaged  set to true if a row fails its checksum
/// @return         an error if a row fails its checksum or the database fails
Result<void> MigrateLensSchema(sqlite::Database& database, std::int64_t version, bool& damaged);

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
