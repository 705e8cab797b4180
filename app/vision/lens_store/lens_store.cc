#include "app/vision/lens_store/lens_store.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <limits>
#include <utility>

#include "app/base/sqlite/database.h"
#include "app/base/target/declared_facts.h"
#include "app/base/text/json_text.h"
#include "drivers/os/file_writing.h"
#include "firmware-like/lens/lens_curve.h"

namespace plumbline::vision {
namespace {

/// Out-of-range values become one that FaultOf() or the checksum rejects.
std::int32_t ToInt32(std::int64_t value) {
  constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max();
  return static_cast<std::int32_t>(value > kMost || value < -kMost ? -kMost - 1 : value);
}

}  // namespace

const char* const kLensSchema = R"(
CREATE TABLE lens (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  utc TEXT NOT NULL,
  camera_serial TEXT NOT NULL, mode TEXT NOT NULL,
  zoom_counts INTEGER NOT NULL, focus_counts INTEGER,
  width INTEGER NOT NULL, height INTEGER NOT NULL,
  fx REAL NOT NULL, fy REAL NOT NULL, cx REAL NOT NULL, cy REAL NOT NULL,
  k1 REAL NOT NULL, k2 REAL NOT NULL, p1 REAL NOT NULL, p2 REAL NOT NULL, k3 REAL NOT NULL,
  covariance TEXT NOT NULL,  -- 81 numbers, order fx, fy, cx, cy, k1, k2, p1, p2, k3; or 256
  rms_px REAL NOT NULL, board TEXT NOT NULL, pupil_shift_m REAL, temp_C REAL,
  corners BLOB NOT NULL, checksum INTEGER NOT NULL,
  uncertainty_px REAL,  -- of the projection at its worst place, one standard deviation
  usable_radius_px REAL,  -- null: the whole image
  more_distortion TEXT,  -- null, or k4, k5, k6, s1, s2, s3, s4 and 1 for a fisheye
  no_window INTEGER NOT NULL DEFAULT 0, fixed_focus INTEGER NOT NULL DEFAULT 0  -- 1: declared
);
CREATE INDEX lens_of_camera ON lens (camera_serial, mode);
CREATE TRIGGER lens_is_not_changed BEFORE UPDATE ON lens
  BEGIN SELECT RAISE(ABORT, 'lenses are never changed'); END;
CREATE TRIGGER lens_is_not_removed BEFORE DELETE ON lens
  BEGIN SELECT RAISE(ABORT, 'lenses are never removed'); END;
)";

const char* const kInsertLens =
    "INSERT INTO lens (utc, camera_serial, mode, zoom_counts, focus_counts, width, height, fx, fy,"
    " cx, cy, k1, k2, p1, p2, k3, covariance, rms_px, board, pupil_shift_m, temp_C, corners,"
    " checksum, uncertainty_px, id, usable_radius_px, more_distortion, no_window, fixed_focus)"
    " VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)";

const char* const kSelectLens =
    "SELECT utc, camera_serial, mode, zoom_counts, focus_counts, width, height, fx, fy, cx, cy, k1,"
    " k2, p1, p2, k3, covariance, rms_px, board, pupil_shift_m, temp_C, corners, checksum, id,"
    " uncertainty_px, usable_radius_px, more_distortion, no_window, fixed_focus FROM lens";

