#include "app/journal/journal.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "app/config/toml_reader.h"

namespace plumbline {
namespace {

constexpr int kApplicationId = 0x504C4A31;  // "PLJ1", told by file(1)
constexpr double kMmPerMetre = 1 / kMetrePerMm;

constexpr const char* kSchema = R"(
CREATE TABLE measurement (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  source TEXT NOT NULL CHECK (source IN ('plc', 'camera', 'import')),
  unix_ms INTEGER,
  t_s REAL,  -- of probes: UTC since the epoch
  session TEXT NOT NULL, command INTEGER,
  q TEXT NOT NULL, qd TEXT, qdd TEXT, tau TEXT,  -- arrays; deg and Nm, mm and N where prismatic
  payload_kg REAL, temp_C REAL,
  predicted_x_mm REAL, predicted_y_mm REAL, predicted_z_mm REAL,
  x_mm REAL, y_mm REAL, z_mm REAL, range_mm REAL,
  qw REAL, qx REAL, qy REAL, qz REAL,
  model_version INTEGER, wild INTEGER NOT NULL DEFAULT 0, alarm INTEGER NOT NULL DEFAULT 0,
  q_step_deg REAL,  -- of the registers that q was read from; 0: finer than matters
  covariance_mm2 TEXT  -- of x, y, z by camera: array of 9, row by row
);
CREATE TABLE epoch (utc_s INTEGER NOT NULL);
INSERT INTO epoch VALUES (CAST(strftime('%s', 'now') AS INTEGER));
CREATE TABLE import (
  id INTEGER PRIMARY KEY, file TEXT NOT NULL, content_hash INTEGER NOT NULL,
  rows INTEGER NOT NULL, last_row INTEGER NOT NULL
);
CREATE TABLE monitor_restart (
  id INTEGER PRIMARY KEY, after_row INTEGER NOT NULL, model_version INTEGER NOT NULL,
  reason TEXT NOT NULL
);
)";

constexpr const char* kInsert =
    "INSERT INTO measurement (source, unix_ms, t_s, session, command, q, qd, qdd, tau, payload_kg,"
    " temp_C, predicted_x_mm, predicted_y_mm, predicted_z_mm, x_mm, y_mm, z_mm, range_mm, qw, qx,"
    " qy, qz, model_version, wild, alarm, q_step_deg, covariance_mm2)"
    " VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)";

constexpr const char* kSelect =
    "SELECT source, unix_ms, t_s, session, command, q, qd, qdd, tau, payload_kg, temp_C,"
    " predicted_x_mm, predicted_y_mm, predicted_z_mm, x_mm, y_mm, z_mm, range_mm, qw, qx, qy, qz,"
    " model_version, wild, alarm, id, q_step_deg, covariance_mm2 FROM measurement";

/// Schema 1 counted t_s from the computer's boot, and marked sessions with it. The wall clock of
/// each probe was kept.
constexpr const char* kFromSchema1 = R"(
ALTER TABLE measurement ADD COLUMN q_step_deg REAL;
CREATE TABLE epoch (utc_s INTEGER NOT NULL);
INSERT INTO epoch SELECT coalesce(min(unix_ms) / 1000, CAST(strftime('%s', 'now') AS INTEGER))
  FROM measurement WHERE source = 'plc';
UPDATE measurement SET t_s = unix_ms / 1000.0 - (SELECT utc_s FROM epoch)
  WHERE source = 'plc' AND unix_ms IS NOT NULL;
UPDATE measurement SET session = substr(session, 1, length(session) - 14)
  WHERE source = 'plc' AND session LIKE '% boot ________';
UPDATE measurement SET session = '' WHERE source = 'plc' AND session LIKE 'boot ________';
PRAGMA user_version = 2;
)";

/// Schema 2 knew no probes by camera.
constexpr const char* kFromSchema2 = R"(
ALTER TABLE measurement ADD COLUMN covariance_mm2 TEXT;
PRAGMA user_version = 3;
)";

double FileUnit(const Joint& joint) {
  return joint.type == JointType::kPrismatic ? kMetrePerMm : kRadPerDeg;
}

