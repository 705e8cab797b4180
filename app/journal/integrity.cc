#include "app/journal/integrity.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "app/journal/row_checksum.h"

namespace plumbline::journal {
namespace {

constexpr int kStepsPerCallback = 20'000;  // of SQLite's virtual machine

/// Calls a function while statements of a connection run.
class Progress {
 public:
  Progress(sqlite::Database& database, const std::function<void()>& step)
      : database_(database), step_(step) {
    if (!step_) return;
    sqlite3_progress_handler(
        database_.get(), kStepsPerCallback,
        [](void* self) {
          static_cast<Progress*>(self)->step_();
          return 0;
        },
        this);
  }
  ~Progress() { sqlite3_progress_handler(database_.get(), 0, nullptr, nullptr); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

 private:
  sqlite::Database& database_;
  const std::function<void()>& step_;
};

void Add(std::vector<RowRange>& ranges, std::int64_t first, std::int64_t last) {
  if (first > last) return;
  if (!ranges.empty() && ranges.back().last == first - 1) {
    ranges.back().last = last;
  } else {
    ranges.push_back({first, last});
  }
}

/// Adds the rows of a range that no earlier salvage recorded as lost.
void AddMissing(IntegrityReport& report, std::int64_t first, std::int64_t last) {
  for (const RowRange& lost : report.lost) {
    if (lost.last < first || lost.first > last) continue;
    Add(report.missing, first, lost.first - 1);
    first = lost.last + 1;
  }
  Add(report.missing, first, last);
}

void CheckPages(sqlite::Database& database, IntegrityReport& report) {
  sqlite::Statement check(database.get(), "PRAGMA integrity_check(20)");
  int code = SQLITE_ROW;
  while ((code = check.Step()) == SQLITE_ROW) {
    if (const std::string line = check.Text(0); line != "ok") report.other.push_back(line);
  }
  if (code != SQLITE_DONE) report.other.push_back("its structure: " + database.Problem());
}

/// Tables whose rows nothing ever deletes, so that their numbers have no gaps.
void CheckRows(sqlite::Database& database, const SealedTable& table, IntegrityReport& report) {
  sqlite::Statement rows(database.get(),
                         fmt::format("SELECT {}, {} FROM {} ORDER BY 1", table.columns.front(),
                                     IntactSql(table), table.name));
  std::int64_t expected = 1;
  int code = SQLITE_ROW;
  while ((code = rows.Step()) == SQLITE_ROW) {
    if (rows.Integer(0) != expected || rows.Integer(1) == 0) {
      report.other.push_back(
          fmt::format("row {} of the table {} was changed or is missing", expected, table.name));
    }
    expected = rows.Integer(0) + 1;
  }
  if (code != SQLITE_DONE) {
    report.other.push_back(
        fmt::format("the table {} cannot be read: {}", table.name, database.Problem()));
  }
}

void ReadLost(sqlite::Database& database, IntegrityReport& report) {
  sqlite::Statement rows(database.get(), "SELECT first_row, last_row FROM lost_rows WHERE " +
                                             IntactSql(kLostTable) + " ORDER BY first_row");
  while (rows.Step() == SQLITE_ROW) report.lost.push_back({rows.Integer(0), rows.Integer(1)});
}

/// Looks up each row by its number, because a scan ends at the first page that is damaged.
void CheckOneByOne(sqlite::Database& database, std::int64_t first, std::int64_t last,
                   IntegrityReport& report) {
  sqlite::Statement row(database.get(), fmt::format("SELECT {}, checksum IS NULL FROM measurement "
                                                    "WHERE id = ?1",
                                                    IntactSql(kMeasurementTable)));
  for (std::int64_t id = first; id <= last; ++id) {
    row.Bind(1, id);
    const int code = row.Step();
    if (code == SQLITE_DONE) {
      AddMissing(report, id, id);
    } else if (code != SQLITE_ROW || row.Integer(0) == 0) {
      Add(report.damaged, id, id);
    } else {
      ++report.rows;
      report.unchecked += row.Integer(1);
    }
    row.Reset();
  }
}

void CheckMeasurements(sqlite::Database& database, IntegrityReport& report) {
  const Result<std::int64_t> last =
      database.IntegerOf("SELECT coalesce(max(seq), 0) FROM sqlite_sequence");
  const Result<std::int64_t> unchecked = database.IntegerOf("SELECT unchecked_through FROM epoch");
  if (!last || !unchecked) {
    report.other.emplace_back("the number of its rows cannot be read");
    return;
  }
  sqlite::Statement rows(database.get(),
                         fmt::format("SELECT id, {}, checksum IS NULL FROM measurement ORDER BY id",
                                     IntactSql(kMeasurementTable)));
  std::int64_t done = 0;
  int code = SQLITE_ROW;
  while ((code = rows.Step()) == SQLITE_ROW) {
    const std::int64_t id = rows.Integer(0);
    if (id <= done || id > *last) {
      report.other.push_back(fmt::format("a row has the impossible number {}", id));
      continue;
    }
    // Of rows without checksums it is not known whether all of them were ever there.
    AddMissing(report, std::max(done, *unchecked) + 1, id - 1);
    done = id;
    if (rows.Integer(1) == 0) {
      Add(report.damaged, id, id);
    } else {
      ++report.rows;
      report.unchecked += rows.Integer(2);
    }
  }
  if (code == SQLITE_DONE) {
    AddMissing(report, std::max(done, *unchecked) + 1, *last);
  } else {
    CheckOneByOne(database, done + 1, *last, report);
  }
}

}  // namespace

IntegrityReport CheckStructure(sqlite::Database& database, const std::function<void()>& step) {
  const Progress progress(database, step);
  IntegrityReport report;
  CheckPages(database, report);
  return report;
}

IntegrityReport CheckIntegrity(sqlite::Database& database, const std::function<void()>& step) {
  const Progress progress(database, step);
  IntegrityReport report;
  CheckPages(database, report);
  for (const SealedTable& table : SealedTables().subspan(1)) CheckRows(database, table, report);
  ReadLost(database, report);
  CheckMeasurements(database, report);
  return report;
}

std::string RowRangesText(const std::vector<RowRange>& ranges) {
  std::vector<std::string> parts;
  for (const RowRange& range : ranges) {
    parts.push_back(range.first == range.last ? fmt::format("{}", range.first)
                                              : fmt::format("{} to {}", range.first, range.last));
  }
  const bool one = ranges.size() == 1 && ranges.front().first == ranges.front().last;
  return fmt::format("row{} {}", one ? "" : "s", fmt::join(parts, ", "));
}

std::string DamageText(const IntegrityReport& report) {
  std::vector<std::string> parts;
  const auto add = [&parts](const std::vector<RowRange>& ranges, const char* what) {
    if (!ranges.empty()) parts.push_back(RowRangesText(ranges) + what);
  };
  add(report.damaged, " changed since written, or unreadable");
  add(report.missing, " missing");
  parts.insert(parts.end(), report.other.begin(), report.other.end());
  return fmt::format("{}", fmt::join(parts, "; "));
}

}  // namespace plumbline::journal
