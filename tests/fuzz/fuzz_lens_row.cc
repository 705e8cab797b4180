// Fuzzer: arbitrary values of any type as a row of the lens store with a valid checksum: rejected,
// or a lens that can be stored, used in a curve and written to a file; and arbitrary bytes as its
// views.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <span>
#include <string>

#include "app/lens_store/lens_row.h"
#include "app/lens_store/opencv_file.h"
#include "app/lens_store/stored_views.h"
#include "firmware-like/lens/lens_curve.h"

namespace {

using namespace plumbline;  // NOLINT(google-build-using-namespace)

void Require(bool condition) {
  if (!condition) std::abort();
}

Database Opened(const char* schema) {
  auto database = Database::Open(":memory:", Database::Mode::kWrite);
  Require(database.ok() && database.value().Run(schema));
  return std::move(database).value();
}

/// Takes values from the front of the input; zeros at its end.
class Values {
 public:
  explicit Values(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  void BindNext(Statement& statement, int index) {
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

void Judge(const LensEntry& entry) {
  Require(!FaultOf(entry));
  Require(!OpenCvYaml(entry).empty() && !OpenCvXml(entry).empty());
  static Database store = Opened(kLensSchema);
  Require(store.Run("BEGIN"));
  {
    Statement insert(store.get(), kInsertLens);
    Require(InsertLens(insert, entry));
    Statement select(store.get(), kSelectLens);
    Require(select.Step() == SQLITE_ROW);
    const auto again = ReadLensEntry(select);
    Require(again && ChecksumOf(*again) == ChecksumOf(entry));
  }
  Require(store.Run("ROLLBACK"));
  LensNode other{0, entry.lens, entry.covariance};
  other.zoom_counts = entry.key.zoom_counts > 0 ? 0 : 16384;
  const LensCurve curve({{entry.key.zoom_counts, entry.lens, entry.covariance}, other});
  if (const auto at = curve.At(8192)) Require(!std::isnan(at->lens.fx));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Database rows = Opened(
      "CREATE TABLE lens (utc, camera_serial, mode, zoom_counts, focus_counts, width, height, fx,"
      " fy, cx, cy, k1, k2, p1, p2, k3, covariance, rms_px, board, pupil_shift_m, temp_C, corners,"
      " checksum, uncertainty_px, id INTEGER PRIMARY KEY)");
  Require(rows.Run("DELETE FROM lens"));
  Values values({data, size});
  Statement insert(rows.get(), kInsertLens);
  for (int column = 1; column <= 24; ++column) values.BindNext(insert, column);
  Require(insert.Run());
  Statement select(rows.get(), kSelectLens);
  Require(select.Step() == SQLITE_ROW);
  const auto views = DecodeViews({data, size});
  if (views) Require(DecodeViews(EncodeViews(*views)).ok());
  if (const auto entry = ReadLensEntry(select)) Judge(*entry);
  if (const auto entry = ReadLensValues(select)) Judge(*entry);
  return 0;
}
