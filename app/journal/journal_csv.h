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
  std::vector<std::string> notes;  ///< columns left out, and why
  std::vector<std::int64_t> ids;   ///< of the rows written, in their order (line 2 is ids[0])
};

/// A measured.csv (formats.md) of journal rows. A column is written where every row has its value;
/// one that only some rows have is left out, and that is noted, as a missing value must never look
/// like zero. Rows without a measured point of the kind that most of them have are left out, and
/// that is noted too. t_s is what the journal has; where probes and imported rows stand together it
/// is left out, as they count from different moments.
ExportedCsv CsvFromJournal(const std::vector<JournalRow>& rows, const std::vector<Joint>& joints);

}  // namespace plumbline
