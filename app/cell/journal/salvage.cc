#include "app/cell/journal/salvage.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <utility>

#include "app/cell/journal/journal.h"
#include "app/cell/journal/journal_schema.h"
#include "app/cell/journal/row_checksum.h"
#include "drivers/os/file_writing.h"

namespace plumbline::cell {
namespace {

/// Copies rows of the damaged file, attached as `damaged`, into the new one.
class Copier {
 public:
  Copier(sqlite::Database& fresh, Salvage& salvage) : fresh_(fresh), salvage_(salvage) {}

  bool Measurements(std::int64_t last) {
    sqlite::Statement copy(fresh_.get(), CopySql(kMeasurementTable, true));
    std::size_t damaged = 0;
    for (std::int64_t id = 1; id <= last; ++id) {
      const auto& ranges = salvage_.found.damaged;
      while (damaged < ranges.size() && ranges[damaged].last < id) ++damaged;
      if (damaged < ranges.size() && ranges[damaged].first <= id) continue;
      copy.Bind(1, id);
      if (!copy.Run()) return false;
      salvage_.saved += sqlite3_changes(fresh_.get());
    }
    return true;
  }

  /// The rows of another table that are intact.
  bool Others(const SealedTable& table) {
    sqlite::Statement copy(fresh_.get(), CopySql(table, false));
    if (copy.Run()) return true;
    // Its pages are damaged: everything up to the first such page was rolled back.
    salvage_.notes.push_back(fmt::format("the table {} could not be saved", table.name));
    return true;
  }

  /// The clock's zero of all probes. If its row is damaged, most probes still agree on it.
  bool Epoch() {
    const std::string intact = IntactSql(kEpochTable);
    const Result<std::int64_t> whole = fresh_.IntegerOf(
        fmt::format("SELECT count(*) FROM damaged.epoch WHERE {}", intact).c_str());
    const char* const source =
        whole && *whole == 1
            ? "SELECT utc_s FROM damaged.epoch LIMIT 1"
            : "SELECT CAST(round(unix_ms / 1000.0 - t_s) AS INTEGER) FROM measurement "
              "WHERE unix_ms IS NOT NULL AND t_s IS NOT NULL GROUP BY 1 ORDER BY count(*) DESC "
              "LIMIT 1";
    // Without such probes, nothing refers to it.
    const char* const otherwise =
        "INSERT INTO epoch (utc_s) SELECT CAST(strftime('%s', 'now') AS INTEGER) "
        "WHERE NOT EXISTS (SELECT 1 FROM epoch)";
    if (!whole || *whole != 1) {
      salvage_.notes.emplace_back("the epoch was damaged and is computed from the probes' times");
    }
    return fresh_.Run(fmt::format("DELETE FROM epoch; INSERT INTO epoch (utc_s) {}; {}; {}", source,
                                  otherwise, SealSql(kEpochTable, "checksum IS NULL"))
                          .c_str());
  }

  bool RecordLost(std::int64_t unix_ms) {
    for (const auto* ranges : {&salvage_.found.damaged, &salvage_.found.missing}) {
      for (const RowRange& range : *ranges) {
        sqlite::Statement record(
            fresh_.get(), "INSERT INTO lost_rows (first_row, last_row, unix_ms) VALUES (?,?,?)");
        record.Bind(1, range.first);
        record.Bind(2, range.last);
        record.Bind(3, unix_ms);
        if (!record.Run()) return false;
      }
    }
    return fresh_.Run(SealSql(kLostTable, "checksum IS NULL").c_str());
  }

  /// New rows continue the numbers of the damaged file.
  bool NumbersFrom(std::int64_t last) {
    return fresh_.Run("DELETE FROM sqlite_sequence") &&
           fresh_.Run(
               fmt::format("INSERT INTO sqlite_sequence VALUES ('measurement', {})", last).c_str());
  }

 private:
  static std::string CopySql(const SealedTable& table, bool by_number) {
    return fmt::format(
        "INSERT INTO main.{0} ({1}, checksum) SELECT {1}, checksum FROM damaged.{0} "
        "WHERE {2}",
        table.name, ColumnsText(table), by_number ? "id = ?1" : IntactSql(table));
  }

  sqlite::Database& fresh_;
  Salvage& salvage_;
};

Error Failed(const std::string& what) {
  return Error{fmt::format("{}: {}", what, std::strerror(errno))};
}

std::string DamagedName(const std::string& path, std::int64_t unix_ms) {
  const std::filesystem::path file(path);
  return (file.parent_path() / fmt::format("{}.damaged-{}{}", file.stem().string(), unix_ms / 1000,
                                           file.extension().string()))
      .string();
}

/// Files of SQLite that only the salvage uses, removed before and after.
class WorkingFile {
 public:
  explicit WorkingFile(std::string path) : path_(std::move(path)) { Remove(); }
  ~WorkingFile() { Remove(); }
  WorkingFile(const WorkingFile&) = delete;
  WorkingFile& operator=(const WorkingFile&) = delete;
  const std::string& path() const { return path_; }