/// Joint values as a JSON array in the units of measured.csv; nothing where they are absent.
std::optional<std::string> JointText(const JointVector& values, const std::vector<Joint>& joints,
                                     bool torque) {
  if (values.size() == 0) return std::nullopt;
  nlohmann::json array = nlohmann::json::array();
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const double unit = torque ? 1 : FileUnit(joints[static_cast<std::size_t>(i)]);
    array.push_back(values[i] / unit);
  }
  return array.dump();
}

bool JointsFromText(const Statement& row, int column, const std::vector<Joint>& joints, bool torque,
                    JointVector& values) {
  if (row.IsNull(column)) return true;
  const nlohmann::json array = nlohmann::json::parse(row.Text(column), nullptr, false);
  if (!array.is_array() || array.size() != joints.size()) return false;
  values.resize(static_cast<Eigen::Index>(joints.size()));
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (!array[i].is_number()) return false;
    const double unit = torque ? 1 : FileUnit(joints[i]);
    values[static_cast<Eigen::Index>(i)] = array[i].get<double>() * unit;
  }
  return true;
}

std::optional<std::string> CovarianceText(const std::optional<Mat3>& covariance_m2) {
  if (!covariance_m2) return std::nullopt;
  nlohmann::json array = nlohmann::json::array();
  for (int k = 0; k < 9; ++k) {
    array.push_back((*covariance_m2)(k / 3, k % 3) * kMmPerMetre * kMmPerMetre);
  }
  return array.dump();
}

/// What is no array of nine numbers is as if it were not there: it was never written by us.
std::optional<Mat3> CovarianceFrom(const Statement& row, int column) {
  if (row.IsNull(column)) return std::nullopt;
  const nlohmann::json array = nlohmann::json::parse(row.Text(column), nullptr, false);
  if (!array.is_array() || array.size() != 9) return std::nullopt;
  Mat3 covariance;
  for (std::size_t k = 0; k < 9; ++k) {
    if (!array[k].is_number()) return std::nullopt;
    covariance(static_cast<Eigen::Index>(k / 3), static_cast<Eigen::Index>(k % 3)) =
        array[k].get<double>() * kMetrePerMm * kMetrePerMm;
  }
  return covariance;
}

void BindPoint(Statement& statement, int index, const std::optional<Vec3>& point_m) {
  for (int k = 0; k < 3; ++k) {
    statement.Bind(index + k, point_m ? std::optional((*point_m)[k] * kMmPerMetre) : std::nullopt);
  }
}

std::optional<Vec3> PointFrom(const Statement& row, int column) {
  if (row.IsNull(column)) return std::nullopt;
  return Vec3(kMetrePerMm *
              Vec3(row.Number(column), row.Number(column + 1), row.Number(column + 2)));
}

std::optional<std::int64_t> Widened(const auto& value) {
  return value ? std::optional<std::int64_t>(*value) : std::nullopt;
}

bool Insert(Statement& statement, const JournalRow& row, const std::vector<Joint>& joints) {
  statement.Bind(1, std::string(NameOf(row.source)));
  statement.Bind(2, row.unix_ms);
  statement.Bind(3, row.t_s);
  statement.Bind(4, row.session);
  statement.Bind(5, Widened(row.command));
  statement.Bind(6, JointText(row.q, joints, false));
  statement.Bind(7, JointText(row.qd, joints, false));
  statement.Bind(8, JointText(row.qdd, joints, false));
  statement.Bind(9, JointText(row.tau, joints, true));
  statement.Bind(10, row.payload_kg);
  statement.Bind(11, row.temp_C);
  BindPoint(statement, 12, row.predicted_W);
  BindPoint(statement, 15, row.measured_W);
  statement.Bind(18, row.range_m ? std::optional(*row.range_m * kMmPerMetre) : std::nullopt);
  const auto turned = [&row](auto part) {
    return row.orientation_W ? std::optional(part(*row.orientation_W)) : std::nullopt;
  };
  statement.Bind(19, turned([](const Eigen::Quaterniond& q) { return q.w(); }));
  statement.Bind(20, turned([](const Eigen::Quaterniond& q) { return q.x(); }));
  statement.Bind(21, turned([](const Eigen::Quaterniond& q) { return q.y(); }));
  statement.Bind(22, turned([](const Eigen::Quaterniond& q) { return q.z(); }));
  statement.Bind(23, Widened(row.model_version));
  statement.Bind(24, std::int64_t{row.wild});
  statement.Bind(25, std::int64_t{row.alarm});
  statement.Bind(26, row.q_step_rad ? std::optional(*row.q_step_rad / kRadPerDeg) : std::nullopt);
  statement.Bind(27, CovarianceText(row.covariance_W));
  return statement.Run();
}

