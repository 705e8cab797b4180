// Measurement journal: durable record of every measured point, in one SQLite file.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "app/base/sqlite/database.h"
#include "app/cell/journal/integrity.h"
#include "app/cell/journal/journal_row.h"
#include "app/cell/journal/row_checksum.h"

namespace plumbline::cell {

/// Selects rows; all conditions that are set must hold.
struct JournalFilter {
  std::optional<std::int64_t> after_id = std::nullopt;
  std::optional<std::int64_t> last = std::nullopt;  ///< only this many, the newest
  std::optional<std::string> session = std::nullopt;
  std::optional<int> model_version = std::nullopt;
  /// kMeasurements excludes rows that wait in quarantine or were rejected.
  enum class Rows { kMeasurements, kAll, kWaiting };
  Rows rows = Rows::kMeasurements;
};

/// Append() returns when the rows are on the disk (write-ahead log, synchronous=FULL): a power cut
/// or kill loses nothing that was reported as written, and leaves no partial row. The file contains
/// lengths in mm and angles in degrees, as measured.csv does, so that it can be read with the
/// sqlite3 command. Not thread-safe; several processes may open the file.
class Journal {
 public:
  /// Opens or creates the file, and checks all of it: nothing is added to a damaged journal.
  /// @param max_bytes  maximum size of the file; 0 if unlimited
  /// @param step       progress callback, called every few milliseconds
  /// @return  why it cannot be used: not a journal, of a newer version, not writable, or damaged,
  ///          with the rows concerned
  static Result<Journal> Open(const std::string& path, std::int64_t max_bytes = 0,
                              const std::function<void()>& step = {});
  /// Opens an existing journal for reading; creates nothing.
  static Result<Journal> OpenForReading(const std::string& path);

  /// Writes all rows or none.
  /// @param joints  the cell's joints, for their units
  /// @return        the id of the last row
  Result<std::int64_t> Append(const std::vector<JournalRow>& rows,
                              const std::vector<model::Joint>& joints);
  /// The same, and records the imported file. Refused if that content was imported before, unless
  /// `again`.
  Result<std::int64_t> AppendImport(const std::vector<JournalRow>& rows,
                                    const std::vector<model::Joint>& joints,
                                    const std::string& file, std::uint64_t content_hash,
                                    bool again);

  /// Name of the file that this content was imported from; nullopt if it was not.
  Result<std::optional<std::string>> ImportedAs(std::uint64_t content_hash);

  /// Stores the drift monitor's result for a row.
  /// @param wild   the row is far from the reference
  /// @param alarm  the row raised the drift alarm
  Result<void> Mark(std::int64_t id, bool wild, bool alarm);

  /// Stores a person's decision on quarantined rows, all of them or none. A decision can be
  /// changed.
  /// @return  why it was not stored: a row does not exist, or never was in quarantine
  Result<void> Decide(const std::vector<std::int64_t>& ids, bool accept, std::int64_t unix_ms);
  /// Number of rows that wait for a decision.
  Result<std::int64_t> Waiting();
  /// Id of the newest decision, 0 if there is none; changes with every decision, by any process.
  Result<std::int64_t> LastDecision();

  /// Finds rows that are no longer as they were written, anywhere in the file.
  IntegrityReport Check(const std::function<void()>& step = {});

  /// Calls `visit` for each row in ascending id, without loading them all. Fails as Read() does.
  Result<void> ForEach(const JournalFilter& filter, const std::vector<model::Joint>& joints,
                       const std::function<void(const JournalRow&)>& visit);
  /// Rows in ascending id. Fails, naming the row, if a row was changed since it was written, or
  /// does not have the cell's joints.
  Result<std::vector<JournalRow>> Read(const JournalFilter& filter,
                                       const std::vector<model::Joint>& joints);

  /// Start of the rows that the drift monitor considers.
  struct Restart {
    std::int64_t after_row = 0;
    int model_version = 0;
    bool radius_contradicted = false;  ///< by the reference in use before the restart
  };
  /// Records that the drift monitor restarts after the last row written so far.
  /// @param reason               "model" (another one came into force) or "person"
  /// @param radius_contradicted  by the reference in use before the restart, for the same model
  Result<void> RecordMonitorRestart(int model_version, const std::string& reason,
                                    bool radius_contradicted = false);
  /// The newest restart for any reason, and the newest one caused by a model; nullopt if there is
  /// none.
  Result<std::optional<Restart>> LastRestart();
  Result<std::optional<Restart>> LastModel();

  /// UTC at which t_s of probes is 0 [whole seconds since 1970]: when the journal was created.
  /// Never changes; read once, when the journal is opened.
  double EpochUtc_s() const { return epoch_utc_s_; }
  /// t_s of the newest probe; nullopt if there is none.
  Result<std::optional<double>> LastProbeTime_s();

  /// An error if the file was moved or deleted while it is open. All rows written so far are then
  /// merged into the file, wherever it is now.
  Result<void> CheckNotMoved();

  Result<std::int64_t> Count();
  /// Id of the newest row; 0 if there is none.
  Result<std::int64_t> LastRow();
  /// Number of joints of the newest row; 0 if there is none.
  Result<int> JointCount();

 private:
  explicit Journal(sqlite::Database database) : database_(std::move(database)) {}
  Result<std::int64_t> AppendInside(const std::vector<JournalRow>& rows,
                                    const std::vector<model::Joint>& joints);
  Result<std::optional<Restart>> RestartBy(const char* sql);
  Result<void> ReadEpoch();
  Result<void> ApplySizeLimit();
  /// Seals the row that was inserted last.
  bool Seal(const SealedTable& table);
  Error Failed(const char* what) const;
  Error DamagedRow(std::int64_t id) const;
  /// Like Failed(), but explains a full journal.
  Error WriteFailed(const char* what);

  sqlite::Database database_;
  double epoch_utc_s_ = 0;
  std::int64_t max_bytes_ = 0;
};

/// FNV-1a hash for recognising a file that was imported before.
std::uint64_t ContentHash(std::string_view text);

}  // namespace plumbline::cell
