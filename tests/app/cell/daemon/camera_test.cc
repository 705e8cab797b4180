// The camera's side of the real daemon: a recorded camera whose image the test replaces, a zoom
// sensor at a pseudo-terminal or played from a table, a Modbus client as the PLC.
#include <catch2/catch.hpp>
#include <cstdio>
#include <fstream>
#include <functional>

#include "app/vision/lens/calibration.h"
#include "app/vision/lens_store/lens_store.h"
#include "app/vision/lens_store/stored_views.h"
#include "tests/app/cell/daemon/camera_cell.h"
#include "tests/app/cell/daemon/daemon_process.h"
#include "tests/app/cell/daemon/demo_config.h"
#include "tests/app/cell/daemon/status_command_output.h"
#include "tests/app/cell/view_link/watched_display.h"
#include "tests/drivers/zoom/fake_visca_camera.h"

namespace plumbline::camera_test {

using namespace plumbline::test;
using virtual_cell::Eventually;
using virtual_cell::RegisterClient;
using virtual_cell::RunningCell;

namespace {

std::string ConfigText(const std::string& robot, const std::string& folder, const std::string& zoom,
                       const std::string& board, const std::string& camera) {
  std::ofstream(folder + "/bodies.toml") << TagsText();
  return WithLine(DemoConfig(robot, "universal-robots-fine"), "", "state_directory",
                  "\"" + folder + "/state\"") +
         "\n[monitoring]\nenabled = true\nreference_probes = 0\ndiagnose = false\n"
         "[camera]\nkind = \"recorded\"\npath = \"" +
         folder +
         "/frames\"\nrepeat = true\n"
         "serial = \"test camera\"\nmode = \"test mode\"\nrate_hz = 20.0\n" +
         camera + "[zoom]\nlost_after_ms = 5000\n" + zoom + "[board]\n" + board +
         TagsTable(folder + "/bodies.toml");
}

/// Usable radius of the second lens; it contains all tags.
constexpr double kUsable_px = 1000.5;

struct Station {
  TemporaryFolder folder;
  ShownImage image{folder.path()};
  std::atomic<int> zoom{kKnown};
  std::atomic<bool> moving{false};
  FakeViscaCamera visca{CameraAnswers([this] { return BlockOf(zoom, 0, false, moving); })};
  RunningCell cell{Idle()};
  std::optional<DaemonProcess> daemon;
  std::optional<RegisterClient> plc;
  std::uint16_t sequence = 100;

  /// @param before  what is done to the lens store before the daemon starts
  /// @param camera  further lines of [camera]
  explicit Station(const std::string& replay = "", const std::string& board = "",
                   const std::function<void(const std::string& store)>& before = {},
                   const std::string& camera = "") {
    KeepLenses(folder.path() + "/state", "test camera", kUsable_px);
    if (before) before(Store());
    ShowCell();
    std::ofstream(folder.path() + "/zoom.csv") << replay;
    const std::string sensor =
        replay.empty() ? "kind = \"visca\"\ndevice = \"" + visca.device() + "\"\n"
                       : "kind = \"replay\"\nfile = \"" + folder.path() + "/zoom.csv\"\n";
    daemon.emplace(ConfigText(cell.robot(), folder.path(), sensor, board, camera));
    plc.emplace("plumblined", daemon->Plc(), 1, 10);
  }
  std::string Store() const { return folder.path() + "/state/lenses.sqlite"; }
  void ShowCell() const { image.Show(DrawCell(CameraAt(zoom), CellInCamera(), GripperInCamera())); }
  void ZoomTo(int counts) {
    zoom = counts;
    ShowCell();
  }
  int State() { return plc->Read(500, 24).Word(0); }
  int Bits() { return plc->Read(500, 24).Word(2); }
  std::uint32_t Lens() { return plc->Read(500, 24).Long(10); }
  bool Becomes(int state) {
    return Eventually([&] { return State() == state; });
  }
  int Command(int code) { return test::Command(*plc, ++sequence, code); }
  /// Somebody who follows the outlines on the display, until the lens is valid.
  void ShowBoard(const renderer::Camera& camera, const target::Board& board) {
    WatchedDisplay display(folder.path() + "/state");
    GuidedPerson person(camera, board);
    while (person.images() < 80 && State() != 4) {
      const int kept = plc->Read(504, 1).Word(0);
      image.Show(person.Next(display.Outline()));
      // Until this view is kept; one that is not is followed by another.
      const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(2);
      while (std::chrono::steady_clock::now() < give_up && State() != 4 &&
             plc->Read(504, 1).Word(0) == kept) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
      }
    }
  }
  std::vector<cell::JournalRow> Journal() const { return test::JournalOf(folder); }
};

}  // namespace