std::optional<JournalRow> RowFrom(const Statement& s, const std::vector<Joint>& joints) {
  JournalRow row;
  const std::string source = s.Text(0);
  row.source = source == "plc"      ? JournalRow::Source::kPlc
               : source == "camera" ? JournalRow::Source::kCamera
                                    : JournalRow::Source::kImport;
  row.unix_ms = s.IntegerIfThere(1);
  row.t_s = s.NumberIfThere(2);
  row.session = s.Text(3);
  if (!s.IsNull(4)) row.command = static_cast<std::uint16_t>(s.Integer(4));
  const bool joints_fit = JointsFromText(s, 5, joints, false, row.q) && row.q.size() > 0 &&
                          JointsFromText(s, 6, joints, false, row.qd) &&
                          JointsFromText(s, 7, joints, false, row.qdd) &&
                          JointsFromText(s, 8, joints, true, row.tau);
  if (!joints_fit) return std::nullopt;
  row.payload_kg = s.NumberIfThere(9);
  row.temp_C = s.NumberIfThere(10);
  row.predicted_W = PointFrom(s, 11);
  row.measured_W = PointFrom(s, 14);
  if (!s.IsNull(17)) row.range_m = s.Number(17) * kMetrePerMm;
  if (!s.IsNull(18)) {
    row.orientation_W = Eigen::Quaterniond(s.Number(18), s.Number(19), s.Number(20), s.Number(21));
  }
  if (!s.IsNull(22)) row.model_version = static_cast<int>(s.Integer(22));
  row.wild = s.Integer(23) != 0;
  row.alarm = s.Integer(24) != 0;
  row.id = s.Integer(25);
  if (const auto step_deg = s.NumberIfThere(26)) row.q_step_rad = *step_deg * kRadPerDeg;
  row.covariance_W = CovarianceFrom(s, 27);
  return row;
}

/// What a file that opened is: a journal of this version, an empty file, or something else.
std::optional<Error> NotAJournal(Database& database) {
  // A file that is no database shows it at the first reading.
  if (!database.Run("SELECT count(*) FROM sqlite_master")) {
    return Error{fmt::format("{}: {}; move it away to begin a new journal", database.path(),
                             database.Problem())};
  }
  const Result<std::int64_t> version = database.IntegerOf("PRAGMA user_version");
  const Result<std::int64_t> tables = database.IntegerOf("SELECT count(*) FROM sqlite_master");
  const Result<std::int64_t> kind = database.IntegerOf("PRAGMA application_id");
  for (const Result<std::int64_t>* read : {&version, &tables, &kind}) {
    if (!*read) return Error{read->error()};
  }
  if (*version > Journal::kSchemaVersion) {
    return Error{fmt::format("{}: written by a newer plumbline (schema {}, this one knows {})",
                             database.path(), *version, Journal::kSchemaVersion)};
  }
  if (*tables > 0 && *kind != kApplicationId) {
    return Error{fmt::format("{}: is a database, but no plumbline journal", database.path())};
  }
  return std::nullopt;
}

}  // namespace

const char* NameOf(JournalRow::Source source) {
  switch (source) {
    case JournalRow::Source::kPlc:
      return "plc";
    case JournalRow::Source::kCamera:
      return "camera";
    case JournalRow::Source::kImport:
      return "import";
  }
  return "?";
}

Result<Journal> Journal::Open(const std::string& path) {
  Result<Database> opened = Database::Open(path, Database::Mode::kWrite);
  if (!opened) return Error{opened.error()};
  Journal journal(std::move(opened).value());
  Database& database = journal.database_;
  if (auto problem = NotAJournal(database)) return *std::move(problem);
  if (!database.Run("PRAGMA journal_mode=WAL") || !database.Run("PRAGMA synchronous=FULL")) {
    return journal.Failed("cannot be prepared");
  }
  const Result<bool> ready = journal.BringToThisSchema();
  if (!ready) return Error{ready.error()};
  const Result<bool> timed = journal.ReadEpoch();
  if (!timed) return Error{timed.error()};
  return journal;
}

