// Import and export of journal rows as measured.csv.
#pragma once

#include <string>
#include <vector>

#include "app/cell/journal/journal_row.h"
#include "app/measure/table/csv.h"

namespace plumbline::cell {

/// Rows to be appended, in file order, with source kImport and no prediction.
std::vector<JournalRow> JournalRowsFrom(const measure::MeasuredTable& table);

struct ExportedCsv {
  std::string text;                ///< header and one line for each row
  std::vector<std::string> notes;  ///< columns and rows left out, and why
  std::vector<std::int64_t> ids;   ///< of the rows written, in their order (line 2 is ids[0])
};

/// Exports journal rows as measured.csv (docs/reference/files.md). A missing value must never look
/// like zero: a column is written only if every exported row has its value. If few rows lack it
/// (under a tenth of all, and of the newest fifty) these rows are left out, otherwise the column
/// is. Rows without a measured point of the kind that most rows have are left out. Everything left
/// out is noted. t_s is taken from the journal. Probes and imported rows measure it from different
/// origins, so rows of the less frequent kind are treated as lacking it.
ExportedCsv CsvFromJournal(const std::vector<JournalRow>& rows,
                           const std::vector<model::Joint>& joints);

}  // namespace plumbline::cell