namespace {

/// Numbers of a JSON array; empty if it is none.
std::vector<double> NumbersOf(const std::string& text) {
  std::vector<double> numbers;
  const nlohmann::json array = text::JsonOrNull(text);
  if (!array.is_array()) return numbers;
  for (const auto& number : array) {
    if (!number.is_number()) return {};
    numbers.push_back(number.get<double>());
  }
  return numbers;
}

template <typename Values>
std::string JsonOfNumbers(const Values& values) {
  nlohmann::json array = nlohmann::json::array();
  for (const double value : values) array.push_back(value);
  return text::JsonText(array);
}

/// Number of parameters that are stored with their covariance.
Eigen::Index StoredParameters(const lens::Lens& lens) {
  return ModelOf(lens) == lens::LensModel::kUsual ? lens::kUsualParameters : lens::kLensParameters;
}

constexpr Eigen::Index kMoreParameters = lens::kLensParameters - lens::kUsualParameters;

/// Text of the column more_distortion.
std::optional<std::string> MoreDistortion(const lens::Lens& lens) {
  if (ModelOf(lens) == lens::LensModel::kUsual) return std::nullopt;
  Eigen::Matrix<double, kMoreParameters + 1, 1> values;
  values << lens::VectorOfLens(lens).tail<kMoreParameters>(), lens.fisheye ? 1 : 0;
  return JsonOfNumbers(values);
}

/// @return  false if it is neither 0 nor 1
bool ReadFlag(const sqlite::Statement& row, int column, bool& flag) {
  flag = row.Integer(column) == 1;
  return flag || row.Integer(column) == 0;
}

/// @return  false if the columns of the lens or of its covariance are damaged
bool ReadLens(const sqlite::Statement& row, LensEntry& entry) {
  lens::LensVector values = lens::LensVector::Zero();
  for (int k = 0; k < lens::kUsualParameters; ++k) values[k] = row.Number(7 + k);
  bool fisheye = false;
  if (!row.IsNull(26)) {
    const std::vector<double> more = NumbersOf(row.Text(26));
    if (more.size() != kMoreParameters + 1) return false;
    values.tail<kMoreParameters>() =
        Eigen::Map<const Eigen::VectorXd>(more.data(), kMoreParameters);
    fisheye = more.back() != 0;
  }
  entry.lens = lens::LensOfVector(values, fisheye);
  const Eigen::Index count = StoredParameters(entry.lens);
  const std::vector<double> covariance = NumbersOf(row.Text(16));
  if (covariance.size() != static_cast<std::size_t>(count * count)) return false;
  entry.covariance.topLeftCorner(count, count) =
      Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
          covariance.data(), count, count);
  return true;
}

}  // namespace

bool InsertLens(sqlite::Statement& statement, const LensEntry& entry) {
  statement.Bind(1, entry.utc);
  statement.Bind(2, entry.key.camera_serial);
  statement.Bind(3, entry.key.mode);
  statement.Bind(4, std::int64_t{entry.key.zoom_counts});
  statement.Bind(5, entry.key.focus_counts ? std::optional<std::int64_t>(*entry.key.focus_counts)
                                           : std::nullopt);
  statement.Bind(6, std::int64_t{entry.size.width});
  statement.Bind(7, std::int64_t{entry.size.height});
  const lens::LensVector values = lens::VectorOfLens(entry.lens);
  for (int k = 0; k < lens::kUsualParameters; ++k) statement.Bind(8 + k, values[k]);
  const Eigen::Index count = StoredParameters(entry.lens);
  statement.Bind(
      17, JsonOfNumbers(entry.covariance.topLeftCorner(count, count).reshaped<Eigen::RowMajor>()));
  statement.Bind(18, entry.rms_px);
  statement.Bind(19, entry.board);
  statement.Bind(20, entry.pupil_shift_m);
  statement.Bind(21, entry.temp_C);
  statement.BindBlob(22, entry.corners);
  statement.Bind(23, static_cast<std::int64_t>(ChecksumOf(entry)));
  statement.Bind(24, entry.uncertainty_px);
  statement.Bind(25, entry.id > 0 ? std::optional(entry.id) : std::nullopt);
  statement.Bind(26, std::isfinite(entry.usable_radius_px) ? std::optional(entry.usable_radius_px)
                                                           : std::nullopt);
  statement.Bind(27, MoreDistortion(entry.lens));
  statement.Bind(28, std::int64_t{entry.declared.no_window});
  statement.Bind(29, std::int64_t{entry.declared.fixed_focus});
  return statement.Run();
}

std::optional<LensEntry> ReadLensValues(const sqlite::Statement& row) {
  LensEntry entry;
  entry.utc = row.Text(0);
  entry.key.camera_serial = row.Text(1);
  entry.key.mode = row.Text(2);
  entry.key.zoom_counts = ToInt32(row.Integer(3));
  if (!row.IsNull(4)) entry.key.focus_counts = ToInt32(row.Integer(4));
  entry.size = {ToInt32(row.Integer(5)), ToInt32(row.Integer(6))};
  const bool sound = ReadLens(row, entry) && ReadFlag(row, 27, entry.declared.no_window) &&
                     ReadFlag(row, 28, entry.declared.fixed_focus);
  if (!sound) return std::nullopt;
  entry.rms_px = row.Number(17);
  entry.board = row.Text(18);
  entry.pupil_shift_m = row.OptionalNumberAt(19);
  entry.temp_C = row.OptionalNumberAt(20);
  const std::string corners = row.Text(21);
  entry.corners.assign(corners.begin(), corners.end());
  entry.uncertainty_px = row.OptionalNumberAt(24);
  if (const auto radius_px = row.OptionalNumberAt(25)) entry.usable_radius_px = *radius_px;
  entry.id = RowId(row);
  if (FaultOf(entry)) return std::nullopt;
  return entry;
}