Result<bool> Journal::BringToThisSchema() {
  Result<std::int64_t> version = database_.IntegerOf("PRAGMA user_version");
  if (!version) return Error{version.error()};
  if (*version == kSchemaVersion) return true;
  const char* const failed = *version == 0 ? "cannot be made" : "cannot be brought to this schema";
  Transaction transaction(database_);
  if (!transaction.begun()) return Failed(failed);
  version = database_.IntegerOf("PRAGMA user_version");  // another process may have made it since
  if (!version) return Error{version.error()};
  const std::string mark = fmt::format("PRAGMA application_id={}; PRAGMA user_version={}",
                                       kApplicationId, kSchemaVersion);
  if (*version == 0 && (!database_.Run(kSchema) || !database_.Run(mark.c_str()))) {
    return Failed(failed);
  }
  if (*version == 1 && !database_.Run(kFromSchema1)) return Failed(failed);
  if ((*version == 1 || *version == 2) && !database_.Run(kFromSchema2)) return Failed(failed);
  if (!transaction.Commit()) return Failed(failed);
  return true;
}

Result<bool> Journal::ReadEpoch() {
  const Result<std::int64_t> epoch = database_.IntegerOf("SELECT utc_s FROM epoch");
  if (!epoch) return Error{epoch.error()};
  epoch_utc_s_ = static_cast<double>(*epoch);
  return true;
}

Result<Journal> Journal::OpenForReading(const std::string& path) {
  Result<Database> opened = Database::Open(path, Database::Mode::kRead);
  if (!opened) return Error{opened.error()};
  Journal journal(std::move(opened).value());
  if (auto problem = NotAJournal(journal.database_)) return *std::move(problem);
  const Result<std::int64_t> version = journal.database_.IntegerOf("PRAGMA user_version");
  if (!version) return Error{version.error()};
  if (*version == 0) return Error{fmt::format("{}: is empty, no journal yet", path)};
  if (*version < kSchemaVersion) {
    return Error{
        fmt::format("{}: written by an older plumbline; it becomes readable once this "
                    "version's plumblined, or an import, has opened it",
                    path)};
  }
  const Result<bool> timed = journal.ReadEpoch();
  if (!timed) return Error{timed.error()};
  return journal;
}

Error Journal::Failed(const char* what) const {
  return Error{fmt::format("{}: {}: {}", database_.path(), what, database_.Problem())};
}

Result<std::int64_t> Journal::AppendInside(const std::vector<JournalRow>& rows,
                                           const std::vector<Joint>& joints) {
  Statement statement(database_.get(), kInsert);
  for (const JournalRow& row : rows) {
    assert(row.q.size() == static_cast<Eigen::Index>(joints.size()));
    if (!Insert(statement, row, joints)) return Failed("row not written");
  }
  return sqlite3_last_insert_rowid(database_.get());
}

Result<std::int64_t> Journal::Append(const std::vector<JournalRow>& rows,
                                     const std::vector<Joint>& joints) {
  Transaction transaction(database_);
  if (!transaction.begun()) return Failed("row not written");
  Result<std::int64_t> last = AppendInside(rows, joints);
  if (last && !transaction.Commit()) return Failed("row not written");
  return last;
}

Result<std::int64_t> Journal::AppendImport(const std::vector<JournalRow>& rows,
                                           const std::vector<Joint>& joints,
                                           const std::string& file, std::uint64_t content_hash,
                                           bool again) {
  Transaction transaction(database_);
  if (!transaction.begun()) return Failed("nothing imported");
  const Result<std::optional<std::string>> before = ImportedAs(content_hash);
  if (!before) return Error{before.error()};
  if (before->has_value() && !again) {
    return Error{
        fmt::format("{}: its rows are in the journal already (imported as {}); --again "
                    "takes them a second time",
                    file, **before)};
  }
  Result<std::int64_t> last = AppendInside(rows, joints);
  if (!last) return last;
  Statement record(database_.get(),
                   "INSERT INTO import (file, content_hash, rows, last_row) VALUES (?,?,?,?)");
  record.Bind(1, file);
  record.Bind(2, static_cast<std::int64_t>(content_hash));
  record.Bind(3, static_cast<std::int64_t>(rows.size()));
  record.Bind(4, *last);
  if (!record.Run() || !transaction.Commit()) return Failed("nothing imported");
  return last;
}

