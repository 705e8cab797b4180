#include "app/journal/salvage.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "app/journal/journal.h"
#include "app/journal/journal_schema.h"
#include "app/journal/row_checksum.h"

namespace plumbline::journal {
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
            ? "SELECT utc_s, unchecked_through FROM damaged.epoch LIMIT 1"
            : "SELECT CAST(round(unix_ms / 1000.0 - t_s) AS INTEGER), 0 FROM measurement "
              "WHERE unix_ms IS NOT NULL AND t_s IS NOT NULL GROUP BY 1 ORDER BY count(*) DESC "
              "LIMIT 1";
    if (!whole || *whole != 1) {
      salvage_.notes.emplace_back("the epoch was damaged and is computed from the probes' times");
    }
    return fresh_.Run(fmt::format("DELETE FROM epoch; INSERT INTO epoch (utc_s, unchecked_through) "
                                  "{}; {}",
                                  source, SealSql(kEpochTable, "checksum IS NULL"))
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

/// Opens the damaged file, converts it to the present schema, and examines it.
/// @return  why it cannot be salvaged
Result<IntegrityReport> Examined(const std::string& path) {
  Result<sqlite::Database> opened = sqlite::Database::Open(path, sqlite::Database::Mode::kWrite);
  if (!opened) return opened.failure();
  sqlite::Database& database = opened.value();
  const Result<std::int64_t> schema = sqlite::SchemaOf(database, kJournalIdentity);
  if (!schema) return schema.failure();
  if (const Result<void> added = AddChecksumFunction(database); !added) return added.failure();
  if (const Result<void> ready = MigrateSchema(database); !ready) return ready.failure();
  IntegrityReport found = CheckIntegrity(database, {});
  if (!found.obstacle.empty()) {
    return Error{fmt::format("{}: cannot be checked: {}", path, found.obstacle)};
  }
  if (found.intact()) {
    return Error{fmt::format("{}: is intact; there is nothing to salvage", path)};
  }
  database.Run("PRAGMA wal_checkpoint(TRUNCATE)");
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

}  // namespace

Result<Salvage> SalvageJournal(const std::string& path, std::int64_t unix_ms) {
  Salvage salvage;
  Result<IntegrityReport> found = Examined(path);
  if (!found) return found.failure();
  salvage.found = std::move(found).value();
  std::error_code absent;
  if (std::filesystem::exists(path + "-wal", absent)) {
    return Error{
        fmt::format("{}: another program has it open, nothing was changed; stop plumbline, "
                    "plumbline-view and plumbline-fleet, then salvage again",
                    path)};
  }
  const std::string fresh_path = path + ".salvaged";
  std::filesystem::remove(fresh_path, absent);
  if (const Result<void> copied = CopyIntact(path, fresh_path, unix_ms, salvage); !copied) {
    std::filesystem::remove(fresh_path, absent);
    return copied.failure();
  }
  if (const Result<Journal> checked = Journal::Open(fresh_path); !checked) return checked.failure();
  salvage.damaged_file = DamagedName(path, unix_ms);
  if (std::rename(path.c_str(), salvage.damaged_file.c_str()) != 0) return Failed(path);
  if (std::rename(fresh_path.c_str(), path.c_str()) != 0) return Failed(fresh_path);
  return salvage;
}

}  // namespace plumbline::journal
