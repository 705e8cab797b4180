// Stored rows of one cell, and the file that declares it, as `plumbline diagnose` takes them.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/cell/journal/journal_row.h"
#include "app/plant/database/connection.h"

namespace plumbline::plant {

/// A cell of the database, addressed by its topics.
struct CellName {
  int cell = 0;
  std::string line, node;
  std::string Text() const { return line + "/" + node; }
};

/// @param text  "LINE/NODE"
/// @return      or that the database has no such cell, with the cells of that line
Result<CellName> FindCell(Connection& connection, const std::string& text);

/// Which probes of a cell; all conditions that are set must hold.
struct RowSelection {
  std::string since = {}, until = {};               ///< UTC, both inclusive; empty: unlimited
  std::optional<std::int64_t> last = std::nullopt;  ///< only this many, the newest
  std::optional<int> model = std::nullopt;          ///< only those predicted by this model version
  bool quarantined = false;  ///< also those that wait for a decision or were rejected
};

/// What a cell declared and applied at some time: cell.toml with the effects in force.
struct CellFile {
  std::string utc, fingerprint;
  std::optional<int> model;
  std::string toml;
};

/// @param utc, fingerprint  which file; both empty: the newest
Result<CellFile> ReadCellFile(Connection& connection, const CellName& cell,
                              const std::string& utc = "", const std::string& fingerprint = "");

/// Rows as measured.csv.
struct CellRows {
  std::string csv;
  int rows = 0;
  double time_zero_utc_s = 0;      ///< at which t_s is 0: the oldest journal's epoch
  std::vector<std::string> notes;  ///< columns and rows left out, and why
};

/// @param toml  the cell's file, from which the joints and their units are known
/// @return      why there are none: no such rows, or a cell file with faults
Result<CellRows> ReadCellRows(Connection& connection, const CellName& cell, const std::string& toml,
                              const RowSelection& selection);

/// Adds to a row what NPROBE has beside the columns of the table `probe`, under the names that
/// ProbeBody() gives them. Pure; members of another type are ignored.
void AddFurtherColumns(const nlohmann::json& more, const std::vector<model::Joint>& joints,
                       cell::JournalRow& row);

}  // namespace plumbline::plant
