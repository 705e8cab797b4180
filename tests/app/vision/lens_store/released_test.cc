// The lens store as version 0.1.0 writes it, read by the present code: every lens under its id.
#include "tests/app/released.h"

#include <catch2/catch.hpp>
#include <filesystem>
#include <string>

#include "app/vision/lens_store/lens_store.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::released_test {

using namespace plumbline::vision;
using namespace plumbline::test;

namespace {

void CheckLens(const LensEntry& entry, int number) {
  CAPTURE(number);
  CHECK(entry.id == number);
  CHECK(entry.utc == (number == 1 ? "2026-11-21T07:30:00Z" : "2026-11-21T08:30:00Z"));
  CHECK(entry.key.camera_serial == "SN-1");
  CHECK(entry.key.mode == "YUYV 1920x1080@30");
  CHECK(entry.key.zoom_counts == 1000 * number);
  CHECK(entry.key.focus_counts.has_value() == (number == 1));
  CHECK(entry.size.width == 1920);
  CHECK(entry.size.height == 1080);
  CHECK(entry.lens.fx == 1500.25 * number);
  CHECK(entry.lens.fy == 1501.5 * number);
  CHECK(entry.lens.cx == 959.25);
  CHECK(entry.lens.k3 == 0.1 / 3);  // to the last bit
  CHECK(entry.covariance(0, 1) == 0.25);
  CHECK(entry.covariance(8, 8) == 1.0 / 256);
  CHECK(entry.rms_px == 0.04);
  CHECK(entry.board == "chessboard 18x12, 10 mm");
  CHECK(entry.pupil_shift_m.has_value() == (number == 2));
  if (number == 2) CHECK(entry.pupil_shift_m == 0.0021);
  CHECK(entry.temp_C.has_value() == (number == 2));
  CHECK(entry.uncertainty_px.has_value());
  const bool declared = number == 1;
  CHECK(entry.declared == target::DeclaredFacts{.no_window = declared, .fixed_focus = false});
  CHECK(entry.corners == std::vector<std::uint8_t>{0, 1, 255, static_cast<std::uint8_t>(number)});
}

LensStore OpenedStore(const std::string& path) {
  auto store = LensStore::Open(path);
  if (!store) FAIL(store.error());
  return std::move(store).value();
}

}  // namespace

TEST_CASE("the lens store of version 0.1.0 opens, loses nothing, and accepts new lenses") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/lenses.sqlite";
  WriteReleased("vision/lens_store", kLensSchemaVersion, path);
  CHECK(LensStore::OpenForReading(path).ok());
  LensStore store = OpenedStore(path);
  CHECK(store.notice().empty());
  const auto lenses = store.All();
  REQUIRE(lenses);
  REQUIRE(lenses->size() == 2);
  CheckLens((*lenses)[0], 1);
  CheckLens((*lenses)[1], 2);
  CHECK(*store.Append((*lenses)[0]) == 3);
}

TEST_CASE("a lens store of a development version is refused with advice and left untouched") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/lenses.sqlite";
  WriteReleased("vision/lens_store", kLensSchemaVersion, path);
  SetSchema(path, kLensSchemaVersion - 1);
  const std::string before = FileText(path);
  for (const auto open : {&LensStore::Open, &LensStore::OpenForReading}) {
    const auto store = open(path);
    REQUIRE_FALSE(store);
    CHECK_THAT(store.error(),
               Catch::Contains("before 0.1.0") && Catch::Contains("move the file away"));
  }
  CHECK(FileText(path) == before);
}

TEST_CASE("a lens store of a newer version is refused with advice and left untouched") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/lenses.sqlite";
  WriteReleased("vision/lens_store", kLensSchemaVersion, path);
  SetSchema(path, kLensSchemaVersion + 1);
  const std::string before = FileText(path);
  for (const auto open : {&LensStore::Open, &LensStore::OpenForReading}) {
    const auto store = open(path);
    REQUIRE_FALSE(store);
    CHECK_THAT(store.error(), Catch::Contains("written by a newer plumbline") &&
                                  Catch::Contains("install that version again"));
  }
  CHECK(FileText(path) == before);
}

}  // namespace plumbline::released_test