TEST_CASE("a zoom change: stale, then the known lens, and work goes on by itself") {
  Station station;
  INFO(station.daemon->Log());
  REQUIRE(station.Becomes(4));
  CHECK(station.Lens() == 1);
  REQUIRE(Eventually([&] { return (station.plc->Read(500, 24).Word(23) & 1) == 1; }));

  const auto told = station.plc->Read(500, 24);
  const Vec3 tip_C = GripperInCamera() * GripperTip();
  const Vec3 truth_mm = 1e3 * (kCellInW * (CellInCamera().Inverse() * tip_C));
  const Vec3 tip_mm(told.Float(14), told.Float(16), told.Float(18));
  CHECK(told.Float(20) > 0.01);
  CHECK(told.Float(20) < 3);
  CHECK((tip_mm - truth_mm).norm() < 2 * told.Float(20));
  CHECK(told.Word(13) == 2);
  CHECK((station.plc->Read(540 + 16, 16).Word(0) & 1) == 1);
  CHECK((station.plc->Read(14, 1).Word(0) & 0x700) == 0);
  const std::string status = StatusText(station.daemon->Plc());
  CHECK_THAT(status, Catch::Contains("camera       valid: the reference tags"));
  CHECK_THAT(status, Catch::Contains("lens 1 of the store") && !Catch::Contains("lens usable"));
  CHECK(station.plc->Read(527, 1).Word(0) == 65535);

  REQUIRE(Eventually([&] { return (station.plc->Read(400, 20).Word(0) & 1) != 0; }));
  REQUIRE(Eventually([&] { return station.Command(11) == 0; }));
  REQUIRE(Eventually([&] { return station.plc->Read(404, 2).Long(0) == 1; }));
  const auto rows = station.Journal();
  REQUIRE(rows.size() == 1);
  CHECK(rows[0].source == cell::JournalRow::Source::kCamera);
  REQUIRE((rows[0].measured_W && rows[0].covariance_W));
  CHECK((1e3 * *rows[0].measured_W - truth_mm).norm() < 2 * told.Float(20));
  CHECK(rows[0].covariance_W->trace() > 0);

  station.moving = true;
  REQUIRE(station.Becomes(2));
  CHECK((station.Bits() & 1) == 1);
  CHECK((station.plc->Read(14, 1).Word(0) & 0x100) != 0);
  CHECK(station.Command(11) == 14);
  CHECK((station.plc->Read(500, 24).Word(23) & 1) == 0);
  station.ZoomTo(kOtherKnown);
  station.moving = false;
  REQUIRE(station.Becomes(4));
  CHECK(station.Lens() == 2);
  CHECK(station.plc->Read(527, 1).Word(0) == 1000);
  CHECK_THAT(StatusText(station.daemon->Plc()),
             Catch::Contains("lens usable up to 1000 px from the middle of the image; nothing is "
                             "measured beyond"));
  CHECK(station.daemon->Says("camera moving: the lens is moving"));
  CHECK(station.Journal().size() == 1);

  station.daemon->Signal(SIGTERM);
  CHECK(station.daemon->Wait() == 0);
}

TEST_CASE("points that require the camera are withdrawn while its lens is not valid") {
  Station station("", "", {}, "required_for = [\"points\"]\n");
  INFO(station.daemon->Log());
  const auto point_valid = [&] { return (station.plc->Read(2000, 20).Word(1) & 1) != 0; };
  REQUIRE(station.Becomes(4));
  REQUIRE(Eventually(point_valid));
  CHECK(station.plc->Read(2000, 20).Word(2) == 0);

  station.moving = true;
  REQUIRE(Eventually([&] { return !point_valid(); }));
  CHECK(station.plc->Read(2000, 20).Word(2) == 14);
  CHECK(station.plc->Read(13, 1).Word(0) == 14);
  const auto health = station.plc->Read(24, 2);
  CHECK(health.Word(0) == 3);
  CHECK(health.Word(1) == 12);
  CHECK(station.Command(1) == 9);  // no such point
  CHECK_THAT(StatusText(station.daemon->Plc()),
             Catch::Contains("ALARM: points withdrawn: the camera's lens is not valid") &&
                 Catch::Contains("no correction: lens not valid"));
  CHECK(station.daemon->Says("corrected points withdrawn: the lens of camera 1 is not valid"));

  station.ZoomTo(kOtherKnown);
  station.moving = false;
  REQUIRE(station.Becomes(4));
  REQUIRE(Eventually(point_valid));
  CHECK(station.daemon->Awaits("corrected points are served again after"));

  // A reload changes neither the cameras nor what requires them.
  station.daemon->Write(
      WithLine(FileText(station.daemon->ConfigFile()), "camera", "required_for", "[]"));
  station.daemon->Signal(SIGHUP);
  REQUIRE(station.daemon->Awaits("needs a restart: [camera]"));
  REQUIRE(station.daemon->Awaits("reloaded"));
  REQUIRE(Eventually(point_valid));
  station.moving = true;
  CHECK(Eventually([&] { return !point_valid(); }));
}