std::optional<LensEntry> ReadLensEntry(const sqlite::Statement& row) {
  std::optional<LensEntry> entry = ReadLensValues(row);
  if (!entry || static_cast<std::uint64_t>(row.Integer(22)) != ChecksumOf(*entry)) {
    return std::nullopt;
  }
  return entry;
}

std::int64_t RowId(const sqlite::Statement& row) {
  return row.Integer(23);
}

namespace {

constexpr sqlite::StoreIdentity kIdentity{0x504C4C31, LensStore::kSchemaVersion,  // "PLL1"
                                          "a plumbline lens store"};

std::string BackupOf(const std::string& path) {
  return path + ".backup";
}

bool PassesIntegrityCheck(sqlite::Database& database) {
  sqlite::Statement check(database.get(), "PRAGMA integrity_check(1)");
  return check.Step() == SQLITE_ROW && check.Text(0) == "ok";
}

/// Renames the file and SQLite's companion files. @return the new name
Result<std::string> MoveAside(const std::string& path) {
  std::string moved_to;
  for (int number = 1; moved_to.empty() || std::filesystem::exists(moved_to); ++number) {
    moved_to = fmt::format("{}.damaged-{}", path, number);
  }
  for (const char* suffix : {"-wal", "-shm"}) {
    std::rename((path + suffix).c_str(), (moved_to + suffix).c_str());  // may not exist
  }
  if (std::rename(path.c_str(), moved_to.c_str()) != 0) {
    return Error{
        fmt::format("{}: is damaged and cannot be renamed: {}", path, std::strerror(errno))};
  }
  return moved_to;
}

}  // namespace

Error LensStore::Failed(const std::string& what) const {
  return sqlite::Failure(*database_, what);
}

Result<LensStore> LensStore::OpenVerified(const std::string& path, bool& damaged) {
  Result<sqlite::Database> opened = sqlite::Database::Open(path, sqlite::Database::Mode::kWrite);
  if (!opened) return opened.failure();
  LensStore store(std::move(opened).value());
  sqlite::Database& database = *store.database_;
  if (!database.Run("SELECT count(*) FROM sqlite_master")) {
    const int code = sqlite3_errcode(database.get());
    damaged = code == SQLITE_NOTADB || code == SQLITE_CORRUPT;
    return store.Failed("cannot be read");
  }
  const Result<std::int64_t> schema = sqlite::SchemaOf(database, kIdentity);
  if (!schema) return schema.failure();
  if (!PassesIntegrityCheck(database)) {
    damaged = true;
    return Error{fmt::format("{}: fails its integrity check", path)};
  }
  if (!database.Run("PRAGMA journal_mode=WAL") || !database.Run("PRAGMA synchronous=FULL")) {
    return store.Failed("cannot be prepared");
  }
  // A corrupted write version in the header: SQLite opens such a file read-only.
  if (sqlite3_db_readonly(database.get(), "main") == 1 && access(path.c_str(), W_OK) == 0) {
    damaged = true;
    return Error{fmt::format("{}: its header makes it read-only", path)};
  }
  if (*schema == 0) {
    if (const auto prepared = store.Prepare(); !prepared) return prepared.failure();
  }
  const auto entries = store.Read(std::nullopt, "");
  if (!entries) {
    damaged = true;
    return entries.failure();
  }
  return store;
}

Result<void> LensStore::Prepare() {
  sqlite::Transaction transaction(*database_);
  // Another process may have done this in the meantime.
  const Result<std::int64_t> tables = database_->IntegerOf("SELECT count(*) FROM sqlite_master");
  if (!transaction.begun() || !tables) return Failed("cannot be prepared");
  if (*tables == 0) {
    if (!database_->Run(kLensSchema) || !database_->Run(kIdentity.Mark().c_str())) {
      return Failed("cannot be created");
    }
  }
  if (!transaction.Commit()) return Failed("cannot be prepared");
  return {};
}

