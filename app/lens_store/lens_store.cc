#include "app/lens_store/lens_store.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

namespace plumbline {
namespace {

constexpr std::size_t kCovarianceNumbers = 81;  // kLensParameters squared
constexpr int kApplicationId = 0x504C4C31;      // "PLL1", told by file(1)

constexpr const char* kSchema = R"(
CREATE TABLE lens (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  utc TEXT NOT NULL,
  camera_serial TEXT NOT NULL, mode TEXT NOT NULL,
  zoom_counts INTEGER NOT NULL, focus_counts INTEGER,
  width INTEGER NOT NULL, height INTEGER NOT NULL,
  fx REAL NOT NULL, fy REAL NOT NULL, cx REAL NOT NULL, cy REAL NOT NULL,
  k1 REAL NOT NULL, k2 REAL NOT NULL, p1 REAL NOT NULL, p2 REAL NOT NULL, k3 REAL NOT NULL,
  covariance TEXT NOT NULL,  -- 81 numbers, order fx, fy, cx, cy, k1, k2, p1, p2, k3
  rms_px REAL NOT NULL, board TEXT NOT NULL, pupil_shift_m REAL NOT NULL, temp_C REAL,
  corners BLOB NOT NULL, checksum INTEGER NOT NULL
);
CREATE INDEX lens_of_camera ON lens (camera_serial, mode);
CREATE TRIGGER lens_is_not_changed BEFORE UPDATE ON lens
  BEGIN SELECT RAISE(ABORT, 'lenses are never changed'); END;
CREATE TRIGGER lens_is_not_removed BEFORE DELETE ON lens
  BEGIN SELECT RAISE(ABORT, 'lenses are never removed'); END;
)";

constexpr const char* kInsert =
    "INSERT INTO lens (utc, camera_serial, mode, zoom_counts, focus_counts, width, height, fx, fy,"
    " cx, cy, k1, k2, p1, p2, k3, covariance, rms_px, board, pupil_shift_m, temp_C, corners,"
    " checksum) VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)";

constexpr const char* kSelect =
    "SELECT utc, camera_serial, mode, zoom_counts, focus_counts, width, height, fx, fy, cx, cy, k1,"
    " k2, p1, p2, k3, covariance, rms_px, board, pupil_shift_m, temp_C, corners, checksum, id"
    " FROM lens";

bool Insert(Statement& statement, const LensEntry& entry) {
  statement.Bind(1, entry.utc);
  statement.Bind(2, entry.key.camera_serial);
  statement.Bind(3, entry.key.mode);
  statement.Bind(4, std::int64_t{entry.key.zoom_counts});
  statement.Bind(5, entry.key.focus_counts ? std::optional<std::int64_t>(*entry.key.focus_counts)
                                           : std::nullopt);
  statement.Bind(6, std::int64_t{entry.image.width});
  statement.Bind(7, std::int64_t{entry.image.height});
  const LensVector values = VectorOfLens(entry.lens);
  for (int k = 0; k < kLensParameters; ++k) statement.Bind(8 + k, values[k]);
  nlohmann::json covariance = nlohmann::json::array();
  for (const double value : entry.covariance.reshaped<Eigen::RowMajor>()) {
    covariance.push_back(value);
  }
  statement.Bind(17, covariance.dump());
  statement.Bind(18, entry.rms_px);
  statement.Bind(19, entry.board);
  statement.Bind(20, entry.pupil_shift_m);
  statement.Bind(21, entry.temp_C);
  statement.BindBlob(22, entry.corners);
  statement.Bind(23, static_cast<std::int64_t>(ChecksumOf(entry)));
  return statement.Run();
}

/// Nothing where the row is damaged.
std::optional<LensEntry> EntryFrom(const Statement& row) {
  LensEntry entry;
  entry.utc = row.Text(0);
  entry.key.camera_serial = row.Text(1);
  entry.key.mode = row.Text(2);
  entry.key.zoom_counts = static_cast<std::int32_t>(row.Integer(3));
  if (!row.IsNull(4)) entry.key.focus_counts = static_cast<std::int32_t>(row.Integer(4));
  entry.image = {static_cast<int>(row.Integer(5)), static_cast<int>(row.Integer(6))};
  LensVector values;
  for (int k = 0; k < kLensParameters; ++k) values[k] = row.Number(7 + k);
  entry.lens = LensOfVector(values);
  const nlohmann::json covariance = nlohmann::json::parse(row.Text(16), nullptr, false);
  if (!covariance.is_array() || covariance.size() != kCovarianceNumbers) return std::nullopt;
  for (int i = 0; i < kLensParameters; ++i) {
    for (int k = 0; k < kLensParameters; ++k) {
      const auto& number = covariance[static_cast<std::size_t>(i * kLensParameters + k)];
      if (!number.is_number()) return std::nullopt;
      entry.covariance(i, k) = number.get<double>();
    }
  }
  entry.rms_px = row.Number(17);
  entry.board = row.Text(18);
  entry.pupil_shift_m = row.Number(19);
  entry.temp_C = row.NumberIfThere(20);
  const std::string corners = row.Text(21);
  entry.corners.assign(corners.begin(), corners.end());
  entry.id = row.Integer(23);
  if (static_cast<std::uint64_t>(row.Integer(22)) != ChecksumOf(entry)) return std::nullopt;
  return entry;
}

std::string BackupOf(const std::string& path) {
  return path + ".backup";
}

bool Sync(const std::string& path, int flags) {
  const int fd = open(path.c_str(), flags | O_CLOEXEC);
  if (fd < 0) return false;
  const bool synced = fsync(fd) == 0;
  close(fd);
  return synced;
}

bool PassesCheck(Database& database) {
  Statement check(database.get(), "PRAGMA integrity_check(1)");
  return check.Step() == SQLITE_ROW && check.Text(0) == "ok";
}

/// Moves the file and what SQLite keeps beside it out of the way. @return its new name
Result<std::string> MoveAway(const std::string& path) {
  std::string away;
  for (int number = 1; away.empty() || std::filesystem::exists(away); ++number) {
    away = fmt::format("{}.damaged-{}", path, number);
  }
  for (const char* suffix : {"-wal", "-shm"}) {
    std::rename((path + suffix).c_str(), (away + suffix).c_str());  // may not be there
  }
  if (std::rename(path.c_str(), away.c_str()) != 0) {
    return Error{
        fmt::format("{}: is damaged, and cannot be moved away: {}", path, std::strerror(errno))};
  }
  return away;
}

}  // namespace