 private:
  void Remove() const {
    std::error_code absent;
    for (const char* suffix : {"", "-wal", "-shm"}) {
      std::filesystem::remove(path_ + suffix, absent);
    }
  }
  std::string path_;
};

/// Merges the write-ahead log into the file. @return  why it cannot be salvaged
Result<void> MergeLog(const std::string& path) {
  // A missing file must not be created.
  if (const auto there = sqlite::Database::Open(path, sqlite::Database::Mode::kRead); !there) {
    return there.failure();
  }
  Result<sqlite::Database> opened = sqlite::Database::Open(path, sqlite::Database::Mode::kWrite);
  if (!opened) return opened.failure();
  const Result<void> journal = sqlite::RequireCurrentSchema(opened.value(), kJournalIdentity);
  opened.value().Run("PRAGMA wal_checkpoint(TRUNCATE)");
  return journal;
}

Result<void> CheckNotInUse(const std::string& path) {
  std::error_code absent;
  if (!std::filesystem::exists(path + "-wal", absent)) return {};
  return Error{
      fmt::format("{}: another program has it open, nothing was changed; stop plumbline, "
                  "plumbline-view and plumbline-fleet, then salvage again",
                  path)};
}

/// @return  what of the file is damaged, or why it cannot be salvaged
Result<IntegrityReport> Examined(const std::string& file) {
  Result<sqlite::Database> opened = sqlite::Database::Open(file, sqlite::Database::Mode::kWrite);
  if (!opened) return opened.failure();
  sqlite::Database& database = opened.value();
  if (const Result<void> added = AddChecksumFunction(database); !added) return added.failure();
  IntegrityReport found = CheckIntegrity(database, {});
  if (!found.obstacle.empty()) {
    return Error{fmt::format("{}: cannot be checked: {}", file, found.obstacle)};
  }
  return found;
}

Result<void> CopyIntact(const std::string& path, const std::string& fresh_path,
                        std::int64_t unix_ms, Salvage& salvage) {
  {
    const Result<Journal> created = Journal::Open(fresh_path);
    if (!created) return created.failure();
  }
  Result<sqlite::Database> opened =
      sqlite::Database::Open(fresh_path, sqlite::Database::Mode::kWrite);
  if (!opened) return opened.failure();
  sqlite::Database& fresh = opened.value();
  if (const Result<void> added = AddChecksumFunction(fresh); !added) return added.failure();
  sqlite::Statement attach(fresh.get(), "ATTACH ?1 AS damaged");
  attach.Bind(1, path);
  if (!attach.Run()) return sqlite::Failure(fresh, "the damaged file cannot be read");
  sqlite::Transaction transaction(fresh);
  Copier copier(fresh, salvage);
  const std::int64_t last = salvage.found.last;
  bool done = transaction.begun() && copier.Measurements(last) && copier.Epoch();
  for (const SealedTable& table : SealedTables().subspan(2)) done = done && copier.Others(table);
  done = done && copier.RecordLost(unix_ms) && copier.NumbersFrom(last) && transaction.Commit();
  if (!done) return sqlite::Failure(fresh, "not salvaged");
  return {};
}

std::string FolderOf(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

/// Gives the new file the owner and mode of the damaged one, and its place. At every moment there
/// is a journal at `path`.
Result<void> Replace(const std::string& path, const std::string& fresh,
                     const std::string& damaged) {
  struct stat old {};
  struct stat made {};
  if (stat(path.c_str(), &old) != 0) return Failed(path);
  if (stat(fresh.c_str(), &made) != 0) return Failed(fresh);
  const bool same_owner = old.st_uid == made.st_uid && old.st_gid == made.st_gid;
  if (!same_owner && chown(fresh.c_str(), old.st_uid, old.st_gid) != 0) {
    return Failed(
        fmt::format("{}: the new journal cannot be given to its owner, nothing was "
                    "changed; salvage as root or as that user",
                    path));
  }
  if (chmod(fresh.c_str(), old.st_mode & 07777) != 0 || !os::SyncFile(fresh)) return Failed(fresh);
  if (link(path.c_str(), damaged.c_str()) != 0) return Failed(damaged);
  if (std::rename(fresh.c_str(), path.c_str()) == 0) return {};
  Error failed = Failed(fresh);
  unlink(damaged.c_str());
  return failed;
}

}  // namespace

Result<Salvage> SalvageJournal(const std::string& path, std::int64_t unix_ms) {
  if (const Result<void> merged = MergeLog(path); !merged) return merged.failure();
  const WorkingFile fresh(path + ".salvaged");
  Result<IntegrityReport> found = Examined(path);
  if (!found) return found.failure();
  if (found->intact()) {
    return Error{fmt::format("{}: is intact; there is nothing to salvage", path)};
  }
  if (const Result<void> unused = CheckNotInUse(path); !unused) return unused.failure();
  Salvage salvage;
  salvage.found = std::move(found).value();
  if (const Result<void> copied = CopyIntact(path, fresh.path(), unix_ms, salvage); !copied) {
    return copied.failure();
  }
  if (const Result<Journal> checked = Journal::Open(fresh.path()); !checked) {
    return checked.failure();
  }
  salvage.damaged_file = DamagedName(path, unix_ms);
  const Result<void> replaced = Replace(path, fresh.path(), salvage.damaged_file);
  if (!replaced) return replaced.failure();
  if (!os::SyncFolder(FolderOf(path))) {
    salvage.notes.push_back(Failed(FolderOf(path) + ": a power cut may undo the change").message);
  }
  return salvage;
}

}  // namespace plumbline::cell
