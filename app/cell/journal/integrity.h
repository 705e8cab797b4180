// Integrity of a journal file: what in it is no longer as it was written.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "app/base/sqlite/database.h"

namespace plumbline::cell {

/// Consecutive row numbers.
struct RowRange {
  std::int64_t first = 0, last = 0;
  bool operator==(const RowRange&) const = default;
};

struct IntegrityReport {
  std::int64_t rows = 0;           ///< intact rows of measurements
  std::int64_t last = 0;           ///< largest row number that was ever used
  std::vector<RowRange> damaged;   ///< changed since they were written, or unreadable
  std::vector<RowRange> missing;   ///< written, but no longer in the file
  std::vector<RowRange> lost;      ///< lost earlier, as a salvage recorded
  std::vector<std::string> other;  ///< damage outside the measurements, one sentence each
  std::string obstacle;            ///< why the check is incomplete: locked, disk error; else empty

  bool intact() const {
    return damaged.empty() && missing.empty() && other.empty() && obstacle.empty();
  }
};

/// Checks the structure of the file, the checksum of every row, and that no row number is missing.
/// Sees the file as it is at the start, whatever other connections add meanwhile.
/// @param step  progress callback, called every few milliseconds
IntegrityReport CheckIntegrity(sqlite::Database& database, const std::function<void()>& step);

/// "rows 3, 17 to 20 changed since written, or unreadable; row 40 missing"; empty if the file is
/// intact.
std::string DamageText(const IntegrityReport& report);

/// "row 3", "rows 3, 17 to 20"; every range.
std::string RowRangesText(const std::vector<RowRange>& ranges);

}  // namespace plumbline::cell
