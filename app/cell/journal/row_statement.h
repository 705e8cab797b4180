// Conversion between journal rows and the columns of their table.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/base/sqlite/database.h"
#include "app/cell/journal/journal_row.h"

namespace plumbline::cell {

/// SQL for InsertRow(), and for the rows that RowFrom() reads.
extern const char* const kInsertRow;
std::string SelectRowsSql();
/// Columns of SelectRowsSql(): the row's number, and whether it is as it was written.
inline constexpr int kIdColumn = 25, kIntactColumn = 36;

/// Binds a row to a kInsertRow statement and runs it.
/// @param joints  the cell's joints, for their units; as many as the row has
bool InsertRow(sqlite::Statement& statement, const JournalRow& row,
               const std::vector<model::Joint>& joints);

/// Reads the current row of a SelectRowsSql() statement.
/// @return  nullopt if the row has a different number of joints than the cell
std::optional<JournalRow> RowFrom(const sqlite::Statement& statement,
                                  const std::vector<model::Joint>& joints);

}  // namespace plumbline::cell
