// Every lens that was ever calibrated, by camera and zoom, kept in one SQLite file.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/lens_store/lens_row.h"
#include "app/sqlite/database.h"
#include "firmware-like/result.h"

namespace plumbline {

/// What the store knows of a zoom.
struct LensFound {
  enum class How { kCalibrated, kInterpolated };
  How how = How::kCalibrated;
  LensEntry entry;          ///< of kInterpolated: the nearest node's, with the lens of the curve
  double log_focal_sd = 0;  ///< of ln f (1), interpolation included
  /// d ln f / d count there; nothing where only one node is known.
  std::optional<double> log_focal_per_count;
};

/// How far counts may be from an entry's to be the same zoom and the same focus.
struct LensTolerance {
  std::int32_t zoom_counts = 2, focus_counts = 4;
};

/// The store. Append() returns when the entry is on the disk; entries are never changed or removed
/// (triggers of the file refuse it). After each of them a copy of the whole file is kept beside it
/// (PATH.backup), replaced as a whole. Each entry has a checksum, looked at when it is read.
///
/// Lengths and angles stand as in LensEntry; the covariance is a JSON array of 81 numbers, row by
/// row, so that everything but the corners can be read with the sqlite3 command.
class LensStore {
 public:
  static constexpr int kSchemaVersion = kLensSchemaVersion;

  /// Opens or makes the file. A file that is damaged (no database, a page or an entry that fails
  /// its check) is moved to PATH.damaged-N and the backup takes its place; notice() says so.
  /// A store of an older version is brought to this one; the backup stays as it is until the next
  /// Append().
  /// @return why not: no lens store, of a newer version, not writable, damaged without a backup
  static Result<LensStore> Open(const std::string& path);
  /// As it is, beside a daemon that writes it. @return why not: as above, or of an older version
  static Result<LensStore> OpenForReading(const std::string& path);

  /// What a person should know of the opening; empty where all was well.
  const std::string& notice() const { return notice_; }

  /// @param entry  its id is not looked at
  /// @return the id, or why it was not kept (FaultOf() or the disk)
  Result<std::int64_t> Append(const LensEntry& entry);

  /// All entries, oldest first; of a camera in one mode.
  Result<std::vector<LensEntry>> All() { return Read(std::nullopt, ""); }
  Result<std::vector<LensEntry>> Entries(const std::string& camera_serial, const std::string& mode);
  Result<std::int64_t> Count();

  /// The newest entry within the tolerance, else the curve through the newest entry of each zoom at
  /// that focus, else nothing. An entry without focus fits any.
  Result<std::optional<LensFound>> Find(const LensKey& key, const LensTolerance& tolerance);

  /// Zooms worth calibrating next, the most useful first, see LensCurve::Propose().
  Result<std::vector<std::int32_t>> Propose(const LensKey& key, const LensTolerance& tolerance,
                                            std::int32_t lowest, std::int32_t highest, int count,
                                            double good_enough);

 private:
  explicit LensStore(Database database)
      : database_(std::make_unique<Database>(std::move(database))) {}
  static Result<LensStore> OpenSound(const std::string& path, bool& damaged);
  Result<std::vector<LensEntry>> Read(const std::optional<std::string>& camera_serial,
                                      const std::string& mode);
  /// The newest of each zoom, and entries of other focus left out.
  static std::vector<LensEntry> Nodes(std::vector<LensEntry> entries, const LensKey& key,
                                      const LensTolerance& tolerance);
  Result<void> Prepare(bool& damaged);
  Result<void> KeepBackup();
  Error Failed(const std::string& what) const;

  std::unique_ptr<Database> database_;
  std::string notice_;
};

}  // namespace plumbline
