#include "app/plant/publish/probe_tail.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "app/cell/journal/journal_schema.h"
#include "app/cell/journal/row_checksum.h"
#include "app/cell/journal/row_statement.h"

namespace plumbline::plant {
namespace {

const std::string& RowsAfterSql() {
  static const std::string sql =
      cell::SelectRowsSql() + " WHERE id > ? AND id <= ? ORDER BY id LIMIT ?";
  return sql;
}

/// Whether the row is a measurement by this cell, of known time. Columns of SelectRowsSql().
bool IsProbe(const sqlite::Statement& row) {
  return row.Text(0) != "import" && !row.IsNull(1);
}

}  // namespace

Result<ProbeTail::Taken> ProbeTail::ReadNew(const std::optional<ProbeMark>& mark) {
  std::error_code unknown;
  if (!std::filesystem::exists(path_, unknown)) {
    // All rows of a journal that is created later are new.
    settled_ = {};
    return Taken{{}, mark.value_or(ProbeMark{})};
  }
  Result<sqlite::Database> opened = sqlite::Database::Open(path_, sqlite::Database::Mode::kRead);
  if (!opened) return Error{opened.error()};
  sqlite::Database& database = opened.value();
  if (const Result<void> added = cell::AddChecksumFunction(database); !added)
    return added.failure();
  const auto current = sqlite::RequireCurrentSchema(database, cell::kJournalIdentity);
  if (!current) return current.failure();
  const auto epoch = database.IntegerOf("SELECT utc_s FROM epoch");
  const auto last = database.IntegerOf("SELECT coalesce(max(id), 0) FROM measurement");
  if (!epoch) return Error{epoch.error()};
  if (!last) return Error{last.error()};
  const ProbeMark settled = settled_;
  settled_ = {*epoch, *last};
  if (!mark) return Taken{{}, settled_};
  // A journal restored from a backup may have fewer rows than were already published.
  Taken taken{{}, {*epoch, mark->journal == *epoch ? std::min(mark->id, *last) : 0}};
  if (settled.journal != *epoch) return Taken{{}, taken.mark};  // first call for this journal
  sqlite::Statement rows(database.get(), RowsAfterSql());
  rows.Bind(1, taken.mark.id);
  rows.Bind(2, settled.id);
  rows.Bind(3, std::int64_t{kMaxRows});
  int code = SQLITE_ROW;
  while ((code = rows.Step()) == SQLITE_ROW) {
    const std::int64_t id = rows.Integer(cell::kIdColumn);
    if (rows.Integer(cell::kIntactColumn) == 0) {
      return Error{
          fmt::format("{}: row {} was changed since it was written; `plumbline journal "
                      "salvage` saves the others",
                      path_, id)};
    }
    taken.mark.id = id;
    if (!IsProbe(rows)) continue;
    std::optional<cell::JournalRow> row = cell::RowFrom(rows, joints_);
    taken.skipped += row ? 0 : 1;
    if (row) taken.probes.push_back({std::move(*row), *epoch});
  }
  if (code != SQLITE_DONE) return Error{fmt::format("{}: {}", path_, database.Problem())};
  return taken;
}

}  // namespace plumbline::plant
