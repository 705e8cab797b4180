// The measurement journal: every measured point, kept in one SQLite file.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "app/journal/journal_row.h"
#include "app/sqlite/database.h"

namespace plumbline {

/// Which rows are asked for; every condition that is set must hold.
struct JournalFilter {
  std::optional<std::int64_t> after_id = std::nullopt;
  std::optional<std::int64_t> last = std::nullopt;  ///< only that many, the newest
  std::optional<std::string> session = std::nullopt;
  std::optional<int> model_version = std::nullopt;
  /// kMeasurements leaves out what waits in quarantine or was rejected.
  enum class Rows { kMeasurements, kAll, kWaiting };
  Rows rows = Rows::kMeasurements;
};

/// The journal. Append() returns when the rows are on the disk (write-ahead log,
/// synchronous=FULL): a power cut or kill loses nothing that was reported as written, and leaves
/// no half row. Lengths and angles stand in mm and degrees in the file, as in measured.csv, so that
/// it can be read with the sqlite3 command.
class Journal {
 public:
  /// Opens or makes the file. @param bound_bytes  it grows up to so much; 0: up to the disk
  /// @return why not: not a journal, of a newer version, not writable
  static Result<Journal> Open(const std::string& path, std::int64_t bound_bytes = 0);
  /// Opens an existing one for reading; makes nothing.
  static Result<Journal> OpenForReading(const std::string& path);

  /// Writes all rows or none. @param joints  the cell's, for their units
  /// @return the id of the last row
  Result<std::int64_t> Append(const std::vector<JournalRow>& rows,
                              const std::vector<Joint>& joints);
  /// The same, with a record of the imported file; refused where that content was imported before.
  Result<std::int64_t> AppendImport(const std::vector<JournalRow>& rows,
                                    const std::vector<Joint>& joints, const std::string& file,
                                    std::uint64_t content_hash, bool again);

  /// The file that content was imported as; nothing where it was not.
  Result<std::optional<std::string>> ImportedAs(std::uint64_t content_hash);

  /// Marks what the monitor found of a row. Called when the row is written and judged.
  Result<void> Mark(std::int64_t id, bool wild, bool alarm);

  /// A person's decision on quarantined rows, all of them or none. A row that was decided may be
  /// decided anew. @return why not: a row that is not there, or never was in quarantine
  Result<void> Decide(const std::vector<std::int64_t>& ids, bool accept, std::int64_t unix_ms);
  /// Rows that wait for a decision.
  Result<std::int64_t> Waiting();
  /// Counts decisions; changes with each, whoever made it.
  Result<std::int64_t> LastDecision();

  /// Shows rows one by one in ascending id, without holding them all. Errors as Read().
  Result<void> ForEach(const JournalFilter& filter, const std::vector<Joint>& joints,
                       const std::function<void(const JournalRow&)>& show);
  /// Rows in ascending id. A row whose joints are not those of the cell is an error that names it.
  Result<std::vector<JournalRow>> Read(const JournalFilter& filter,
                                       const std::vector<Joint>& joints);

  /// From where on the monitor counts.
  struct Restart {
    std::int64_t after_row = 0;
    int model_version = 0;
  };
  /// Notes that the monitor begins anew behind the present last row. @param reason  "model"
  /// (another one came into force) or "person"
  Result<void> RecordMonitorRestart(int model_version, const std::string& reason);
  /// The newest restart of any reason, and the newest for a model; nothing where there is none.
  Result<std::optional<Restart>> LastRestart();
  Result<std::optional<Restart>> LastModel();

  /// UTC where t_s of probes is 0, whole seconds since 1970: when the journal was made. It never
  /// changes; read once, when the journal is opened.
  double EpochUtc_s() const { return epoch_utc_s_; }
  /// The time of the newest probe; nothing where there is none.
  Result<std::optional<double>> LastProbeTime_s();

  /// Whether the file was moved or deleted while it is open, and this is what to say. What was
  /// written so far is brought into the file, wherever it is now.
  std::optional<Error> Moved();

  Result<std::int64_t> Count();
  /// 0 where there is none.
  Result<std::int64_t> LastRow();
  /// Number of joints of the newest row; 0 where there is none.
  Result<int> JointCount();

 private:
  explicit Journal(Database database) : database_(std::move(database)) {}
  Result<std::int64_t> AppendInside(const std::vector<JournalRow>& rows,
                                    const std::vector<Joint>& joints);
  Result<std::optional<Restart>> RestartBy(const char* sql);
  Result<void> ReadEpoch();
  Result<void> Bound();
  Error Failed(const char* what) const;
  Error NotWritten(const char* what);

  Database database_;
  double epoch_utc_s_ = 0;
  std::int64_t bound_bytes_ = 0;
};

/// FNV-1a, to recognise a file that was imported before.
std::uint64_t ContentHash(std::string_view text);

}  // namespace plumbline