Result<LensStore> LensStore::Open(const std::string& path) {
  bool damaged = false;
  Result<LensStore> store = OpenVerified(path, damaged);
  if (store.ok() || !damaged) return store;
  const std::string problem = store.error();
  const std::string backup = BackupOf(path);
  if (!std::filesystem::exists(backup)) {
    return Error{fmt::format("{}; there is no backup ({}): move the file away to start a new store",
                             problem, backup)};
  }
  // Replace the file only if the backup is intact.
  bool backup_damaged = false;
  {
    const Result<LensStore> sound = OpenVerified(backup, backup_damaged);
    if (!sound) return Error{fmt::format("{}; and the backup: {}", problem, sound.error())};
  }
  const Result<std::string> moved_to = MoveAside(path);
  if (!moved_to) return moved_to.failure();
  std::error_code copied;
  std::filesystem::copy_file(backup, path, copied);
  if (copied) return Error{fmt::format("{}: {}", path, copied.message())};
  store = OpenVerified(path, damaged);
  if (!store) return store;
  const auto count = store.value().Count();
  store.value().notice_ =
      fmt::format("{}; it was moved to {}, and the backup with {} lenses is in use", problem,
                  *moved_to, count ? *count : 0);
  return store;
}

Result<LensStore> LensStore::OpenForReading(const std::string& path) {
  Result<sqlite::Database> opened = sqlite::Database::Open(path, sqlite::Database::Mode::kRead);
  if (!opened) return opened.failure();
  LensStore store(std::move(opened).value());
  const Result<void> current = sqlite::RequireCurrentSchema(*store.database_, kIdentity);
  if (!current) return current.failure();
  return store;
}

Result<std::int64_t> LensStore::Append(const LensEntry& requested) {
  LensEntry entry = requested;
  entry.id = 0;
  if (const auto fault = FaultOf(entry)) {
    return Error{fmt::format("{}: lens not stored: {}", database_->path(), *fault)};
  }
  std::int64_t id = 0;
  {
    sqlite::Transaction transaction(*database_);
    if (!transaction.begun()) return Failed("lens not stored");
    sqlite::Statement statement(database_->get(), kInsertLens);
    if (!InsertLens(statement, entry)) return Failed("lens not stored");
    id = sqlite3_last_insert_rowid(database_->get());
    if (!transaction.Commit()) return Failed("lens not stored");
  }
  const Result<void> backed_up = WriteBackup();
  notice_ = backed_up ? "" : backed_up.error();
  return id;
}

/// Copies the whole file and replaces the previous copy atomically.
Result<void> LensStore::WriteBackup() {
  const std::string backup = BackupOf(database_->path()), fresh = backup + ".new";
  unlink(fresh.c_str());
  sqlite::Statement copy(database_->get(), "VACUUM INTO ?");
  copy.Bind(1, fresh);
  if (!copy.Run()) return Failed("backup failed");
  const std::string folder = std::filesystem::absolute(backup).parent_path().string();
  if (!os::SyncFile(fresh) || std::rename(fresh.c_str(), backup.c_str()) != 0 ||
      !os::SyncFolder(folder)) {
    return Error{fmt::format("{}: backup failed: {}", backup, std::strerror(errno))};
  }
  return {};
}

Result<std::vector<LensEntry>> LensStore::Read(const std::optional<std::string>& camera_serial,
                                               const std::string& mode) {
  const std::string sql = std::string(kSelectLens) +
                          (camera_serial ? " WHERE camera_serial = ? AND mode = ?" : "") +
                          " ORDER BY id";
  sqlite::Statement statement(database_->get(), sql);
  if (camera_serial) {
    statement.Bind(1, *camera_serial);
    statement.Bind(2, mode);
  }
  std::vector<LensEntry> entries;
  int code = SQLITE_ROW;
  while ((code = statement.Step()) == SQLITE_ROW) {
    std::optional<LensEntry> entry = ReadLensEntry(statement);
    if (!entry) {
      return Error{
          fmt::format("{}: lens {} fails its checksum", database_->path(), RowId(statement))};
    }
    entries.push_back(*std::move(entry));
  }
  if (code != SQLITE_DONE) return Failed("cannot be read");
  return entries;
}

Result<std::int64_t> LensStore::Count() {
  sqlite::Statement statement(database_->get(), "SELECT count(*) FROM lens");
  if (statement.Step() != SQLITE_ROW) return Failed("cannot be read");
  return statement.Integer(0);
}

