// A lens as a row of the store's table.
#pragma once

#include <optional>

#include "app/lens_store/lens_entry.h"
#include "app/sqlite/database.h"

namespace plumbline {

/// Makes the table, its index, and the triggers that refuse to change or remove a row.
extern const char* const kLensSchema;
extern const char* const kInsertLens;
extern const char* const kSelectLens;  ///< all rows, without order

inline constexpr int kLensSchemaVersion = 2;
/// Brings the tables of an older version to this one, within the caller's transaction: every lens
/// keeps its number. Schema 1 told a shift of the entrance pupil that nobody had measured (0), and
/// no uncertainty.
/// @param damaged  becomes true where a row fails its checksum
/// @return         why not: that, or the disk
Result<void> BringToLensSchema(Database& database, std::int64_t version, bool& damaged);

/// Under the entry's id, or the next one where that is 0. @param statement  of kInsertLens
bool InsertLens(Statement& statement, const LensEntry& entry);

/// @param row  of kSelectLens
/// @return     nothing where the row is damaged: a value that is missing or that no lens has
///             (FaultOf), another checksum
std::optional<LensEntry> EntryOfRow(const Statement& row);
/// The same, whatever the checksum.
std::optional<LensEntry> ValuesOfRow(const Statement& row);
std::int64_t IdOfRow(const Statement& row);

}  // namespace plumbline
