// measured.csv -> journal rows -> measured.csv.
#pragma once

#include <string>
#include <vector>

#include "app/journal/journal_row.h"
#include "app/table/csv.h"

namespace plumbline {

/// Rows to be appended, in file order, source kImport. Nothing was predicted for them.
std::vector<JournalRow> JournalRowsFrom(const MeasuredTable& table);

struct ExportedCsv {
  std::string text;                ///< header and one line a row
  std::vector<std::string> notes;  ///< columns and rows left out, and why
  std::vector<std::int64_t> ids;   ///< of the rows written, in their order (line 2 is ids[0])
};

/// A measured.csv (formats.md) of journal rows. A missing value must never look like zero: a column
/// is written where every row written has its value. Where few rows lack it (under a tenth of all,
/// and of the newest fifty) these rows are left out, else the column is. Rows without a measured
/// point of the kind that most of them have are left out. All of that is noted. t_s is what the
/// journal has; probes and imported rows count it from different moments, so that those which are
/// fewer lack it.
ExportedCsv CsvFromJournal(const std::vector<JournalRow>& rows, const std::vector<Joint>& joints);

}  // namespace plumbline
