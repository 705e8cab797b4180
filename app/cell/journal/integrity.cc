#include "app/cell/journal/integrity.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string_view>

#include "app/cell/journal/row_checksum.h"

namespace plumbline::cell {
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

/// Read transaction: what other connections commit meanwhile is not seen.
class Snapshot {
 public:
  explicit Snapshot(sqlite::Database& database) : database_(database) { database_.Run("BEGIN"); }
  ~Snapshot() { database_.Run("COMMIT"); }
  Snapshot(const Snapshot&) = delete;
  Snapshot& operator=(const Snapshot&) = delete;

 private:
  sqlite::Database& database_;
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

/// What a statement that failed means: damage, or an obstacle to the check.
void AddFailure(sqlite::Database& database, const std::string& what, IntegrityReport& report) {
  const int code = sqlite3_errcode(database.get()) & 0xFF;
  const bool damage = code == SQLITE_CORRUPT || code == SQLITE_NOTADB || code == SQLITE_ERROR ||
                      code == SQLITE_DONE;
  const std::string text = what + ": " + database.Problem();
  if (damage) {
    report.other.push_back(text);
  } else {
    report.obstacle = text;
  }
}

/// The sentences of SQLite's report, without its heading "*** in database main ***".
void AddLines(std::string_view report_text, std::vector<std::string>& lines) {
  while (!report_text.empty()) {
    const std::string_view line = report_text.substr(0, report_text.find('\n'));
    if (!line.empty() && line != "ok" && !line.starts_with("***")) lines.emplace_back(line);
    report_text.remove_prefix(std::min(line.size() + 1, report_text.size()));
  }
}

void CheckPages(sqlite::Database& database, IntegrityReport& report) {
  sqlite::Statement check(database.get(), "PRAGMA integrity_check(20)");
  int code = SQLITE_ROW;
  while ((code = check.Step()) == SQLITE_ROW) {
    AddLines(check.Text(0), report.other);
  }
  if (code != SQLITE_DONE) AddFailure(database, "its structure cannot be read", report);
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
    AddFailure(database, fmt::format("the table {} cannot be read", table.name), report);
  }
}

void ReadLost(sqlite::Database& database, IntegrityReport& report) {
  sqlite::Statement rows(database.get(), "SELECT first_row, last_row FROM lost_rows WHERE " +
                                             IntactSql(kLostTable) + " ORDER BY first_row");
  while (rows.Step() == SQLITE_ROW) report.lost.push_back({rows.Integer(0), rows.Integer(1)});
}

/// Looks up each row by its number, because a scan ends at the first page that is damaged.
void CheckOneByOne(sqlite::Database& database, const std::string& intact, RowRange rows,
                   IntegrityReport& report) {
  sqlite::Statement row(database.get(),
                        fmt::format("SELECT {} FROM measurement WHERE id = ?1", intact));
  for (std::int64_t id = rows.first; id <= rows.last; ++id) {
    row.Bind(1, id);
    const int code = row.Step();
    if (code == SQLITE_DONE) {
      AddMissing(report, id, id);
    } else if (code != SQLITE_ROW && code != SQLITE_CORRUPT) {
      return AddFailure(database, fmt::format("row {} cannot be read", id), report);
    } else if (code != SQLITE_ROW || row.Integer(0) == 0) {
      Add(report.damaged, id, id);
    } else {
      ++report.rows;
    }
    row.Reset();
  }
}

/// SQLite's counter; without it, the largest number found. More rows than the file has room for do
/// not exist, whatever the counter says.
std::int64_t LastNumber(sqlite::Database& database, IntegrityReport& report) {
  constexpr std::int64_t kSmallestRow_bytes = 20;
  const auto number = [&database](const char* sql) {
    const Result<std::int64_t> value = database.IntegerOf(sql);
    return value ? *value : 0;
  };
  const std::int64_t largest = number("SELECT coalesce(max(id), 0) FROM measurement");
  const std::int64_t counted = number("SELECT coalesce(max(seq), 0) FROM sqlite_sequence");
  std::int64_t room = number("PRAGMA page_count") * number("PRAGMA page_size") / kSmallestRow_bytes;
  for (const RowRange& range : report.lost) room += range.last - range.first + 1;
  if (counted < largest || counted > room) {
    report.other.push_back(fmt::format("the counter of its rows is {}", counted));
  }
  return std::min(std::max(largest, counted), room);
}

void CheckEpoch(sqlite::Database& database, IntegrityReport& report) {
  sqlite::Statement epoch(database.get(),
                          fmt::format("SELECT {} FROM epoch", IntactSql(kEpochTable)));
  const int code = epoch.Step();
  if (code == SQLITE_DONE) {
    report.other.emplace_back("its epoch is missing");
  } else if (code != SQLITE_ROW) {
    AddFailure(database, "its epoch cannot be read", report);
  }
}

void CheckMeasurements(sqlite::Database& database, IntegrityReport& report) {
  report.last = LastNumber(database, report);
  CheckEpoch(database, report);
  if (!report.obstacle.empty()) return;
  const std::string intact = IntactSql(kMeasurementTable);
  sqlite::Statement rows(database.get(),
                         fmt::format("SELECT id, {} FROM measurement ORDER BY id", intact));
  std::int64_t done = 0;
  int code = SQLITE_ROW;
  while ((code = rows.Step()) == SQLITE_ROW) {
    const std::int64_t id = rows.Integer(0);
    if (id <= done || id > report.last) {
      report.other.push_back(fmt::format("a row has the impossible number {}", id));
      continue;
    }
    AddMissing(report, done + 1, id - 1);
    done = id;
    if (rows.Integer(1) == 0) {
      Add(report.damaged, id, id);
    } else {
      ++report.rows;
    }
  }
  if (code == SQLITE_DONE) {
    AddMissing(report, done + 1, report.last);
  } else {
    CheckOneByOne(database, intact, {done + 1, report.last}, report);
  }
}

}  // namespace

IntegrityReport CheckIntegrity(sqlite::Database& database, const std::function<void()>& step) {
  const Progress progress(database, step);
  const Snapshot snapshot(database);
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
  if (!report.obstacle.empty()) parts.push_back(report.obstacle);
  return fmt::format("{}", fmt::join(parts, "; "));
}

}  // namespace plumbline::cell
