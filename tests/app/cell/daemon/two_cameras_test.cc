// The real daemon with two cameras, side and rear: each with its image, its zoom sensor at a
// pseudo-terminal, its registers. What happens to one does not happen to the other.
#include <array>
#include <catch2/catch.hpp>
#include <fstream>

#include "app/base/text/json_text.h"
#include "tests/app/cell/daemon/camera_cell.h"
#include "tests/app/cell/daemon/daemon_process.h"
#include "tests/app/cell/daemon/demo_config.h"
#include "tests/app/cell/daemon/status_command_output.h"
#include "tests/drivers/zoom/fake_visca_camera.h"

namespace plumbline::two_cameras_test {

using namespace plumbline::test;
using virtual_cell::Eventually;
using virtual_cell::RegisterClient;
using virtual_cell::RunningCell;

namespace {

/// The rear camera from the side one: 0.35 m to its right, turned so that both see the same.
Pose SideInRear() {
  const Mat3 R = RotationFromVector(Vec3(0.05, 0.25, 0));
  const Vec3 middle(0, 0, 1.4);
  return {R, middle - R * middle};
}

struct Eye {
  std::string name, serial;
  Pose X_CS;  ///< of the side camera in it
  ShownImage image;
  std::atomic<int> zoom{kKnown};
  std::atomic<bool> moving{false};
  FakeViscaCamera visca{CameraAnswers([this] { return BlockOf(zoom, 0, false, moving); })};

  Eye(const std::string& folder, std::string called, const Pose& from_side)
      : name(std::move(called)), serial(name + " camera"), X_CS(from_side), image(folder + name) {
    ShowCell();
  }
  void ShowCell() const {
    image.Show(DrawCell(CameraAt(zoom), X_CS * CellInCamera(), X_CS * GripperInCamera()));
  }
  std::string Table() const {
    return "[[camera]]\nname = \"" + name + "\"\nkind = \"recorded\"\npath = \"" + image.path() +
           "\"\nrepeat = true\nserial = \"" + serial +
           "\"\nmode = \"test mode\"\nrate_hz = 20.0\n[camera.zoom]\nkind = \"visca\"\n" +
           "device = \"" + visca.device() + "\"\nlost_after_ms = 5000\n";
  }
};

struct Station {
  TemporaryFolder folder;
  std::array<Eye, 2> eyes{Eye(folder.path() + "/", "side", {}),
                          Eye(folder.path() + "/", "rear", SideInRear())};
  RunningCell cell{Idle()};
  std::optional<DaemonProcess> daemon;
  std::optional<RegisterClient> plc;
  std::uint16_t sequence = 100;

  Station() {
    for (const Eye& eye : eyes) KeepLenses(folder.path() + "/state", eye.serial);
    std::ofstream(folder.path() + "/bodies.toml") << TagsText();
    daemon.emplace(WithLine(DemoConfig(cell.robot(), "universal-robots-fine"), "",
                            "state_directory", "\"" + folder.path() + "/state\"") +
                   "\n[monitoring]\nenabled = true\nreference_probes = 0\ndiagnose = false\n"
                   "probe_sigma_mm = 0.2\n" +
                   eyes[0].Table() + eyes[1].Table() + TagsTable(folder.path() + "/bodies.toml"));
    plc.emplace("plumblined", daemon->Plc(), 1, 10);
  }
  auto Block(int k) { return plc->Read(static_cast<std::uint16_t>(500 + 200 * k), 25); }
  int State(int k) { return Block(k).Word(0); }
  bool Becomes(int k, int state) {
    return Eventually([&] { return State(k) == state; });
  }
  /// Measures now: lens valid, an image and a tip of the last half second.
  bool Measures(int k) {
    const auto told = Block(k);
    return told.Word(0) == 4 && told.Word(5) < 500 && told.Word(23) == 1 && told.Word(22) < 500;
  }
  int Command(int code, int camera) { return test::Command(*plc, ++sequence, code, camera); }
  /// One row by camera, as soon as those that are meant measure: a busy machine is late with
  /// images.
  bool Probed(int camera, std::initializer_list<int> meant) {
    return Eventually([&] {
      for (const int k : meant) {
        if (!Measures(k)) return false;
      }
      return Command(11, camera) == 0;
    });
  }
  /// The rows of the journal once there are so many.
  std::vector<cell::JournalRow> Rows(std::uint32_t count) {
    REQUIRE(Eventually([&] { return plc->Read(404, 2).Long(0) == count; }));
    return test::JournalOf(folder);
  }
};

}  // namespace

TEST_CASE("two cameras: one zooms or goes away, the other measures on; both make one probe") {
  Station station;
  INFO(station.daemon->Log());
  for (int k = 0; k < 2; ++k) {
    REQUIRE(Eventually([&] { return station.Measures(k); }));
    CHECK(station.Block(k).Long(10) == static_cast<std::uint32_t>(1 + 2 * k));
    CHECK(station.Block(k).Word(24) == 1 + k);
  }
  const std::string status = StatusText(station.daemon->Plc());
  CHECK_THAT(status, Catch::Contains("camera side  valid: the reference tags"));
  CHECK_THAT(status, Catch::Contains("camera rear  valid: the reference tags"));
  CHECK((station.plc->Read(11, 1).Word(0) & 0x40) != 0);
  // What was seen of the marks is kept of both, in one file.
  REQUIRE(Eventually([&] {
    const std::string text = FileText(station.folder.path() + "/state/fixed_marks.json");
    const auto marks = text::JsonOrNull(text);
    return marks.is_object() && marks["lenses"].contains("1") && marks["lenses"].contains("3");
  }));

  // Both see the tip: one row, better than that of either.
  const Vec3 truth_W = kCellInW * (CellInCamera().Inverse() * (GripperInCamera() * GripperTip()));
  REQUIRE(Eventually([&] { return (station.plc->Read(400, 20).Word(0) & 1) != 0; }));
  for (const int camera : {0, 1, 2}) REQUIRE(station.Probed(camera, {0, 1}));
  const std::vector<cell::JournalRow> rows = station.Rows(3);
  const char* const seen_by[] = {"side+rear", "side", "rear"};
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(rows[k].camera == seen_by[k]);
    CHECK((*rows[k].measured_W - truth_W).norm() < 1e-3);
  }
  CHECK(rows[0].covariance_W->trace() < rows[1].covariance_W->trace());
  CHECK(rows[0].covariance_W->trace() < rows[2].covariance_W->trace());
  CHECK(
      station.daemon->Awaits("probes by camera side are recorded, but not monitored for drift: the "
                             "reference was taken by camera side+rear"));

