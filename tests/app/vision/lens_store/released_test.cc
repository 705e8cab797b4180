// Lens stores of every released schema read by the current code: every lens under its id.
#include "tests/app/released.h"

#include <catch2/catch.hpp>
#include <filesystem>
#include <string>

#include "app/vision/lens_store/lens_row.h"
#include "app/vision/lens_store/lens_store.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::released_test {

using namespace plumbline::vision;
using namespace plumbline::test;

namespace {

void CheckLens(const LensEntry& entry, int number, int schema) {
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
  CHECK(entry.pupil_shift_m.has_value() ==
        (number == 2));  // schema 1 stored 0, which was not measured
  if (number == 2) CHECK(entry.pupil_shift_m == 0.0021);
  CHECK(entry.temp_C.has_value() == (number == 2));
  CHECK(entry.uncertainty_px.has_value() == (schema >= 2));
  const bool declared = schema >= 4 && number == 1;
  CHECK(entry.declared == target::DeclaredFacts{.no_window = declared, .fixed_focus = false});
  CHECK(entry.corners == std::vector<std::uint8_t>{0, 1, 255, static_cast<std::uint8_t>(number)});
}

LensStore OpenedStore(const std::string& path) {
  auto store = LensStore::Open(path);
  if (!store) FAIL(store.error());
  return std::move(store).value();
}

}  // namespace

TEST_CASE("a lens store of every released schema opens, loses nothing, and accepts new lenses") {
  for (int schema = 1; schema <= kLensSchemaVersion; ++schema) {
    CAPTURE(schema);
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/lenses.sqlite";
    WriteReleased("lens_store", schema, path);
    const auto early = LensStore::OpenForReading(path);
    CHECK(early.ok() == (schema == kLensSchemaVersion));
    if (!early) CHECK_THAT(early.error(), Catch::Contains("written by an older plumbline"));
    for (int opening = 1; opening <= 2; ++opening) {
      LensStore store = OpenedStore(path);
      CHECK(store.notice().empty());
      const auto lenses = store.All();
      REQUIRE(lenses);
      REQUIRE(lenses->size() == 2);
      CheckLens((*lenses)[0], 1, schema);
      CheckLens((*lenses)[1], 2, schema);
    }
    {
      auto direct = sqlite::Database::Open(path, sqlite::Database::Mode::kWrite);
      CHECK(*direct.value().IntegerOf("PRAGMA user_version") == kLensSchemaVersion);
      CHECK(*direct.value().IntegerOf("SELECT count(*) FROM sqlite_master WHERE name LIKE '%_1'") ==
            0);
      CHECK_FALSE(direct.value().Run("DELETE FROM lens"));
    }
    LensStore store = OpenedStore(path);
    LensEntry next = (*store.All())[0];
    CHECK(*store.Append(next) == 3);
    CHECK(LensStore::OpenForReading(path).ok());
  }
}

TEST_CASE("a schema 1 lens that fails its checksum is not migrated; the backup is used") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/lenses.sqlite";
  WriteReleased("lens_store", 1, path);
  {
    auto database = sqlite::Database::Open(path, sqlite::Database::Mode::kWrite);
    REQUIRE(database.value().Run(
        "DROP TRIGGER lens_is_not_changed; UPDATE lens SET zoom_counts = 1001 WHERE id = 1;"
        "CREATE TRIGGER lens_is_not_changed BEFORE UPDATE ON lens"
        " BEGIN SELECT RAISE(ABORT, 'lenses are never changed'); END;"));
  }
  const auto refused = LensStore::Open(path);
  REQUIRE_FALSE(refused.ok());
  CHECK_THAT(refused.error(),
             Catch::Contains("lens 1 fails its checksum") && Catch::Contains("there is no backup"));
  WriteReleased("lens_store", 1, path + ".backup");
  const LensStore rescued = OpenedStore(path);
  CHECK_THAT(rescued.notice(), Catch::Contains("backup with 2 lenses"));
  CHECK(std::filesystem::exists(path + ".damaged-1"));  // kept aside
}

TEST_CASE("a lens store of a newer version is refused with advice and left untouched") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/lenses.sqlite";
  WriteReleased("lens_store", kLensSchemaVersion, path);
  MakeNewer(path, kLensSchemaVersion + 1);
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
