// New probes of the measurement journal, which the daemon writes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/journal/journal_row.h"
#include "app/sqlite/database.h"

namespace plumbline {

/// A probe with its prediction; its joints are not read. `journal` and `id` together name it for
/// ever; time, measured and predicted tip are there.
struct ProbeRow : JournalRow {
  std::int64_t journal = 0;  ///< the epoch of the journal, UTC [s]
};

/// Up to which row all was taken.
struct ProbeMark {
  std::int64_t journal = 0, id = 0;
};

/// Reads the rows behind a mark, in the order of their ids; imported ones are no probes, and left
/// out. Opens the file each time for reading alone, and holds nothing: the daemon's writing is
/// never in the way of it. A row counts when it was there at the look before: by then the monitor
/// has marked it.
class ProbeTail {
 public:
  static constexpr int kMostAtOnce = 1000;
  explicit ProbeTail(std::string path) : path_(std::move(path)) {}

  struct Taken {
    std::vector<ProbeRow> probes;
    ProbeMark mark;  ///< behind them
  };
  /// @param mark  nothing: never looked; then only what comes from now on counts
  /// @return      why it cannot be read; a journal that is not there has no rows
  Result<Taken> Look(const std::optional<ProbeMark>& mark);

 private:
  const std::string path_;
  ProbeMark settled_;  ///< the last row at the look before
};

}  // namespace plumbline