Error LensStore::Failed(const std::string& what) const {
  return Error{fmt::format("{}: {}: {}", database_->path(), what, database_->Problem())};
}

Result<LensStore> LensStore::OpenSound(const std::string& path, bool& damaged) {
  Result<Database> opened = Database::Open(path, Database::Mode::kWrite);
  if (!opened) return Error{opened.error()};
  LensStore store(std::move(opened).value());
  Database& database = *store.database_;
  if (!database.Run("SELECT count(*) FROM sqlite_master")) {
    const int code = sqlite3_errcode(database.get());
    damaged = code == SQLITE_NOTADB || code == SQLITE_CORRUPT;
    return store.Failed("cannot be read");
  }
  const Result<std::int64_t> version = database.IntegerOf("PRAGMA user_version");
  const Result<std::int64_t> tables = database.IntegerOf("SELECT count(*) FROM sqlite_master");
  const Result<std::int64_t> kind = database.IntegerOf("PRAGMA application_id");
  if (!version || !tables || !kind) return store.Failed("cannot be read");
  if (*version > kSchemaVersion) {
    return Error{fmt::format("{}: written by a newer plumbline (schema {}, this one knows {})",
                             path, *version, kSchemaVersion)};
  }
  const bool empty = *tables == 0;
  if (!empty && *kind != kApplicationId) {
    return Error{fmt::format("{}: is a database, but no lens store of plumbline", path)};
  }
  if (!PassesCheck(database)) {
    damaged = true;
    return Error{fmt::format("{}: fails its check", path)};
  }
  if (!database.Run("PRAGMA journal_mode=WAL") || !database.Run("PRAGMA synchronous=FULL")) {
    return store.Failed("cannot be prepared");
  }
  if (empty) {
    Transaction transaction(database);
    const std::string mark = fmt::format("PRAGMA application_id={}; PRAGMA user_version={}",
                                         kApplicationId, kSchemaVersion);
    // Another process may have made it since.
    const Result<std::int64_t> present = database.IntegerOf("PRAGMA user_version");
    const bool made = transaction.begun() && present &&
                      (*present != 0 || (database.Run(kSchema) && database.Run(mark.c_str()))) &&
                      transaction.Commit();
    if (!made) return store.Failed("cannot be made");
  }
  const auto entries = store.Read(std::nullopt, "");
  if (!entries) {
    damaged = true;
    return Error{entries.error()};
  }
  return store;
}