Result<std::optional<std::string>> Journal::ImportedAs(std::uint64_t content_hash) {
  Statement known(database_.get(), "SELECT file FROM import WHERE content_hash = ?");
  known.Bind(1, static_cast<std::int64_t>(content_hash));
  const int code = known.Step();
  if (code == SQLITE_DONE) return std::optional<std::string>();
  if (code != SQLITE_ROW) return Failed("cannot be read");
  return std::optional(known.Text(0));
}

Result<bool> Journal::Mark(std::int64_t id, bool wild, bool alarm) {
  Statement statement(database_.get(), "UPDATE measurement SET wild = ?, alarm = ? WHERE id = ?");
  statement.Bind(1, std::int64_t{wild});
  statement.Bind(2, std::int64_t{alarm});
  statement.Bind(3, id);
  if (!statement.Run()) return Failed("row not marked");
  return true;
}

Result<bool> Journal::ForEach(const JournalFilter& filter, const std::vector<Joint>& joints,
                              const std::function<void(const JournalRow&)>& show) {
  // Absent conditions are NULL, and hold. The newest rows are sought from the end.
  const std::string chosen = fmt::format(
      "{} WHERE (?1 IS NULL OR id > ?1) AND (?2 IS NULL OR session = ?2)"
      " AND (?3 IS NULL OR model_version = ?3)",
      kSelect);
  Statement statement(database_.get(),
                      filter.last ? fmt::format("SELECT * FROM ({} ORDER BY id DESC LIMIT ?4)"
                                                " ORDER BY id",
                                                chosen)
                                  : chosen + " ORDER BY id");
  statement.Bind(1, filter.after_id);
  statement.Bind(2, filter.session);
  statement.Bind(3, Widened(filter.model_version));
  if (filter.last) statement.Bind(4, *filter.last);
  int code = SQLITE_ROW;
  while ((code = statement.Step()) == SQLITE_ROW) {
    const std::optional<JournalRow> row = RowFrom(statement, joints);
    if (!row) {
      return Error{
          fmt::format("{}: row {} has not the cell's {} joints; choose rows of this cell "
                      "(--session, --after)",
                      database_.path(), statement.Integer(25), joints.size())};
    }
    show(*row);
  }
  if (code != SQLITE_DONE) return Failed("cannot be read");
  return true;
}

Result<std::vector<JournalRow>> Journal::Read(const JournalFilter& filter,
                                              const std::vector<Joint>& joints) {
  std::vector<JournalRow> rows;
  const Result<bool> read =
      ForEach(filter, joints, [&rows](const JournalRow& row) { rows.push_back(row); });
  if (!read) return Error{read.error()};
  return rows;
}

Result<bool> Journal::NoteRestart(int model_version, const std::string& reason) {
  Statement statement(database_.get(),
                      "INSERT INTO monitor_restart (after_row, model_version, reason) VALUES "
                      "((SELECT coalesce(max(id), 0) FROM measurement), ?, ?)");
  statement.Bind(1, std::int64_t{model_version});
  statement.Bind(2, reason);
  if (!statement.Run()) return Failed("restart of the monitor not noted");
  return true;
}

Result<std::optional<Journal::Restart>> Journal::RestartBy(const char* sql) {
  Statement statement(database_.get(), sql);
  const int code = statement.Step();
  if (code == SQLITE_DONE) return std::optional<Restart>();
  if (code != SQLITE_ROW) return Failed("cannot be read");
  return std::optional(Restart{statement.Integer(0), static_cast<int>(statement.Integer(1))});
}

Result<std::optional<Journal::Restart>> Journal::LastRestart() {
  return RestartBy("SELECT after_row, model_version FROM monitor_restart ORDER BY id DESC LIMIT 1");
}

Result<std::optional<Journal::Restart>> Journal::LastModel() {
  return RestartBy(
      "SELECT after_row, model_version FROM monitor_restart WHERE reason = 'model'"
      " ORDER BY id DESC LIMIT 1");
}

Result<std::optional<double>> Journal::LastProbe_s() {
  Statement newest(database_.get(),
                   "SELECT t_s FROM measurement WHERE source != 'import' ORDER BY id DESC LIMIT 1");
  const int code = newest.Step();
  if (code == SQLITE_DONE) return std::optional<double>();
  if (code != SQLITE_ROW) return Failed("cannot be read");
  return newest.NumberIfThere(0);
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
  if (!count) return Error{count.error()};
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

}  // namespace plumbline