TEST_CASE("a zoom that was never calibrated: the board, followed by its prompts, and on") {
  Station station;
  REQUIRE(station.Becomes(4));
  station.ZoomTo(kNever);
  REQUIRE(Eventually([&] { return station.State() == 5 && (station.Bits() & 8) != 0; }));
  CHECK(station.plc->Read(500, 24).Word(3) == static_cast<int>(lens::BoardPrompt::kShowBoard));
  CHECK(station.Command(11) == 14);

  SECTION("started and cancelled by the PLC") {
    REQUIRE(station.Command(9) == 0);
    REQUIRE(station.Becomes(6));
    station.image.Hide();  // the camera goes away meanwhile
    CHECK(station.daemon->Awaits("frame.pgm"));
    REQUIRE(station.Command(10) == 0);
    REQUIRE(station.Becomes(5));
    station.ShowCell();
    station.ZoomTo(kKnown);
    REQUIRE(station.Becomes(4));
  }
  SECTION("calibrated") {
    const renderer::Camera camera = CameraAt(kNever);
    station.ShowBoard(camera, {});
    INFO(station.daemon->Log());
    REQUIRE(station.State() == 4);
    CHECK(station.daemon->Says("the board is in view; capture started"));
    CHECK(station.daemon->Says("camera valid: the calibration was accepted"));
    station.ShowCell();
    REQUIRE(Eventually([&] { return (station.plc->Read(500, 24).Word(23) & 1) == 1; }));
    CHECK(station.State() == 4);
    CHECK(station.Lens() == 3);
    auto store = vision::LensStore::Open(station.folder.path() + "/state/lenses.sqlite");
    const auto kept = store.value().Find({"test camera", "test mode", kNever, 0}, {});
    REQUIRE((kept && *kept));
    CHECK((*kept)->how == vision::LensFound::How::kCalibrated);
    const vision::LensEntry& entry = (*kept)->entry;
    CHECK(std::abs(entry.lens.fx - camera.fx) < 5 * std::sqrt(entry.covariance(0, 0)));

    station.ZoomTo(kKnown);  // and back, and there again: no board any more
    REQUIRE(station.Becomes(4));
    REQUIRE(Eventually([&] { return station.Lens() == 1; }));
    station.ZoomTo(kNever);
    REQUIRE(Eventually([&] { return station.State() == 4 && station.Lens() == 3; }));
  }
}

TEST_CASE("a ChArUco board that the configuration names is captured as well") {
  const target::Board board{9, 6, 0.020, target::BoardKind::kCharuco, 0.015, "aruco-5x5-100"};
  Station station("",
                  "kind = \"charuco\"\ncolumns = 9\nrows = 6\nsquare_mm = 20.0\nmark_mm = 15.0\n"
                  "family = \"aruco-5x5-100\"\n");
  REQUIRE(station.Becomes(4));
  station.ZoomTo(kNever);
  REQUIRE(Eventually([&] { return station.State() == 5 && (station.Bits() & 8) != 0; }));
  station.ShowBoard(CameraAt(kNever), board);
  INFO(station.daemon->Log());
  REQUIRE(station.State() == 4);
  REQUIRE(Eventually([&] { return station.Lens() == 3; }));  // used at once, kept a moment later
  auto store = vision::LensStore::Open(station.folder.path() + "/state/lenses.sqlite");
  const auto kept = store.value().Find({"test camera", "test mode", kNever, 0}, {});
  REQUIRE((kept && *kept));
  const vision::LensEntry& entry = (*kept)->entry;
  CHECK(entry.board == WordsOf(board));
  REQUIRE(entry.uncertainty_px);
  CHECK(entry.temp_C.has_value() == ((station.plc->Read(11, 1).Word(0) & 0x100) != 0));
  const auto views = vision::DecodeViews(entry.corners);
  REQUIRE(views);
  CHECK(views->views.size() >= 6);
  const vision::LensCalibration again =
      vision::CalibrateLens(views->board, views->views, entry.size);
  CHECK(again.accepted);
  CHECK(vision::LargestDifference(again.lens, entry.lens, entry.size) <
        0.1 * *entry.uncertainty_px);
  CHECK(std::abs(entry.lens.fx - CameraAt(kNever).fx) < 5 * std::sqrt(entry.covariance(0, 0)));
}