  SECTION("the side one zooms: stale, then its other lens") {
    Eye& side = station.eyes[0];
    side.moving = true;
    REQUIRE(station.Becomes(0, 2));
    CHECK((station.Block(0).Word(2) & 1) == 1);
    CHECK((station.Block(0).Word(23) & 1) == 0);
    CHECK(Eventually([&] { return station.Measures(1); }));
    CHECK((station.plc->Read(14, 1).Word(0) & 0x100) != 0);
    CHECK((station.plc->Read(11, 1).Word(0) & 0x40) == 0);
    CHECK(station.Command(11, 1) == 14);
    REQUIRE(station.Probed(0, {1}));
    CHECK(station.Rows(4)[3].camera == "rear");
    side.zoom = kOtherKnown;
    side.ShowCell();
    side.moving = false;
    REQUIRE(Eventually([&] { return station.Measures(0); }));
    CHECK(station.Block(0).Long(10) == 2);
    CHECK(station.Block(1).Long(10) == 3);
    CHECK(station.daemon->Says("camera side moving: the lens is moving"));
    CHECK_FALSE(station.daemon->Says("camera rear moving"));
  }
  SECTION("the rear one is unplugged, and comes back; its sensor is heard all the while") {
    station.eyes[1].image.Hide();
    REQUIRE(Eventually([&] { return (station.Block(1).Word(2) & 2) != 0; }));
    CHECK((station.Block(1).Word(23) & 1) == 0);
    CHECK(Eventually([&] { return station.Measures(0); }));
    CHECK((station.Block(0).Word(2) & 2) == 0);
    CHECK(station.daemon->Awaits("camera rear: frames"));
    REQUIRE(station.Probed(0, {0}));
    CHECK(station.Rows(4)[3].camera == "side");
    station.eyes[1].ShowCell();
    REQUIRE(Eventually([&] { return station.Measures(1); }));
    CHECK(station.daemon->Awaits("camera rear back after"));
  }
  SECTION("the tool is moved under one of them alone: they contradict each other") {
    Eye& rear = station.eyes[1];
    const Pose moved{Mat3::Identity(), Vec3(0.05, 0, 0)};
    rear.image.Show(DrawCell(CameraAt(kKnown), rear.X_CS * CellInCamera(),
                             rear.X_CS * (moved * GripperInCamera())));
    REQUIRE(Eventually([&] { return station.Command(11, 0) == 16; }));
    CHECK(station.Probed(1, {0}));
  }
  SECTION("a calibration is asked of the one that is named") {
    REQUIRE(station.Command(9, 2) == 0);
    REQUIRE(station.Becomes(1, 6));
    CHECK(Eventually([&] { return station.Measures(0); }));
    REQUIRE(station.Command(10, 0) == 0);
    REQUIRE(Eventually([&] { return station.State(1) != 6; }));
    CHECK(station.Command(9, 3) == 13);
  }
}

}  // namespace plumbline::two_cameras_test
