// Rows of the journal as readable text and as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "app/cell/journal/journal_row.h"

namespace plumbline::cli {

/// In mm, degrees and the units of measured.csv; what was not recorded is absent.
nlohmann::json JournalRowJson(const cell::JournalRow& row);
/// One line of a table with the columns of JournalHeader().
std::string JournalRowText(const cell::JournalRow& row);
std::string JournalHeader();

}  // namespace plumbline::cli
