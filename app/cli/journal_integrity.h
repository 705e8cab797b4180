// `plumbline journal check` and `salvage`.
#pragma once

#include <string>

namespace plumbline::cli {

/// Prints what is damaged in a journal. @return the exit code
int CheckJournalFile(const std::string& file, bool json);

/// Saves the intact rows of a damaged journal in a new one. @return the exit code
int SalvageJournalFile(const std::string& file);

}  // namespace plumbline::cli