std::vector<LensEntry> LensStore::CurveNodes(std::vector<LensEntry> entries, const LensKey& key,
                                             const LensTolerance& tolerance) {
  const auto other_focus = [&](const LensEntry& entry) {
    return key.focus_counts && entry.key.focus_counts &&
           std::abs(std::int64_t{*key.focus_counts} - *entry.key.focus_counts) >
               tolerance.focus_counts;
  };
  std::erase_if(entries, other_focus);
  // Newest first; older entries at the same zoom are skipped.
  std::ranges::reverse(entries);
  std::vector<LensEntry> nodes;
  for (LensEntry& entry : entries) {
    const bool newer = std::ranges::any_of(nodes, [&](const LensEntry& node) {
      return std::abs(std::int64_t{node.key.zoom_counts} - entry.key.zoom_counts) <=
             tolerance.zoom_counts;
    });
    if (!newer) nodes.push_back(std::move(entry));
  }
  return nodes;
}

Result<std::optional<LensEntry>> LensStore::Withheld(const LensKey& key,
                                                     const LensTolerance& tolerance,
                                                     const target::DeclaredFacts& declared) {
  Result<std::vector<LensEntry>> entries = Read(key.camera_serial, key.mode);
  if (!entries) return entries.failure();
  std::erase_if(entries.value(),
                [&declared](const LensEntry& entry) { return Includes(declared, entry.declared); });
  for (LensEntry& node : CurveNodes(std::move(entries).value(), key, tolerance)) {
    if (std::abs(std::int64_t{node.key.zoom_counts} - key.zoom_counts) <= tolerance.zoom_counts)
      return std::optional(std::move(node));
  }
  return std::optional<LensEntry>();
}

Result<std::vector<LensEntry>> LensStore::Usable(const LensKey& key,
                                                 const target::DeclaredFacts& declared) {
  Result<std::vector<LensEntry>> entries = Read(key.camera_serial, key.mode);
  if (!entries) return entries;
  std::erase_if(entries.value(), [&declared](const LensEntry& entry) {
    return !Includes(declared, entry.declared);
  });
  return entries;
}

Result<std::optional<LensFound>> LensStore::Find(const LensKey& key, const LensTolerance& tolerance,
                                                 const target::DeclaredFacts& declared) {
  Result<std::vector<LensEntry>> entries = Usable(key, declared);
  if (!entries) return entries.failure();
  const std::vector<LensEntry> nodes = CurveNodes(std::move(entries).value(), key, tolerance);
  if (nodes.empty()) return std::optional<LensFound>();
  const auto distance = [&key](const LensEntry& node) {
    return std::abs(std::int64_t{node.key.zoom_counts} - key.zoom_counts);
  };
  const LensEntry& nearest = *std::ranges::min_element(
      nodes, [&](const LensEntry& a, const LensEntry& b) { return distance(a) < distance(b); });
  std::vector<lens::LensNode> curve_nodes;
  curve_nodes.reserve(nodes.size());
  for (const LensEntry& node : nodes) {
    // Coefficients of different distortion models cannot be interpolated.
    if (ModelOf(node.lens) == ModelOf(nearest.lens))
      curve_nodes.push_back({node.key.zoom_counts, node.lens, node.covariance});
  }
  const lens::LensCurve curve(curve_nodes);

  LensFound found;
  found.entry = nearest;
  const bool calibrated = distance(nearest) <= tolerance.zoom_counts;
  const std::optional<lens::InterpolatedLens> at =
      curve.At(calibrated ? nearest.key.zoom_counts : key.zoom_counts);
  if (!at) return std::optional<LensFound>();
  found.log_focal_sd = at->log_focal_sd;
  if (nodes.size() > 1) found.log_focal_per_count = at->log_focal_per_count;
  if (!calibrated) {
    found.how = LensFound::How::kInterpolated;
    found.entry.key.zoom_counts = key.zoom_counts;
    found.entry.lens = at->lens;
    found.entry.covariance = at->covariance;
    for (const LensEntry& node : nodes) {
      found.entry.usable_radius_px = std::min(found.entry.usable_radius_px, node.usable_radius_px);
      found.entry.declared.no_window |= node.declared.no_window;
      found.entry.declared.fixed_focus |= node.declared.fixed_focus;
    }
  }
  return std::optional(found);
}

}  // namespace plumbline::vision
