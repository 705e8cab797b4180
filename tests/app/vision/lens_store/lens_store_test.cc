#include "app/vision/lens_store/lens_store.h"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "app/vision/lens_files/opencv_file.h"
#include "firmware-like/lens/lens_curve.h"
#include "tests/app/temporary_folder.h"
#include "tests/file_text.h"

namespace plumbline::lens_store_test {

using namespace plumbline::vision;

namespace {

using test::TemporaryFolder;

LensEntry EntryAt(std::int32_t zoom_counts, double fx) {
  LensEntry entry;
  entry.key = {"SN-1", "YUYV 1920x1080@30", zoom_counts, 0x1234};
  entry.lens = {fx, 1.001 * fx, 959.25, 540.1, -0.123456789012345678, 0.05, 1e-5, -2e-5, 0.1 / 3};
  const lens::LensVector sd = 1e-3 * lens::VectorOfLens(entry.lens);
  entry.covariance = sd * sd.transpose();
  entry.size = {1920, 1080};
  entry.rms_px = 0.04;
  entry.board = "chessboard 18x12, 10 mm";
  entry.pupil_shift_m = 0.0021;
  entry.temp_C = 23.5;
  entry.uncertainty_px = 0.31;
  entry.utc = "2026-11-21T07:30:00Z";
  entry.corners = {0, 1, 255, 0};
  return entry;
}

LensStore Opened(const std::string& path) {
  auto store = LensStore::Open(path);
  if (!store) FAIL(store.error());
  return std::move(store).value();
}

void Keep(LensStore& store, const LensEntry& entry) {
  const auto id = store.Append(entry);
  if (!id) FAIL(id.error());
  CHECK(store.notice().empty());
}

/// Flips bytes of each occurrence of a text in the file.
int Damage(const std::string& path, const std::string& text) {
  std::string content = test::FileText(path);
  int places = 0;
  for (std::size_t at = 0; (at = content.find(text, at)) != std::string::npos; ++at) {
    content[at] = static_cast<char>(content[at] + 1);
    ++places;
  }
  std::ofstream(path, std::ios::binary) << content;
  return places;
}

}  // namespace

TEST_CASE("an entry is read back bit-exactly") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/lenses.sqlite";
  const LensEntry kept = EntryAt(0x1606, 1700.1234567890123);
  LensEntry bare = EntryAt(0x2000, 2000);
  bare.key.focus_counts.reset();
  bare.temp_C.reset();
  bare.pupil_shift_m.reset();
  bare.uncertainty_px.reset();
  bare.corners.clear();
  {
    LensStore store = Opened(path);
    Keep(store, kept);
    Keep(store, bare);
  }
  LensStore store = Opened(path);
  CHECK(store.notice().empty());
  const auto entries = store.All();
  REQUIRE(entries);
  REQUIRE(entries->size() == 2);
  const LensEntry& found = (*entries)[0];
  CHECK(ChecksumOf(found) == ChecksumOf(kept));
  CHECK(lens::VectorOfLens(found.lens) == lens::VectorOfLens(kept.lens));
  CHECK(found.covariance == kept.covariance);
  CHECK(found.corners == kept.corners);
  CHECK(found.board == kept.board);
  CHECK(found.temp_C == 23.5);
  CHECK(found.pupil_shift_m == 0.0021);
  CHECK(found.uncertainty_px == 0.31);
  CHECK(found.key.focus_counts == 0x1234);
  CHECK_FALSE((*entries)[1].key.focus_counts);
  CHECK_FALSE((*entries)[1].temp_C);
  CHECK_FALSE((*entries)[1].pupil_shift_m);
  CHECK_FALSE((*entries)[1].uncertainty_px);
  CHECK((*entries)[1].id > found.id);
}

TEST_CASE("an invalid entry is refused with the reason, and nothing is written") {
  const TemporaryFolder folder;
  LensStore store = Opened(folder.path() + "/lenses.sqlite");
  struct Case {
    void (*spoil)(LensEntry&);
    const char* reason;
  };
  const Case cases[] = {
      {[](LensEntry& e) { e.lens.k1 = std::nan(""); }, "not finite"},
      {[](LensEntry& e) { e.lens.fy = 0; }, "focal length is not positive"},
      {[](LensEntry& e) { e.covariance(2, 3) = INFINITY; }, "covariance is not finite"},
      {[](LensEntry& e) { e.covariance(2, 2) = -1; }, "variance is negative"},
      {[](LensEntry& e) { e.covariance(0, 1) *= 1.1; }, "not symmetric"},
      {[](LensEntry& e) { e.size.height = 0; }, "image size"},
      {[](LensEntry& e) { e.rms_px = std::nan(""); }, "RMS"},
      {[](LensEntry& e) { e.uncertainty_px = INFINITY; }, "uncertainty"},
      {[](LensEntry& e) { e.key.camera_serial.clear(); }, "no camera serial"},
      {[](LensEntry& e) { e.key.mode.clear(); }, "no mode"},
      {[](LensEntry& e) { e.utc.clear(); }, "no date"},
  };
  for (const Case& c : cases) {
    LensEntry entry = EntryAt(1, 1000);
    c.spoil(entry);
    const auto id = store.Append(entry);
    REQUIRE_FALSE(id.ok());
    CHECK_THAT(id.error(), Catch::Contains(c.reason));
  }
  CHECK(*store.Count() == 0);
}

