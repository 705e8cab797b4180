// Salvage of a damaged journal: its intact rows in a new file, the damaged file beside it.
#pragma once

#include <string>
#include <vector>

#include "app/cell/journal/integrity.h"
#include "firmware-like/result.h"

namespace plumbline::cell {

struct Salvage {
  std::int64_t saved = 0;          ///< rows, under their previous numbers
  IntegrityReport found;           ///< of the damaged file
  std::string damaged_file;        ///< its new path
  std::vector<std::string> notes;  ///< what else was lost, one sentence each
};

/// Copies every intact row of a damaged journal into a new file, which takes its place, and records
/// in it which rows are lost. The damaged file is moved aside unchanged.
/// @param unix_ms  wall clock, for the record and the moved file's name
/// @return         why nothing was changed: the journal is intact, in use, or not readable at all
Result<Salvage> SalvageJournal(const std::string& path, std::int64_t unix_ms);

}  // namespace plumbline::cell