Result<LensStore> LensStore::Open(const std::string& path) {
  bool damaged = false;
  Result<LensStore> store = OpenSound(path, damaged);
  if (store.ok() || !damaged) return store;
  const std::string problem = store.error();
  const std::string backup = BackupOf(path);
  if (!std::filesystem::exists(backup)) {
    return Error{fmt::format("{}; there is no backup ({}): move the file away to begin anew",
                             problem, backup)};
  }
  // Only a sound backup may take the place of the file.
  bool backup_damaged = false;
  {
    const Result<LensStore> sound = OpenSound(backup, backup_damaged);
    if (!sound) return Error{fmt::format("{}; and the backup: {}", problem, sound.error())};
  }
  const Result<std::string> away = MoveAway(path);
  if (!away) return Error{away.error()};
  std::error_code copied;
  std::filesystem::copy_file(backup, path, copied);
  if (copied) return Error{fmt::format("{}: {}", path, copied.message())};
  store = OpenSound(path, damaged);
  if (!store) return store;
  const auto count = store.value().Count();
  store.value().notice_ =
      fmt::format("{}; it was moved to {}, and the backup with {} lenses is in use", problem, *away,
                  count ? *count : 0);
  return store;
}

Result<std::int64_t> LensStore::Append(const LensEntry& entry) {
  if (const auto fault = FaultOf(entry)) {
    return Error{fmt::format("{}: lens not kept: {}", database_->path(), *fault)};
  }
  std::int64_t id = 0;
  {
    Transaction transaction(*database_);
    if (!transaction.begun()) return Failed("lens not kept");
    Statement statement(database_->get(), kInsert);
    if (!Insert(statement, entry)) return Failed("lens not kept");
    id = sqlite3_last_insert_rowid(database_->get());
    if (!transaction.Commit()) return Failed("lens not kept");
  }
  const Result<bool> kept = KeepBackup();
  notice_ = kept ? "" : kept.error();
  return id;
}

/// A copy of the whole file, replaced as a whole.
Result<bool> LensStore::KeepBackup() {
  const std::string backup = BackupOf(database_->path()), fresh = backup + ".new";
  unlink(fresh.c_str());
  Statement copy(database_->get(), "VACUUM INTO ?");
  copy.Bind(1, fresh);
  if (!copy.Run()) return Failed("no backup made");
  const std::string folder = std::filesystem::absolute(backup).parent_path().string();
  if (!Sync(fresh, O_RDWR) || std::rename(fresh.c_str(), backup.c_str()) != 0 ||
      !Sync(folder, O_RDONLY | O_DIRECTORY)) {
    return Error{fmt::format("{}: no backup made: {}", backup, std::strerror(errno))};
  }
  return true;
}

Result<std::vector<LensEntry>> LensStore::Read(const std::optional<std::string>& camera_serial,
                                               const std::string& mode) {
  const std::string sql = std::string(kSelect) +
                          (camera_serial ? " WHERE camera_serial = ? AND mode = ?" : "") +
                          " ORDER BY id";
  Statement statement(database_->get(), sql);
  if (camera_serial) {
    statement.Bind(1, *camera_serial);
    statement.Bind(2, mode);
  }
  std::vector<LensEntry> entries;
  int code = SQLITE_ROW;
  while ((code = statement.Step()) == SQLITE_ROW) {
    std::optional<LensEntry> entry = EntryFrom(statement);
    if (!entry) {
      return Error{
          fmt::format("{}: lens {} fails its checksum", database_->path(), statement.Integer(23))};
    }
    entries.push_back(*std::move(entry));
  }
  if (code != SQLITE_DONE) return Failed("cannot be read");
  return entries;
}

