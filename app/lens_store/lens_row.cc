#include "app/lens_store/lens_row.h"

#include <fmt/format.h>

#include <limits>
#include <string>

#include "app/text/json_text.h"
#include "firmware-like/lens/lens_curve.h"

namespace plumbline::lens_store {
namespace {

constexpr std::size_t kCovarianceNumbers = 81;  // kLensParameters squared

/// Out-of-range values become one that FaultOf() or the checksum rejects.
std::int32_t ToInt32(std::int64_t value) {
  constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max();
  return static_cast<std::int32_t>(value > kMost || value < -kMost ? -kMost - 1 : value);
}

/// Schema 1 in the columns of kSelectLens.
constexpr const char* kSelectSchema1 =
    "SELECT utc, camera_serial, mode, zoom_counts, focus_counts, width, height, fx, fy, cx, cy, k1,"
    " k2, p1, p2, k3, covariance, rms_px, board, nullif(pupil_shift_m, 0), temp_C, corners,"
    " checksum, id, NULL FROM lens_of_schema_1 ORDER BY id";

constexpr const char* kRenameSchema1 = R"(
DROP TRIGGER lens_is_not_changed;
DROP TRIGGER lens_is_not_removed;
DROP INDEX lens_of_camera;
ALTER TABLE lens RENAME TO lens_of_schema_1;
)";

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
  covariance TEXT NOT NULL,  -- 81 numbers, order fx, fy, cx, cy, k1, k2, p1, p2, k3
  rms_px REAL NOT NULL, board TEXT NOT NULL, pupil_shift_m REAL, temp_C REAL,
  corners BLOB NOT NULL, checksum INTEGER NOT NULL,
  uncertainty_px REAL  -- of the projection at its worst place, one standard deviation
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
    " checksum, uncertainty_px, id) VALUES"
    " (?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)";

const char* const kSelectLens =
    "SELECT utc, camera_serial, mode, zoom_counts, focus_counts, width, height, fx, fy, cx, cy, k1,"
    " k2, p1, p2, k3, covariance, rms_px, board, pupil_shift_m, temp_C, corners, checksum, id,"
    " uncertainty_px FROM lens";

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
  for (int k = 0; k < lens::kLensParameters; ++k) statement.Bind(8 + k, values[k]);
  nlohmann::json covariance = nlohmann::json::array();
  for (const double value : entry.covariance.reshaped<Eigen::RowMajor>()) {
    covariance.push_back(value);
  }
  statement.Bind(17, text::JsonText(covariance));
  statement.Bind(18, entry.rms_px);
  statement.Bind(19, entry.board);
  statement.Bind(20, entry.pupil_shift_m);
  statement.Bind(21, entry.temp_C);
  statement.BindBlob(22, entry.corners);
  statement.Bind(23, static_cast<std::int64_t>(ChecksumOf(entry)));
  statement.Bind(24, entry.uncertainty_px);
  statement.Bind(25, entry.id > 0 ? std::optional(entry.id) : std::nullopt);
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
  lens::LensVector values;
  for (int k = 0; k < lens::kLensParameters; ++k) values[k] = row.Number(7 + k);
  entry.lens = lens::LensOfVector(values);
  const nlohmann::json covariance = text::JsonOrNull(row.Text(16));
  if (!covariance.is_array() || covariance.size() != kCovarianceNumbers) return std::nullopt;
  std::size_t at = 0;
  for (int i = 0; i < lens::kLensParameters; ++i) {
    for (int k = 0; k < lens::kLensParameters; ++k) {
      const auto& number = covariance[at++];
      if (!number.is_number()) return std::nullopt;
      entry.covariance(i, k) = number.get<double>();
    }
  }
  entry.rms_px = row.Number(17);
  entry.board = row.Text(18);
  entry.pupil_shift_m = row.OptionalNumberAt(19);
  entry.temp_C = row.OptionalNumberAt(20);
  const std::string corners = row.Text(21);
  entry.corners.assign(corners.begin(), corners.end());
  entry.uncertainty_px = row.OptionalNumberAt(24);
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

Result<void> MigrateLensSchema(sqlite::Database& database, std::int64_t version, bool& damaged) {
  if (version != 1) return {};
  const auto failed = [&database] {
    return Error{database.path() + ": cannot be migrated to this schema: " + database.Problem()};
  };
  if (!database.Run(kRenameSchema1) || !database.Run(kLensSchema)) return failed();
  {
    sqlite::Statement rows(database.get(), kSelectSchema1), insert(database.get(), kInsertLens);
    int code = SQLITE_ROW;
    while ((code = rows.Step()) == SQLITE_ROW) {
      const auto entry = ReadLensValues(rows);
      if (!entry || static_cast<std::uint64_t>(rows.Integer(22)) != ChecksumOfSchema1(*entry)) {
        damaged = true;
        return Error{fmt::format("{}: lens {} fails its checksum", database.path(), RowId(rows))};
      }
      if (!InsertLens(insert, *entry)) return failed();
    }
    if (code != SQLITE_DONE) return failed();
  }
  const std::string finish =
      fmt::format("DROP TABLE lens_of_schema_1; PRAGMA user_version={}", kLensSchemaVersion);
  if (!database.Run(finish.c_str())) return failed();
  return {};
}

}  // namespace plumbline::lens_store
