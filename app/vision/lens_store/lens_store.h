// Append-only SQLite store of calibrated lenses, by camera and zoom.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/base/sqlite/database.h"
#include "app/vision/lens_store/lens_entry.h"
#include "firmware-like/result.h"

namespace plumbline::vision {

// Mapping between lens entries and rows of the store's table.

/// Creates the table, its index, and triggers that refuse to change or remove a row.
extern const char* const kLensSchema;
extern const char* const kInsertLens;
extern const char* const kSelectLens;  ///< all rows, unordered

inline constexpr int kLensSchemaVersion = 4;
/// Inserts under the entry's id, or the next free one if that is 0.
/// @param statement  prepared from kInsertLens
bool InsertLens(sqlite::Statement& statement, const LensEntry& entry);

/// @param row  of kSelectLens
/// @return     nullopt if the row is damaged: a missing or invalid value (FaultOf) or a wrong
///             checksum
std::optional<LensEntry> ReadLensEntry(const sqlite::Statement& row);
/// Likewise, without verifying the checksum.
std::optional<LensEntry> ReadLensValues(const sqlite::Statement& row);
std::int64_t RowId(const sqlite::Statement& row);

/// A lens for a requested zoom.
struct LensFound {
  enum class How { kCalibrated, kInterpolated };
  How how = How::kCalibrated;
  LensEntry entry;          ///< for kInterpolated: the nearest node with the interpolated lens
  double log_focal_sd = 0;  ///< of ln f (1), including interpolation
  /// d ln f / d count at that zoom; nullopt if only one node is known.
  std::optional<double> log_focal_per_count;
};

/// Largest difference in counts within which zoom and focus are considered equal.
struct LensTolerance {
  std::int32_t zoom_counts = 2, focus_counts = 4;
};

/// Append() returns once the entry is on disk; entries are never changed or removed, which triggers
/// in the file enforce. Each Append() then replaces a backup copy of the whole file (PATH.backup)
/// atomically. Each entry has a checksum that is verified when it is read.
///
/// Columns have the units of LensEntry; the covariance is a JSON array, row by row.
/// Everything except the corners is readable with the sqlite3 command.
class LensStore {
 public:
  static constexpr int kSchemaVersion = kLensSchemaVersion;

  /// Opens or creates the file. A damaged file (not a database, or a page or entry that fails its
  /// check) is moved to PATH.damaged-N and replaced by the backup; notice() reports it.
  /// @return an error if the file is not a lens store, of another version, not writable, or damaged
  ///         without a usable backup
  static Result<LensStore> Open(const std::string& path);
  /// Opens read-only and unchanged, possibly while a daemon writes.
  /// @return an error as above
  static Result<LensStore> OpenForReading(const std::string& path);

  /// Message for the operator about the last Open() or Append(); empty if nothing was wrong.
  const std::string& notice() const { return notice_; }

  /// @param entry  its id is ignored
  /// @return the id, or an error if the entry is invalid (FaultOf()) or the disk fails
  Result<std::int64_t> Append(const LensEntry& entry);

  /// All entries, oldest first.
  Result<std::vector<LensEntry>> All() { return Read(std::nullopt, ""); }
  Result<std::int64_t> Count();

  /// The newest entry within the tolerance; otherwise the curve through the newest entry of each
  /// zoom at that focus; otherwise nullopt. An entry without focus matches any. An entry whose
  /// uncertainty rests on a fact that is not among `declared` is left out.
  /// @param declared  what is declared of the camera now
  Result<std::optional<LensFound>> Find(const LensKey& key, const LensTolerance& tolerance,
                                        const target::DeclaredFacts& declared = {});
  /// The newest entry within the tolerance that Find() leaves out because of its declarations.
  Result<std::optional<LensEntry>> Withheld(const LensKey& key, const LensTolerance& tolerance,
                                            const target::DeclaredFacts& declared);

 private:
  explicit LensStore(sqlite::Database database)
      : database_(std::make_unique<sqlite::Database>(std::move(database))) {}
  static Result<LensStore> OpenVerified(const std::string& path, bool& damaged);
  Result<std::vector<LensEntry>> Read(const std::optional<std::string>& camera_serial,
                                      const std::string& mode);
  /// The entries whose declarations are among `declared`.
  Result<std::vector<LensEntry>> Usable(const LensKey& key, const target::DeclaredFacts& declared);
  /// The newest entry of each zoom; entries with another focus are omitted.
  static std::vector<LensEntry> CurveNodes(std::vector<LensEntry> entries, const LensKey& key,
                                           const LensTolerance& tolerance);
  Result<void> Prepare();  ///< creates the tables
  Result<void> WriteBackup();
  Error Failed(const std::string& what) const;

  std::unique_ptr<sqlite::Database> database_;
  std::string notice_;
};

}  // namespace plumbline::vision
