// Reader of new probes in the measurement journal.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/base/sqlite/database.h"
#include "app/cell/journal/journal_row.h"

namespace plumbline::plant {

/// A probe as it is in the journal. `journal` and `id` identify it permanently. Its time is always
/// set; what was measured may be a tip, a range, or the reading of a gauge.
struct ProbeRow : cell::JournalRow {
  std::int64_t journal = 0;  ///< the epoch of the journal, UTC [s]
};

/// Last row that was processed.
struct ProbeMark {
  std::int64_t journal = 0, id = 0;
};

/// Reads the rows after a mark in the order of their ids; imported rows are skipped. Opens the file
/// read-only each time and holds no lock, so that the daemon's writes are not blocked. A row is
/// returned only if it existed at the previous call: by then the drift monitor has marked it.
class ProbeTail {
 public:
  static constexpr int kMaxRows = 1000;
  /// @param joints  the cell's joints, for their units
  ProbeTail(std::string path, std::vector<model::Joint> joints)
      : path_(std::move(path)), joints_(std::move(joints)) {}

  struct Taken {
    std::vector<ProbeRow> probes;
    ProbeMark mark;   ///< after these probes
    int skipped = 0;  ///< rows that do not have the cell's joints: recorded with another robot
  };
  /// @param mark  nullopt at the first use: only rows added from now on are returned
  /// @return      the new rows, or why the journal cannot be read; a missing journal has no rows
  Result<Taken> ReadNew(const std::optional<ProbeMark>& mark);

 private:
  const std::string path_;
  const std::vector<model::Joint> joints_;
  ProbeMark settled_;  ///< last row at the previous call
};

}  // namespace plumbline::plant
