// Checksums of the journal's rows.
#pragma once

#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "app/base/sqlite/database.h"

namespace plumbline::cell {

/// A table whose rows have a checksum over all their other columns, in the column `checksum`.
struct SealedTable {
  const char* name;
  std::span<const char* const> columns;  ///< without the checksum; the first is the row's number
};
extern const SealedTable kMeasurementTable, kEpochTable, kImportTable, kRestartTable,
    kDecisionTable, kLostTable;
/// All of them, in this order.
std::span<const SealedTable> SealedTables();

/// Makes the SQL function row_checksum(...) available to a connection: 64-bit FNV-1a over the types
/// and values of its arguments.
Result<void> AddChecksumFunction(sqlite::Database& database);

/// SQL expression: whether a row is as it was written.
std::string IntactSql(const SealedTable& table);
/// SQL statement that seals rows after they were inserted.
std::string SealSql(const SealedTable& table, std::string_view where);
/// SQL statement that changes columns of an intact row, and seals it again; of a damaged row it
/// changes nothing.
/// @param changes  columns with their new values as SQL
/// @param where    condition
std::string ChangeSql(const SealedTable& table,
                      std::initializer_list<std::pair<std::string_view, std::string_view>> changes,
                      std::string_view where);

/// "id, file, ..."
std::string ColumnsText(const SealedTable& table);

}  // namespace plumbline::cell
