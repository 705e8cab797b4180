#include "app/vision/lens_store/lens_row.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "app/base/text/json_text.h"
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

}  // namespace plumbline::vision