TEST_CASE("the file itself refuses to change or remove a lens") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/lenses.sqlite";
  LensStore store = Opened(path);
  Keep(store, EntryAt(1, 1000));
  auto database = sqlite::Database::Open(path, sqlite::Database::Mode::kWrite);
  REQUIRE(database);
  CHECK_FALSE(database.value().Run("UPDATE lens SET fx = 1"));
  CHECK_FALSE(database.value().Run("DELETE FROM lens"));
  CHECK(*store.Count() == 1);
}

TEST_CASE("Find: newest entry of the zoom, else the curve, else nothing") {
  const TemporaryFolder folder;
  LensStore store = Opened(folder.path() + "/lenses.sqlite");
  const LensTolerance tolerance{2, 4};
  const LensKey key = EntryAt(1000, 1).key;
  CHECK_FALSE(*store.Find(key, tolerance));
  Keep(store, EntryAt(1000, 1500));
  {
    const auto only = *store.Find(key, tolerance);
    REQUIRE(only);
    CHECK(only->entry.lens.fx == 1500);
    CHECK_FALSE(only->log_focal_per_count);
  }
  Keep(store, EntryAt(1001, 1510));  // the same zoom, calibrated again
  for (const auto& [counts, fx] :
       {std::pair{0, 1000.0}, {2000, 2300.0}, {3000, 3600.0}, {4000, 5200.0}}) {
    Keep(store, EntryAt(counts, fx));
  }
  const auto again = *store.Find(key, tolerance);
  REQUIRE(again);
  CHECK(again->how == LensFound::How::kCalibrated);
  CHECK(again->entry.lens.fx == 1510);
  CHECK(again->log_focal_sd == Approx(1e-3));
  CHECK(*again->log_focal_per_count == Approx(4e-4).epsilon(0.3));

  LensKey between = key;
  between.zoom_counts = 2500;
  const auto curve = *store.Find(between, tolerance);
  REQUIRE(curve);
  CHECK(curve->how == LensFound::How::kInterpolated);
  CHECK(curve->entry.lens.fx > 2300);
  CHECK(curve->entry.lens.fx < 3600);
  CHECK(curve->entry.key.zoom_counts == 2500);
  CHECK(curve->log_focal_sd > 1e-3);
  CHECK(std::sqrt(curve->entry.covariance(0, 0)) / curve->entry.lens.fx ==
        Approx(curve->log_focal_sd));

  LensKey elsewhere = key;
  elsewhere.zoom_counts = 4003;
  CHECK_FALSE(*store.Find(elsewhere, tolerance));
  elsewhere = key;
  elsewhere.mode = "GREY";
  CHECK_FALSE(*store.Find(elsewhere, tolerance));
  elsewhere = key;
  elsewhere.focus_counts = 0x1234 + 5;
  CHECK_FALSE(*store.Find(elsewhere, tolerance));
  elsewhere.focus_counts = 0x1234 + 4;
  CHECK(*store.Find(elsewhere, tolerance));
  elsewhere.focus_counts.reset();
  CHECK(*store.Find(elsewhere, tolerance));
}

