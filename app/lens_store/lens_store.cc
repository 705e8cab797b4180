#include "app/lens_store/lens_store.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <utility>

#include "app/lens_store/lens_row.h"
#include "drivers/os/file_writing.h"
#include "firmware-like/lens/lens_curve.h"

namespace plumbline {
namespace {

constexpr int kApplicationId = 0x504C4C31;  // "PLL1", told by file(1)

std::string BackupOf(const std::string& path) {
  return path + ".backup";
}

bool PassesCheck(Database& database) {
  Statement check(database.get(), "PRAGMA integrity_check(1)");
  return check.Step() == SQLITE_ROW && check.Text(0) == "ok";
}

/// Why it is none, or none of ours. @param empty  no table was made in it yet
std::optional<Error> NoLensStore(Database& database, bool& empty) {
  const Result<std::int64_t> version = database.IntegerOf("PRAGMA user_version");
  const Result<std::int64_t> tables = database.IntegerOf("SELECT count(*) FROM sqlite_master");
  const Result<std::int64_t> kind = database.IntegerOf("PRAGMA application_id");
  if (!version || !tables || !kind) {
    return Error{fmt::format("{}: cannot be read: {}", database.path(), database.Problem())};
  }
  if (*version > LensStore::kSchemaVersion) {
    return Error{NewerSchema(database.path(), *version, LensStore::kSchemaVersion)};
  }
  empty = *tables == 0;
  if (empty || *kind == kApplicationId) return std::nullopt;
  return Error{fmt::format("{}: is a database, but no lens store of plumbline", database.path())};
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
  if (!opened) return opened.failure();
  LensStore store(std::move(opened).value());
  Database& database = *store.database_;
  if (!database.Run("SELECT count(*) FROM sqlite_master")) {
    const int code = sqlite3_errcode(database.get());
    damaged = code == SQLITE_NOTADB || code == SQLITE_CORRUPT;
    return store.Failed("cannot be read");
  }
  bool empty = false;
  if (auto why = NoLensStore(database, empty)) return *std::move(why);
  if (!PassesCheck(database)) {
    damaged = true;
    return Error{fmt::format("{}: fails its check", path)};
  }
  if (!database.Run("PRAGMA journal_mode=WAL") || !database.Run("PRAGMA synchronous=FULL")) {
    return store.Failed("cannot be prepared");
  }
  // A write version that SQLite does not know: it reads the file, and refuses every lens.
  if (sqlite3_db_readonly(database.get(), "main") == 1 && access(path.c_str(), W_OK) == 0) {
    damaged = true;
    return Error{fmt::format("{}: its header lets nobody write", path)};
  }
  const Result<std::int64_t> version = database.IntegerOf("PRAGMA user_version");
  if (!version) return store.Failed("cannot be read");
  if (empty || *version < kSchemaVersion) {
    if (const auto prepared = store.Prepare(damaged); !prepared) return prepared.failure();
  }
  const auto entries = store.Read(std::nullopt, "");
  if (!entries) {
    damaged = true;
    return entries.failure();
  }
  return store;
}

/// Makes the tables, or brings older ones to this version: both or neither.
Result<void> LensStore::Prepare(bool& damaged) {
  Transaction transaction(*database_);
  // Another process may have done it since.
  const Result<std::int64_t> version = database_->IntegerOf("PRAGMA user_version");
  const Result<std::int64_t> tables = database_->IntegerOf("SELECT count(*) FROM sqlite_master");
  if (!transaction.begun() || !version || !tables) return Failed("cannot be prepared");
  if (*tables == 0) {
    const std::string mark = fmt::format("PRAGMA application_id={}; PRAGMA user_version={}",
                                         kApplicationId, kSchemaVersion);
    if (!database_->Run(kLensSchema) || !database_->Run(mark.c_str())) {
      return Failed("cannot be made");
    }
  } else if (auto brought = BringToLensSchema(*database_, *version, damaged); !brought) {
    return brought;
  }
  if (!transaction.Commit()) return Failed("cannot be prepared");
  return {};
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
  if (!away) return away.failure();
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

Result<LensStore> LensStore::OpenForReading(const std::string& path) {
  Result<Database> opened = Database::Open(path, Database::Mode::kRead);
  if (!opened) return opened.failure();
  LensStore store(std::move(opened).value());
  bool empty = false;
  if (auto why = NoLensStore(*store.database_, empty)) return *std::move(why);
  if (empty) return Error{fmt::format("{}: is empty, no lens store yet", path)};
  const Result<std::int64_t> version = store.database_->IntegerOf("PRAGMA user_version");
  if (!version) return version.failure();
  if (*version < kSchemaVersion) {
    return Error{
        fmt::format("{}: written by an older plumbline; it becomes readable once this "
                    "version's plumblined has opened it",
                    path)};
  }
  return store;
}

Result<std::int64_t> LensStore::Append(const LensEntry& given) {
  LensEntry entry = given;
  entry.id = 0;
  if (const auto fault = FaultOf(entry)) {
    return Error{fmt::format("{}: lens not kept: {}", database_->path(), *fault)};
  }
  std::int64_t id = 0;
  {
    Transaction transaction(*database_);
    if (!transaction.begun()) return Failed("lens not kept");
    Statement statement(database_->get(), kInsertLens);
    if (!InsertLens(statement, entry)) return Failed("lens not kept");
    id = sqlite3_last_insert_rowid(database_->get());
    if (!transaction.Commit()) return Failed("lens not kept");
  }
  const Result<void> kept = KeepBackup();
  notice_ = kept ? "" : kept.error();
  return id;
}

/// A copy of the whole file, replaced as a whole.
Result<void> LensStore::KeepBackup() {
  const std::string backup = BackupOf(database_->path()), fresh = backup + ".new";
  unlink(fresh.c_str());
  Statement copy(database_->get(), "VACUUM INTO ?");
  copy.Bind(1, fresh);
  if (!copy.Run()) return Failed("no backup made");
  const std::string folder = std::filesystem::absolute(backup).parent_path().string();
  if (!SyncFile(fresh) || std::rename(fresh.c_str(), backup.c_str()) != 0 || !SyncFolder(folder)) {
    return Error{fmt::format("{}: no backup made: {}", backup, std::strerror(errno))};
  }
  return {};
}

Result<std::vector<LensEntry>> LensStore::Read(const std::optional<std::string>& camera_serial,
                                               const std::string& mode) {
  const std::string sql = std::string(kSelectLens) +
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
    std::optional<LensEntry> entry = EntryOfRow(statement);
    if (!entry) {
      return Error{
          fmt::format("{}: lens {} fails its checksum", database_->path(), IdOfRow(statement))};
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
  if (!entries) return entries.failure();
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
  if (!entries) return entries.failure();
  std::vector<LensNode> nodes;
  for (const LensEntry& node : Nodes(std::move(entries).value(), key, tolerance)) {
    nodes.push_back({node.key.zoom_counts, node.lens, node.covariance});
  }
  return LensCurve(nodes).Propose(lowest, highest, count, good_enough);
}

}  // namespace plumbline