Result<std::vector<LensEntry>> LensStore::Entries(const std::string& camera_serial,
                                                  const std::string& mode) {
  return Read(camera_serial, mode);
}

Result<std::int64_t> LensStore::Count() {
  Statement statement(database_->get(), "SELECT count(*) FROM lens");
  if (statement.Step() != SQLITE_ROW) return Failed("cannot be read");
  return statement.Integer(0);
}

std::vector<LensEntry> LensStore::Nodes(std::vector<LensEntry> entries, const LensKey& key,
                                        const LensTolerance& tolerance) {
  const auto other_focus = [&](const LensEntry& entry) {
    return key.focus_counts && entry.key.focus_counts &&
           std::abs(std::int64_t{*key.focus_counts} - *entry.key.focus_counts) >
               tolerance.focus_counts;
  };
  std::erase_if(entries, other_focus);
  // The newest first; an older one at the same zoom is left out.
  std::reverse(entries.begin(), entries.end());
  std::vector<LensEntry> nodes;
  for (LensEntry& entry : entries) {
    const bool newer = std::any_of(nodes.begin(), nodes.end(), [&](const LensEntry& node) {
      return std::abs(std::int64_t{node.key.zoom_counts} - entry.key.zoom_counts) <=
             tolerance.zoom_counts;
    });
    if (!newer) nodes.push_back(std::move(entry));
  }
  return nodes;
}

Result<std::optional<LensFound>> LensStore::Find(const LensKey& key,
                                                 const LensTolerance& tolerance) {
  Result<std::vector<LensEntry>> entries = Read(key.camera_serial, key.mode);
  if (!entries) return Error{entries.error()};
  const std::vector<LensEntry> nodes = Nodes(std::move(entries).value(), key, tolerance);
  if (nodes.empty()) return std::optional<LensFound>();
  std::vector<LensNode> curve_nodes;
  curve_nodes.reserve(nodes.size());
  for (const LensEntry& node : nodes) {
    curve_nodes.push_back({node.key.zoom_counts, node.lens, node.covariance});
  }
  const LensCurve curve(curve_nodes);
  const auto distance = [&key](const LensEntry& node) {
    return std::abs(std::int64_t{node.key.zoom_counts} - key.zoom_counts);
  };
  const LensEntry& nearest = *std::min_element(
      nodes.begin(), nodes.end(),
      [&](const LensEntry& a, const LensEntry& b) { return distance(a) < distance(b); });

  LensFound found;
  found.entry = nearest;
  const bool calibrated = distance(nearest) <= tolerance.zoom_counts;
  const std::optional<LensOnCurve> at =
      curve.At(calibrated ? nearest.key.zoom_counts : key.zoom_counts);
  if (!at) return std::optional<LensFound>();
  found.log_focal_sd = at->log_focal_sd;
  if (nodes.size() > 1) found.log_focal_per_count = at->log_focal_per_count;
  if (!calibrated) {
    found.how = LensFound::How::kInterpolated;
    found.entry.key.zoom_counts = key.zoom_counts;
    found.entry.lens = at->lens;
    found.entry.covariance = at->covariance;
  }
  return std::optional(found);
}

Result<std::vector<std::int32_t>> LensStore::Propose(const LensKey& key,
                                                     const LensTolerance& tolerance,
                                                     std::int32_t lowest, std::int32_t highest,
                                                     int count, double good_enough) {
  Result<std::vector<LensEntry>> entries = Read(key.camera_serial, key.mode);
  if (!entries) return Error{entries.error()};
  std::vector<LensNode> nodes;
  for (const LensEntry& node : Nodes(std::move(entries).value(), key, tolerance)) {
    nodes.push_back({node.key.zoom_counts, node.lens, node.covariance});
  }
  return LensCurve(nodes).Propose(lowest, highest, count, good_enough);
}

}  // namespace plumbline