TEST_CASE("a lens is not used once a declaration on which it rests is withdrawn") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/lenses.sqlite";
  const LensTolerance tolerance{2, 4};
  const LensKey key = EntryAt(1000, 1).key;
  const target::DeclaredFacts no_window{.no_window = true, .fixed_focus = false};
  const target::DeclaredFacts both{.no_window = true, .fixed_focus = true};
  const auto keep = [&](double fx, const target::DeclaredFacts& declared) {
    LensStore store = Opened(path);
    LensEntry entry = EntryAt(1000, fx);
    entry.declared = declared;
    Keep(store, entry);
  };
  keep(1520, both);
  LensStore store = Opened(path);
  REQUIRE((*store.All())[0].declared == both);
  CHECK((*store.Find(key, tolerance, both))->entry.lens.fx == 1520);
  CHECK_FALSE(*store.Find(key, tolerance, no_window));
  CHECK_FALSE(*store.Find(key, tolerance));
  CHECK((*store.Withheld(key, tolerance, no_window))->id == 1);
  CHECK_FALSE(*store.Withheld(key, tolerance, both));
  // One that rests on less is used instead, although it is older than another.
  keep(1500, {});
  keep(1510, no_window);
  CHECK((*store.Find(key, tolerance))->entry.lens.fx == 1500);
  CHECK((*store.Find(key, tolerance, no_window))->entry.lens.fx == 1510);
  CHECK((*store.Find(key, tolerance, both))->entry.lens.fx == 1510);
  LensKey elsewhere = key;
  elsewhere.zoom_counts = 2000;
  CHECK_FALSE(*store.Withheld(elsewhere, tolerance, {}));
}

TEST_CASE("a damaged declaration is found by the checksum") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/lenses.sqlite";
  {
    LensStore store = Opened(path);
    LensEntry entry = EntryAt(1000, 1500);
    entry.declared.no_window = true;
    Keep(store, entry);
  }
  for (const char* change : {"no_window = 0", "no_window = 2", "fixed_focus = 1"}) {
    CAPTURE(change);
    {
      auto database = sqlite::Database::Open(path, sqlite::Database::Mode::kWrite);
      REQUIRE(database.value().Run("DROP TRIGGER lens_is_not_changed"));
      REQUIRE(database.value().Run(fmt::format("UPDATE lens SET {}", change).c_str()));
    }
    const LensStore restored = Opened(path);
    CHECK_THAT(restored.notice(), Catch::Contains("fails its checksum"));
  }
}

TEST_CASE("a damaged file is moved aside and replaced by the backup with every lens") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/lenses.sqlite";
  struct Case {
    const char* what;
    void (*damage)(const std::string&);
    const char* notice;
  };
  const Case cases[] = {
      {"no database", [](const std::string& p) { std::ofstream(p) << std::string(5000, 'x'); },
       "not a database"},
      {"cut short", [](const std::string& p) { std::filesystem::resize_file(p, 6000); }, ""},
      {"one lens changed", [](const std::string& p) { REQUIRE(Damage(p, "chessboard 18x12") > 0); },
       "fails its checksum"},
      {"a write version that SQLite does not know",
       [](const std::string& p) {
         std::fstream file(p, std::ios::in | std::ios::out | std::ios::binary);
         file.seekp(18);  // of the header
         file.put('\x9a');
       },
       "its header makes it read-only"},
  };
  int expected = 0;
  for (const Case& c : cases) {
    CAPTURE(c.what);
    {
      LensStore store = Opened(path);
      Keep(store, EntryAt(1000 * expected, 1000 + expected));
      ++expected;
    }
    REQUIRE_FALSE(std::filesystem::exists(path + "-wal"));  // all is in the one file
    c.damage(path);
    LensStore store = Opened(path);
    CHECK_THAT(store.notice(), Catch::Contains(c.notice));
    CHECK_THAT(store.notice(), Catch::Contains("backup with " + std::to_string(expected)));
    CHECK_THAT(store.notice(), Catch::Contains(".damaged-" + std::to_string(expected)));
    CHECK(std::filesystem::exists(path + ".damaged-" + std::to_string(expected)));
    CHECK(*store.Count() == expected);
    CHECK(Opened(path).notice().empty());
  }
}

TEST_CASE("bytes changed anywhere: every lens is unchanged or recovered from the backup") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/lenses.sqlite";
  std::vector<std::uint64_t> checksums;
  {
    LensStore store = Opened(path);
    for (int i = 0; i < 8; ++i) {
      Keep(store, EntryAt(1000 * i, 1000 + i));
      checksums.push_back(ChecksumOf(EntryAt(1000 * i, 1000 + i)));
    }
  }
  const std::string good = test::FileText(path), backup = test::FileText(path + ".backup");
  std::mt19937 random(5);
  int restored = 0, refused = 0;
  for (int run = 0; run < 300; ++run) {
    std::string content = good;
    const std::size_t flips = 1 + random() % 20;
    for (std::size_t i = 0; i < flips; ++i) {
      content[random() % content.size()] = static_cast<char>(random());
    }
    std::ofstream(path, std::ios::binary) << content;
    std::ofstream(path + ".backup", std::ios::binary) << backup;
    auto store = LensStore::Open(path);
    if (!store) {  // its marks were hit, so that it is not known to be ours: a person must look
      ++refused;
      CHECK(test::FileText(path + ".backup") == backup);
    } else {
      restored += store.value().notice().empty() ? 0 : 1;
      const auto entries = store.value().All();
      REQUIRE(entries);
      REQUIRE(entries->size() == checksums.size());
      for (std::size_t i = 0; i < checksums.size(); ++i) {
        REQUIRE(ChecksumOf((*entries)[i]) == checksums[i]);
      }
    }
    for (const auto& file : std::filesystem::directory_iterator(folder.path())) {
      std::filesystem::remove(file.path());
    }
  }
  CAPTURE(restored, refused);
  CHECK(restored > 100);
  CHECK(refused < 20);
}