TEST_CASE("a played zoom sensor does the same") {
  Station station("t_s,zoom_counts,focus_counts\n0,4000,0\n6,6000,0\n");
  INFO(station.daemon->Log());
  REQUIRE(station.Becomes(4));
  CHECK(station.Lens() == 1);
  REQUIRE(station.daemon->Awaits("camera moving: the zoom changed"));
  station.ZoomTo(kOtherKnown);
  REQUIRE(Eventually([&] { return station.State() == 4 && station.Lens() == 2; }));
}

TEST_CASE("a damaged lens store: it is told what to do, and the last good lens serves") {
  const auto garbage = [](const std::string& store) {
    std::ofstream(store) << std::string(5000, 'x');
  };
  constexpr int kStoreFault = 0x40;

  SECTION("no database at the start: the backup takes its place") {
    Station station("", "", garbage);
    INFO(station.daemon->Log());
    REQUIRE(station.Becomes(4));
    CHECK(station.Lens() == 1);
    CHECK((station.Bits() & kStoreFault) == 0);
    CHECK(station.daemon->Says("the backup with 2 lenses is in use"));
    CHECK(std::filesystem::exists(station.Store() + ".damaged-1"));
  }
  SECTION("a lens that is changed while it runs") {
    Station station;
    INFO(station.daemon->Log());
    REQUIRE(station.Becomes(4));
    {
      auto other = sqlite::Database::Open(station.Store(), sqlite::Database::Mode::kWrite);
      REQUIRE(other.value().Run("DROP TRIGGER lens_is_not_changed"));
      REQUIRE(other.value().Run("UPDATE lens SET fx = fx + 1 WHERE id = 2"));
    }
    station.ZoomTo(kOtherKnown);
    REQUIRE(Eventually([&] { return station.State() == 4 && station.Lens() == 2; }));
    CHECK(station.daemon->Says("lens 2 fails its checksum"));
    CHECK(station.daemon->Says("the backup with 2 lenses is in use"));
    CHECK((station.Bits() & kStoreFault) == 0);
  }
  SECTION("no backup either: stale, until a person moves the file away") {
    Station station("", "", [&](const std::string& store) {
      garbage(store);
      std::filesystem::remove(store + ".backup");
    });
    INFO(station.daemon->Log());
    REQUIRE(station.daemon->Awaits("move the file away to start a new store"));
    REQUIRE(station.Becomes(5));  // once it has waited in vain for a lens
    CHECK((station.Bits() & kStoreFault) != 0);
    CHECK((station.Bits() & 1) == 1);
    CHECK(std::filesystem::file_size(station.Store()) == 5000);  // nobody touched it
    std::filesystem::remove(station.Store());
    REQUIRE(Eventually([&] { return (station.Bits() & kStoreFault) == 0; }));
    CHECK(station.daemon->Says("lens store works again"));
    CHECK(station.State() == 5);
    CHECK((station.Bits() & 8) != 0);  // the board is asked for
  }
}

TEST_CASE("without a camera its commands are refused, and its block says so") {
  RunningCell cell(Idle());
  DaemonProcess daemon(DemoConfig(cell.robot(), "universal-robots-fine"));
  RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
  std::uint16_t sequence = 7;
  for (int code = 9; code <= 11; ++code) {
    std::vector<std::uint16_t> words(40);
    words[0] = static_cast<std::uint16_t>(code);
    words[39] = ++sequence;
    plc.Write(1000, words);
    REQUIRE(Eventually([&] { return plc.Read(101, 1).Word(0) == sequence; }));
    CHECK(plc.Read(102, 1).Word(0) == 13);
  }
  CHECK(plc.Read(500, 24).Word(0) == 0);
  CHECK((plc.Read(14, 1).Word(0) & 0x700) == 0);
}

}  // namespace plumbline::camera_test
