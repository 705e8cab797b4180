// Fuzzer: arbitrary values of any type as a row of the lens store with a valid checksum: rejected,
// or a lens that can be stored, used in a curve and written to a file; and arbitrary bytes as its
// views.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <span>
#include <string>

#include "app/vision/lens_files/opencv_file.h"
#include "app/vision/lens_store/lens_store.h"
#include "app/vision/lens_store/stored_views.h"
#include "firmware-like/lens/lens_curve.h"

namespace {

using namespace plumbline;  // NOLINT(google-build-using-namespace)

void Require(bool condition) {
  if (!condition) std::abort();
}

sqlite::Database Opened(const char* schema) {
  auto database = sqlite::Database::Open(":memory:", sqlite::Database::Mode::kWrite);
  Require(database.ok() && database.value().Run(schema));
  return std::move(database).value();
}

/// Takes values from the front of the input; zeros at its end.
class Values {
 public:
  explicit Values(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  void BindNext(sqlite::Statement& statement, int index) {
    switch (Number<std::uint8_t>() % 4) {
      case 0:
        return statement.Bind(index, std::optional<double>());
      case 1:
        return statement.Bind(index, Number<std::int64_t>());
      case 2:
        return statement.Bind(index, Number<double>());
      default:
        const auto size = std::min<std::size_t>(Number<std::uint16_t>(), rest_.size());
        const std::string text(rest_.begin(), rest_.begin() + static_cast<std::ptrdiff_t>(size));
        rest_ = rest_.subspan(size);
        return statement.Bind(index, text);
    }
  }

 private:
  template <typename T>
  T Number() {
    T value{};
    const std::size_t size = std::min(sizeof value, rest_.size());
    std::memcpy(&value, rest_.data(), size);
    rest_ = rest_.subspan(size);
    return value;
  }
  std::span<const std::uint8_t> rest_;
};

void Judge(const vision::LensEntry& entry) {
  Require(!FaultOf(entry));
  Require(!vision::OpenCvYaml(entry).empty() && !vision::OpenCvXml(entry).empty());
  static sqlite::Database store = Opened(vision::kLensSchema);
  Require(store.Run("BEGIN"));
  {
    sqlite::Statement insert(store.get(), vision::kInsertLens);
    Require(vision::InsertLens(insert, entry));
    sqlite::Statement select(store.get(), vision::kSelectLens);
    Require(select.Step() == SQLITE_ROW);
    const auto again = vision::ReadLensEntry(select);
    Require(again && vision::ChecksumOf(*again) == vision::ChecksumOf(entry));
  }
  Require(store.Run("ROLLBACK"));
  lens::LensNode other{0, entry.lens, entry.covariance};
  other.zoom_counts = entry.key.zoom_counts > 0 ? 0 : 16384;
  const lens::LensCurve curve({{entry.key.zoom_counts, entry.lens, entry.covariance}, other});
  if (const auto at = curve.At(8192)) Require(!std::isnan(at->lens.fx));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static sqlite::Database rows = Opened(
      "CREATE TABLE lens (utc, camera_serial, mode, zoom_counts, focus_counts, width, height, fx,"
      " fy, cx, cy, k1, k2, p1, p2, k3, covariance, rms_px, board, pupil_shift_m, temp_C, corners,"
      " checksum, uncertainty_px, id INTEGER PRIMARY KEY, usable_radius_px, more_distortion,"
      " no_window, fixed_focus)");
  Require(rows.Run("DELETE FROM lens"));
  Values values({data, size});
  sqlite::Statement insert(rows.get(), vision::kInsertLens);
  for (int column = 1; column <= 29; ++column) {
    if (column != 25) values.BindNext(insert, column);  // the id is assigned
  }
  Require(insert.Run());
  sqlite::Statement select(rows.get(), vision::kSelectLens);
  Require(select.Step() == SQLITE_ROW);
  const auto views = vision::DecodeViews({data, size});
  if (views) Require(vision::DecodeViews(vision::EncodeViews(*views)).ok());
  if (const auto entry = vision::ReadLensEntry(select)) Judge(*entry);
  if (const auto entry = vision::ReadLensValues(select)) Judge(*entry);
  return 0;
}
