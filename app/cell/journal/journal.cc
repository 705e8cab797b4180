#include "app/cell/journal/journal.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>

#include "app/cell/journal/journal_schema.h"
#include "app/cell/journal/row_statement.h"

namespace plumbline::cell {

namespace {

/// The rows of a damaged journal, and how to go on.
Error Damaged(const std::string& path, const IntegrityReport& report) {
  if (!report.obstacle.empty()) {
    return Error{fmt::format("{}: cannot be checked: {}", path, report.obstacle)};
  }
  return Error{fmt::format(
      "{}: is damaged, so nothing is added to it: {}. Run `plumbline journal salvage`, which saves "
      "the intact rows in a new journal and keeps the damaged file, or restore the backup",
      path, DamageText(report))};
}

}  // namespace

Result<Journal> Journal::Open(const std::string& path, std::int64_t max_bytes,
                              const std::function<void()>& step) {
  Result<sqlite::Database> opened = sqlite::Database::Open(path, sqlite::Database::Mode::kWrite);
  if (!opened) return opened.failure();
  Journal journal(std::move(opened).value());
  sqlite::Database& database = journal.database_;
  const Result<std::int64_t> schema = sqlite::SchemaOf(database, kJournalIdentity);
  if (!schema) return schema.failure();
  if (!database.Run("PRAGMA journal_mode=WAL") || !database.Run("PRAGMA synchronous=FULL")) {
    return journal.Failed("cannot be prepared");
  }
  if (const Result<void> added = AddChecksumFunction(database); !added) return added.failure();
  if (*schema == 0) {
    if (const Result<void> created = CreateSchema(database); !created) return created.failure();
  }
  const IntegrityReport found = CheckIntegrity(database, step);
  if (!found.intact()) return Damaged(path, found);
  const Result<void> epoch_read = journal.ReadEpoch();
  if (!epoch_read) return epoch_read.failure();
  journal.max_bytes_ = max_bytes;
  const Result<void> limited = journal.ApplySizeLimit();
  if (!limited) return limited.failure();
  return journal;
}

/// SQLite enforces the limit, in pages; a file that is larger already does not grow.
Result<void> Journal::ApplySizeLimit() {
  if (max_bytes_ <= 0) return {};
  const Result<std::int64_t> page_bytes = database_.IntegerOf("PRAGMA page_size");
  if (!page_bytes) return page_bytes.failure();
  const std::string pragma =
      fmt::format("PRAGMA max_page_count={}", std::max<std::int64_t>(max_bytes_ / *page_bytes, 1));
  const Result<std::int64_t> applied = database_.IntegerOf(pragma.c_str());
  if (!applied) return applied.failure();
  return {};
}

Result<void> Journal::CheckNotMoved() {
  if (!database_.HasMoved()) return {};
  // On closing, SQLite would leave recent rows in a log file at the previous path.
  const bool merged = database_.Run("PRAGMA wal_checkpoint(TRUNCATE)");
  return Error{
      fmt::format("{}: was moved or deleted while it was open{}. Stop the daemon before "
                  "moving it",
                  database_.path(), merged ? "; every probe so far is in the moved file" : "")};
}

Result<void> Journal::ReadEpoch() {
  const Result<std::int64_t> epoch = database_.IntegerOf("SELECT utc_s FROM epoch");
  if (!epoch) return epoch.failure();
  epoch_utc_s_ = static_cast<double>(*epoch);
  return {};
}

Result<Journal> Journal::OpenForReading(const std::string& path) {
  Result<sqlite::Database> opened = sqlite::Database::Open(path, sqlite::Database::Mode::kRead);
  if (!opened) return opened.failure();
  Journal journal(std::move(opened).value());
  const Result<void> current = sqlite::RequireCurrentSchema(journal.database_, kJournalIdentity);
  if (!current) return current.failure();
  if (const Result<void> added = AddChecksumFunction(journal.database_); !added)
    return added.failure();
  const Result<void> epoch_read = journal.ReadEpoch();
  if (!epoch_read) return epoch_read.failure();
  return journal;
}

IntegrityReport Journal::Check(const std::function<void()>& step) {
  return CheckIntegrity(database_, step);
}

bool Journal::Seal(const SealedTable& table) {
  return sqlite::Statement(
             database_.get(),
             SealSql(table, fmt::format("rowid = {}", sqlite3_last_insert_rowid(database_.get()))))
      .Run();
}

Error Journal::Failed(const char* what) const {
  return sqlite::Failure(database_, what);
}

Error Journal::WriteFailed(const char* what) {
  // SQLite reports a full disk and the size limit by the same code; the file size tells them apart.
  constexpr double kNearLimit = 0.95;
  Error other = Failed(what);
  if (sqlite3_errcode(database_.get()) != SQLITE_FULL || max_bytes_ <= 0) return other;
  const Result<std::int64_t> pages = database_.IntegerOf("PRAGMA page_count");
  const Result<std::int64_t> page_bytes = database_.IntegerOf("PRAGMA page_size");
  if (!pages || !page_bytes ||
      static_cast<double>(*pages * *page_bytes) < kNearLimit * static_cast<double>(max_bytes_)) {
    return other;
  }
  return Error{fmt::format(
      "{}: {}: the journal has reached the {} MB that journal_mb allows. Raise journal_mb, "
      "or save the rows with `plumbline journal export` and move the file away",
      database_.path(), what, max_bytes_ / 1'000'000)};
}

Error Journal::DamagedRow(std::int64_t id) const {
  return Error{fmt::format(
      "{}: row {} was changed since it was written: the file is damaged. `plumbline journal check` "
      "lists what is; `plumbline journal salvage` saves the other rows",
      database_.path(), id)};
}

Result<std::int64_t> Journal::AppendInside(const std::vector<JournalRow>& rows,
                                           const std::vector<model::Joint>& joints) {
  sqlite::Statement statement(database_.get(), kInsertRow);
  sqlite::Statement seal(database_.get(), SealSql(kMeasurementTable, "id = last_insert_rowid()"));
  for (const JournalRow& row : rows) {
    assert(row.q.size() == static_cast<Eigen::Index>(joints.size()));
    if (!InsertRow(statement, row, joints) || !seal.Run()) return WriteFailed("row not written");
  }
  return sqlite3_last_insert_rowid(database_.get());
}

Result<std::int64_t> Journal::Append(const std::vector<JournalRow>& rows,
                                     const std::vector<model::Joint>& joints) {
  sqlite::Transaction transaction(database_);
  if (!transaction.begun()) return Failed("row not written");
  Result<std::int64_t> last = AppendInside(rows, joints);
  if (last && !transaction.Commit()) return WriteFailed("row not written");
  return last;
}

Result<std::int64_t> Journal::AppendImport(const std::vector<JournalRow>& rows,
                                           const std::vector<model::Joint>& joints,
                                           const std::string& file, std::uint64_t content_hash,
                                           bool again) {
  sqlite::Transaction transaction(database_);
  if (!transaction.begun()) return Failed("nothing imported");
  const Result<std::optional<std::string>> before = ImportedAs(content_hash);
  if (!before) return before.failure();
  if (before->has_value() && !again) {
    return Error{
        fmt::format("{}: its rows are already in the journal (imported as {}); --again "
                    "imports them a second time",
                    file, **before)};
  }
  Result<std::int64_t> last = AppendInside(rows, joints);
  if (!last) return last;
  sqlite::Statement record(
      database_.get(), "INSERT INTO import (file, content_hash, rows, last_row) VALUES (?,?,?,?)");
  record.Bind(1, file);
  record.Bind(2, static_cast<std::int64_t>(content_hash));
  record.Bind(3, static_cast<std::int64_t>(rows.size()));
  record.Bind(4, *last);
  if (!record.Run() || !Seal(kImportTable) || !transaction.Commit()) {
    return WriteFailed("nothing imported");
  }
  return last;
}

Result<std::optional<std::string>> Journal::ImportedAs(std::uint64_t content_hash) {
  sqlite::Statement known(database_.get(), "SELECT file FROM import WHERE content_hash = ?");
  known.Bind(1, static_cast<std::int64_t>(content_hash));
  const int code = known.Step();
  if (code == SQLITE_DONE) return std::optional<std::string>();
  if (code != SQLITE_ROW) return Failed("cannot be read");
  return std::optional(known.Text(0));
}

Result<void> Journal::Mark(std::int64_t id, bool wild, bool alarm) {
  sqlite::Statement statement(
      database_.get(), ChangeSql(kMeasurementTable, {{"wild", "?1"}, {"alarm", "?2"}}, "id = ?3"));
  statement.Bind(1, std::int64_t{wild});
  statement.Bind(2, std::int64_t{alarm});
  statement.Bind(3, id);
  if (!statement.Run()) return WriteFailed("row not marked");
  if (sqlite3_changes(database_.get()) == 0) return DamagedRow(id);
  return {};
}

Result<void> Journal::Decide(const std::vector<std::int64_t>& ids, bool accept,
                             std::int64_t unix_ms) {
  sqlite::Transaction transaction(database_);
  if (!transaction.begun()) return WriteFailed("nothing decided");
  sqlite::Statement mark(database_.get(), ChangeSql(kMeasurementTable, {{"quarantine", "?1"}},
                                                    "id = ?2 AND quarantine > 0"));
  sqlite::Statement record(
      database_.get(), "INSERT INTO quarantine_decision (row, accepted, unix_ms) VALUES (?,?,?)");
  for (const std::int64_t id : ids) {
    mark.Bind(1, static_cast<std::int64_t>(accept ? JournalRow::Quarantine::kAccepted
                                                  : JournalRow::Quarantine::kRejected));
    mark.Bind(2, id);
    if (!mark.Run()) return WriteFailed("nothing decided");
    if (sqlite3_changes(database_.get()) == 0) {
      return Error{
          fmt::format("{}: row {} is not in quarantine; nothing decided. `plumbline journal "
                      "quarantine list` lists those that are",
                      database_.path(), id)};
    }
    record.Bind(1, id);
    record.Bind(2, std::int64_t{accept});
    record.Bind(3, unix_ms);
    if (!record.Run() || !Seal(kDecisionTable)) return WriteFailed("nothing decided");
  }
  if (!transaction.Commit()) return WriteFailed("nothing decided");
  return {};
}

Result<std::int64_t> Journal::Waiting() {
  return database_.IntegerOf("SELECT count(*) FROM measurement WHERE quarantine = 1");
}

Result<std::int64_t> Journal::LastDecision() {
  return database_.IntegerOf("SELECT coalesce(max(id), 0) FROM quarantine_decision");
}

Result<void> Journal::ForEach(const JournalFilter& filter, const std::vector<model::Joint>& joints,
                              const std::function<void(const JournalRow&)>& visit) {
  // Conditions that are not set are NULL and always hold. The newest rows are searched from the
  // end.
  const std::string chosen = fmt::format(
      "{} WHERE (?1 IS NULL OR id > ?1) AND (?2 IS NULL OR session = ?2)"
      " AND (?3 IS NULL OR model_version = ?3){}",
      SelectRowsSql(),
      filter.rows == JournalFilter::Rows::kAll       ? ""
      : filter.rows == JournalFilter::Rows::kWaiting ? " AND quarantine = 1"
                                                     : " AND quarantine IN (0, 2)");
  sqlite::Statement statement(
      database_.get(), filter.last ? fmt::format("SELECT * FROM ({} ORDER BY id DESC LIMIT ?4)"
                                                 " ORDER BY id",
                                                 chosen)
                                   : chosen + " ORDER BY id");
  statement.Bind(1, filter.after_id);
  statement.Bind(2, filter.session);
  statement.Bind(
      3, filter.model_version ? std::optional<std::int64_t>(*filter.model_version) : std::nullopt);
  if (filter.last) statement.Bind(4, *filter.last);
  int code = SQLITE_ROW;
  while ((code = statement.Step()) == SQLITE_ROW) {
    if (statement.Integer(kIntactColumn) == 0) return DamagedRow(statement.Integer(kIdColumn));
    const std::optional<JournalRow> row = RowFrom(statement, joints);
    if (!row) {
      return Error{
          fmt::format("{}: row {} does not have the cell's {} joints; select rows of this cell "
                      "(--session, --after)",
                      database_.path(), statement.Integer(kIdColumn), joints.size())};
    }
    visit(*row);
  }
  if (code != SQLITE_DONE) return Failed("cannot be read");
  return {};
}

Result<std::vector<JournalRow>> Journal::Read(const JournalFilter& filter,
                                              const std::vector<model::Joint>& joints) {
  std::vector<JournalRow> rows;
  const Result<void> read =
      ForEach(filter, joints, [&rows](const JournalRow& row) { rows.push_back(row); });
  if (!read) return read.failure();
  return rows;
}

Result<void> Journal::RecordMonitorRestart(int model_version, const std::string& reason,
                                           bool radius_contradicted) {
  sqlite::Transaction transaction(database_);
  sqlite::Statement statement(
      database_.get(),
      "INSERT INTO monitor_restart (after_row, model_version, reason, radius_contradicted) VALUES "
      "((SELECT coalesce(max(id), 0) FROM measurement), ?, ?, ?)");
  statement.Bind(1, std::int64_t{model_version});
  statement.Bind(2, reason);
  statement.Bind(3, std::int64_t{radius_contradicted});
  if (!transaction.begun() || !statement.Run() || !Seal(kRestartTable) || !transaction.Commit()) {
    return WriteFailed("restart of the drift monitor not recorded");
  }
  return {};
}

Result<std::optional<Journal::Restart>> Journal::RestartBy(const char* sql) {
  sqlite::Statement statement(database_.get(), sql);
  const int code = statement.Step();
  if (code == SQLITE_DONE) return std::optional<Restart>();
  if (code != SQLITE_ROW) return Failed("cannot be read");
  return std::optional(Restart{statement.Integer(0), static_cast<int>(statement.Integer(1)),
                               statement.Integer(2) != 0});
}

Result<std::optional<Journal::Restart>> Journal::LastRestart() {
  return RestartBy(
      "SELECT after_row, model_version, radius_contradicted FROM monitor_restart"
      " ORDER BY id DESC LIMIT 1");
}

Result<std::optional<Journal::Restart>> Journal::LastModel() {
  return RestartBy(
      "SELECT after_row, model_version, radius_contradicted FROM monitor_restart WHERE reason = "
      "'model'"
      " ORDER BY id DESC LIMIT 1");
}

Result<std::optional<double>> Journal::LastProbeTime_s() {
  sqlite::Statement newest(
      database_.get(),
      "SELECT t_s FROM measurement WHERE source != 'import' ORDER BY id DESC LIMIT 1");
  const int code = newest.Step();
  if (code == SQLITE_DONE) return std::optional<double>();
  if (code != SQLITE_ROW) return Failed("cannot be read");
  return newest.OptionalNumberAt(0);
}

Result<std::int64_t> Journal::LastRow() {
  return database_.IntegerOf("SELECT coalesce(max(id), 0) FROM measurement");
}

Result<std::int64_t> Journal::Count() {
  return database_.IntegerOf("SELECT count(*) FROM measurement");
}

Result<int> Journal::JointCount() {
  const Result<std::int64_t> count = database_.IntegerOf(
      "SELECT coalesce((SELECT json_array_length(q) FROM measurement ORDER BY id DESC LIMIT 1), "
      "0)");
  if (!count) return count.failure();
  return static_cast<int>(*count);
}

std::uint64_t ContentHash(std::string_view text) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char c : text) {
    hash ^= static_cast<unsigned char>(c);
    hash *= 0x100000001b3;
  }
  return hash;
}

}  // namespace plumbline::cell