TEST_CASE("damaged without an intact backup, or not a lens store: nothing is touched") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/lenses.sqlite";
  std::ofstream(path) << std::string(5000, 'x');
  const auto none = LensStore::Open(path);
  REQUIRE_FALSE(none.ok());
  CHECK_THAT(none.error(), Catch::Contains("there is no backup"));
  std::ofstream(path + ".backup") << std::string(5000, 'y');
  const auto both = LensStore::Open(path);
  REQUIRE_FALSE(both.ok());
  CHECK_THAT(both.error(), Catch::Contains("and the backup"));
  CHECK(test::FileText(path) == std::string(5000, 'x'));

  const std::string other = folder.path() + "/other.sqlite";
  {
    auto database = sqlite::Database::Open(other, sqlite::Database::Mode::kWrite);
    REQUIRE(database);
    REQUIRE(database.value().Run("CREATE TABLE t (x)"));
  }
  const auto wrong = LensStore::Open(other);
  REQUIRE_FALSE(wrong.ok());
  CHECK_THAT(wrong.error(), Catch::Contains("not a plumbline lens store"));

  const std::string newer = folder.path() + "/newer.sqlite";
  Opened(newer);
  {
    auto database = sqlite::Database::Open(newer, sqlite::Database::Mode::kWrite);
    REQUIRE(database);
    REQUIRE(database.value().Run(
        fmt::format("PRAGMA user_version={}", kLensSchemaVersion + 1).c_str()));
  }
  const auto future = LensStore::Open(newer);
  REQUIRE_FALSE(future.ok());
  CHECK_THAT(future.error(), Catch::Contains("newer plumbline"));
  CHECK_FALSE(LensStore::Open(folder.path() + "/none/lenses.sqlite").ok());
}

TEST_CASE("a lens of any distortion model is stored with its usable region") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/lenses.sqlite";
  LensEntry fisheye = EntryAt(1000, 1500);
  fisheye.lens.fisheye = true;
  fisheye.lens.p1 = fisheye.lens.p2 = 0;
  fisheye.lens.k4 = 0.02;
  fisheye.usable_radius_px = 640.5;
  LensEntry prism = EntryAt(2000, 3000);
  prism.lens.k4 = 0.1, prism.lens.s2 = -0.01, prism.lens.s4 = 0.003;
  for (LensEntry* entry : {&fisheye, &prism}) {
    const lens::LensVector sd = 1e-3 * lens::VectorOfLens(entry->lens);
    entry->covariance = sd * sd.transpose();
  }
  {
    LensStore store = Opened(path);
    Keep(store, fisheye);
    Keep(store, prism);
  }
  LensStore store = Opened(path);
  const auto entries = store.All();
  REQUIRE(entries);
  REQUIRE(entries->size() == 2);
  for (std::size_t k = 0; k < 2; ++k) {
    const LensEntry &kept = k == 0 ? fisheye : prism, &found = (*entries)[k];
    CHECK(lens::VectorOfLens(found.lens) == lens::VectorOfLens(kept.lens));
    CHECK(found.lens.fisheye == kept.lens.fisheye);
    CHECK(found.covariance == kept.covariance);
    CHECK(found.usable_radius_px == kept.usable_radius_px);
  }
  // Nothing is interpolated between the coefficients of different models.
  CHECK_FALSE(*store.Find({"SN-1", "YUYV 1920x1080@30", 1500, 0x1234}, {}));
}

TEST_CASE("a lens is stored even if the backup fails, and that is reported") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/lenses.sqlite";
  LensStore store = Opened(path);
  std::filesystem::create_directories(path + ".backup.new/in the way");
  CHECK(store.Append(EntryAt(1, 1000)).ok());
  CHECK_THAT(store.notice(), Catch::Contains("backup failed"));
  CHECK(*store.Count() == 1);
  std::filesystem::remove_all(path + ".backup.new");
  Keep(store, EntryAt(2, 1000));
}

}  // namespace plumbline::lens_store_test
