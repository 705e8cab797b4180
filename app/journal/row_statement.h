// A row of the journal and the columns of its table.
#pragma once

#include <optional>
#include <vector>

#include "app/journal/journal_row.h"
#include "app/sqlite/database.h"

namespace plumbline {

/// The statement that InsertRow() fills, and the one whose rows RowFrom() reads.
extern const char* const kInsertRow;
extern const char* const kSelectRows;

/// @param joints  the cell's, for their units; as many as the row has
bool InsertRow(Statement& statement, const JournalRow& row, const std::vector<Joint>& joints);

/// @return nothing where the row's joints are not as many as the cell's
std::optional<JournalRow> RowFrom(const Statement& statement, const std::vector<Joint>& joints);

}  // namespace plumbline
