// The two threads of a CameraSupervisor in this process, for the sanitizers: a recorded camera, a
// zoom sensor set by the test, and a status reader like the control cycle. Decisions are tested in
// lens_supervisor_test.cc, the daemon as a whole in tests/app/daemon/camera_test.cc.
#include "app/camera/camera_supervisor.h"

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <functional>
#include <mutex>
#include <numbers>

#include "firmware-like/image/image_size.h"
#include "tests/app/camera/camera_scene.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::camera_supervisor_test {

using namespace plumbline::camera;
using namespace plumbline::test;

namespace {

constexpr int kWaits = 6000;  // of 10 ms: a minute, for a busy machine

class SettableZoom : public zoom::ZoomSensor {
 public:
  explicit SettableZoom(const std::atomic<int>& zoom) : zoom_(zoom) {}
  zoom::ZoomResult Read(lens::ZoomReading& reading) override {
    if (zoom_ < 0) return zoom::ZoomResult::kTimeout;
    reading = {};
    reading.zoom_counts = zoom_;
    reading.time_s = MonotonicSeconds();
    return zoom::ZoomResult::kOk;
  }
  std::string_view problem() const override { return "no reading"; }

 private:
  const std::atomic<int>& zoom_;
};

/// Stores the lens of the test camera for zoom 100.
void StoreLens(const std::string& folder, image::ImageSize size) {
  auto store = lens_store::LensStore::Open(folder + "/lenses.sqlite");
  lens_store::LensEntry entry;
  entry.key = {"test camera", "mode", 100, std::nullopt};
  entry.lens = test::LensOfCamera(renderer::ZoomLens(2600));
  entry.covariance.diagonal() << 0.04, 0.04, 0.04, 0.04, 1e-9, 1e-9, 1e-12, 1e-12, 0;
  entry.size = size;
  entry.utc = "2026-01-01T00:00:00Z";
  REQUIRE(store.value().Append(entry));
}

/// A supervisor whose camera shows an image file and whose store has a lens for zoom 100.
struct Bench {
  TemporaryFolder folder;
  ShownImage image{folder.path()};
  std::atomic<int> zoom{100};
  double turned_rad = 0;
  CameraLink link;
  std::mutex mutex;
  std::vector<std::string> log;
  std::optional<CameraStores> stores;
  std::optional<CameraSupervisor> supervisor;

  using Change = std::function<void(config::VisionConfig&)>;
  explicit Bench(double patience_s, image::ImageSize lens_size = {1920, 1080}, double turned = 0,
                 const Change& change = {}, const char* worker = "/bin/false")
      : turned_rad(turned) {
    ShowCell();
    StoreLens(folder.path(), lens_size);
    config::VisionConfig vision;
    config::CameraConfig& config = vision.cameras.emplace_back();
    config.kind = "recorded";
    config.connection.recorded = {folder.path() + "/frames", 20, true, true, "test camera", "mode"};
    config.zoom.period_s = 0.02;
    config.zoom.supervision.lost_after_s = 30;
    vision.tags.database.bodies = {CellTags(), GripperBody()};
    vision.board.by_itself = false;
    vision.board.patience_s = patience_s;
    if (change) change(vision);
    auto devices = MakeCameraDevices(config, vision.tags);
    REQUIRE(devices);
    devices.value().zoom = std::make_unique<SettableZoom>(zoom);
    const auto sink = [this](const log::LogEntry& entry) {
      const std::lock_guard lock(mutex);
      log.push_back(entry.text);
    };
    stores.emplace(folder.path(), config::CellReferenceTags(vision.tags), sink);
    supervisor.emplace(config, vision, std::move(devices).value(), *stores, worker, link, sink);
    supervisor->Start();
  }
  void ShowCell() const {
    image.Show(DrawCell(renderer::ZoomLens(2600), CellInCamera(), GripperInCamera(), turned_rad));
  }
  int Count(const std::string& text) {
    const std::lock_guard lock(mutex);
    return static_cast<int>(std::count_if(log.begin(), log.end(), [&](const std::string& line) {
      return line.find(text) != std::string::npos;
    }));
  }
  bool Becomes(lens::ZoomState state) {
    for (int wait = 0; wait < kWaits; ++wait) {
      if (link.status.Read()->state == state) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }
  bool Says(const std::string& text) {
    for (int wait = 0; wait < kWaits; ++wait) {
      {
        const std::lock_guard lock(mutex);
        for (const std::string& line : log) {
          if (line.find(text) != std::string::npos) return true;
        }
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }
};

}  // namespace

TEST_CASE(
    "camera unplugged during a capture: refused with the reason, the stored lens is unaffected") {
  Bench bench(1.5);
  REQUIRE(bench.Becomes(lens::ZoomState::kValid));
  bench.zoom = 5000;
  REQUIRE(bench.Becomes(lens::ZoomState::kStale));
  SECTION("after the first frames") {
    ++bench.link.start_board;
    REQUIRE(bench.Becomes(lens::ZoomState::kCalibrating));
    bench.image.Hide();
    REQUIRE(bench.Becomes(lens::ZoomState::kRefused));
    CHECK(bench.Says("camera: calibration refused: n"));
    CHECK(bench.Says("no frame from the camera"));
  }
  SECTION("before the first frame") {
    bench.image.Hide();
    REQUIRE(bench.Says("frame.pgm"));
    ++bench.link.start_board;
    REQUIRE(bench.Becomes(lens::ZoomState::kRefused));
    CHECK(bench.Says("camera: calibration refused: no frame from the camera within 2 s"));
  }
  const auto status = bench.link.status.Read();
  CHECK(status->camera_lost);
  CHECK(status->lens_stale);
  // Reconnected, and back at the calibrated zoom: the stored lens is in use again.
  bench.ShowCell();
  bench.zoom = 100;
  REQUIRE(bench.Becomes(lens::ZoomState::kValid));
  CHECK(bench.link.status.Read()->lens_id == 1);
  CHECK(bench.Says("camera back after"));
  auto store = lens_store::LensStore::Open(bench.folder.path() + "/lenses.sqlite");
  CHECK(*store.value().Count() == 1);
}

TEST_CASE("nothing is measured in images of another size than the lens") {
  const auto bodies_become_valid = [](Bench& bench, bool valid) {
    for (int wait = 0; wait < kWaits; ++wait) {
      if (bench.link.status.Read()->bodies[1].valid == valid) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  };
  SECTION("the lens was calibrated at another size in the same mode") {
    Bench bench(60, {1280, 720});
    REQUIRE(bench.Says("images are 1920 x 1080 px, but the lens was calibrated at 1280 x 720 px"));
    REQUIRE(bench.Becomes(lens::ZoomState::kStale));
    CHECK_FALSE(bench.link.status.Read()->bodies[1].valid);
  }
  SECTION("the image size changes") {
    Bench bench(60);
    REQUIRE(bench.Becomes(lens::ZoomState::kValid));
    CHECK(bodies_become_valid(bench, true));
    renderer::Camera small = renderer::ZoomLens(2600);
    small.width = 640;
    small.height = 480;
    bench.image.Show(DrawCell(small, CellInCamera(), GripperInCamera()));
    REQUIRE(bench.Says("640 x 480"));
    CHECK(bodies_become_valid(bench, false));
    bench.ShowCell();
    CHECK(bodies_become_valid(bench, true));
  }
}

TEST_CASE("tags that OpenCV drew are recognized, said and read so") {
  Bench bench(60, {1920, 1080}, std::numbers::pi);
  REQUIRE(bench.Becomes(lens::ZoomState::kValid));
  CHECK(bench.Count("36h11 as OpenCV draws them, rotated by half a turn") == 1);
  CHECK(bench.Count("Set drawn_by = \"opencv\" in the tag file.") == 1);
  for (int wait = 0; wait < kWaits && !bench.link.status.Read()->bodies[1].valid; ++wait) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  const auto status = bench.link.status.Read();
  CHECK(status->opencv_prints);
  CHECK(status->contradicting_count == 0);
  const Pose expected = CellInCamera().Inverse() * GripperInCamera();
  CHECK((status->bodies[1].X_WK.p - expected.p).norm() < 2e-3);
  CHECK(tracking::AngleBetween(status->bodies[1].X_WK, expected) < 5e-3);
}

TEST_CASE("drawn_by names the origin of the print; a wrong one is named, not overruled") {
  using tracking::DrawnBy;
  const auto drawn_by = [](DrawnBy library) {
    return [library](config::VisionConfig& vision) {
      for (tracking::Body& body : vision.tags.database.bodies) {
        for (tracking::BodyTag& tag : body.tags) tag.drawn_by = library;
      }
    };
  };
  SECTION("right") {
    Bench bench(60, {1920, 1080}, std::numbers::pi, drawn_by(DrawnBy::kOpenCv));
    REQUIRE(bench.Becomes(lens::ZoomState::kValid));
    CHECK(bench.Count("OpenCV") == 0);
    CHECK_FALSE(bench.link.status.Read()->opencv_prints);
  }
  SECTION("wrong") {
    Bench bench(60, {1920, 1080}, std::numbers::pi, drawn_by(DrawnBy::kAprilTag));
    REQUIRE(bench.Becomes(lens::ZoomState::kStale));
    CHECK(bench.Says("every reference tag is turned by half a turn against its declaration"));
  }
}

TEST_CASE(
    "a reference tag that contradicts the others is named, and measuring goes on without it") {
  Bench bench(60, {1920, 1080}, 0, [](config::VisionConfig& vision) {
    tracking::Body& cell = vision.tags.database.bodies[0];
    cell.tags[2].X_KM.p.x() += 0.04;  // declared wrongly
    cell.tags[4].X_KM.R = cell.tags[4].X_KM.R * RotationFromVector(Vec3(0, 0, std::numbers::pi));
  });
  REQUIRE(bench.Becomes(lens::ZoomState::kValid));
  CHECK(
      bench.Says("reference tag 2, 4 are not where the other tags imply; tag 4 is turned by 180"));
  for (int wait = 0; wait < kWaits && !bench.link.status.Read()->bodies[1].valid; ++wait) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(300));  // it stays so with a baseline
  const auto status = bench.link.status.Read();
  CHECK(status->fiducial_moved);
  REQUIRE(status->contradicting_count == 2);
  CHECK(status->contradicting_tags[0] == 2);
  CHECK(status->contradicting_tags[1] == 4);
  const Pose expected = CellInCamera().Inverse() * GripperInCamera();
  CHECK((status->bodies[1].X_WK.p - expected.p).norm() < 2e-3);
  CHECK(bench.Count("are not where the other tags imply") == 1);
}

TEST_CASE("a calibration that the tags contradict is not repeated while the board stays in view") {
  Bench bench(
      60, {1920, 1080}, 0,
      [](config::VisionConfig& vision) {
        vision.tags.database.bodies[0].tags.resize(2);
        vision.tags.database.bodies[0].tags[1].X_KM.p.x() += 0.1;
        vision.board.by_itself = true;
        vision.board.views = 8;
        vision.board.acceptable_px = 100;
      },
      PLUMBLINE);
  REQUIRE(bench.Becomes(lens::ZoomState::kStale));
  const renderer::Camera camera = renderer::ZoomLens(2600);
  const lens::Board board;
  for (std::uint64_t view = 0; view < 400 && bench.Count("camera: calibrated: f") == 0; ++view) {
    const auto status = bench.link.status.Read();
    lens::BoardPrompt prompt = status->prompt;
    if (prompt <= lens::BoardPrompt::kHoldStill) {
      prompt = static_cast<lens::BoardPrompt>(3 + view % 4);
    }
    bench.image.Show(DrawBoard(camera, board, prompt, view + 1));
    const auto kept = status->board_views;
    for (int wait = 0; wait < 40 && bench.link.status.Read()->board_views == kept; ++wait) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
  REQUIRE(bench.Count("camera: calibrated: f") == 1);
  bench.ShowCell();
  CHECK(bench.Says("reference tags 0, 1 contradict each other"));
  REQUIRE(bench.Becomes(lens::ZoomState::kStale));
  const auto status = bench.link.status.Read();
  CHECK(status->reason == lens::ZoomReason::kTagsContradict);
  CHECK_FALSE(status->board_wanted);
  CHECK(status->contradicting_count == 2);
  bench.image.Show(DrawBoard(camera, board, lens::BoardPrompt::kShowBoard, 7));
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));  // five searches' worth
  CHECK(bench.link.status.Read()->state == lens::ZoomState::kStale);
  CHECK(bench.Count("the board is in view; capture started") == 1);
}

TEST_CASE(
    "a zoom change invalidates the lens, a capture starts and is cancelled, Stop() works at any "
    "time") {
  const TemporaryFolder folder;
  const ShownImage image(folder.path());
  image.Show(DrawCell(renderer::ZoomLens(2600), CellInCamera(), GripperInCamera()));
  StoreLens(folder.path(), {1920, 1080});
  config::VisionConfig vision;
  config::CameraConfig& config = vision.cameras.emplace_back();
  config.kind = "recorded";
  config.connection.recorded = {folder.path() + "/frames", 20, true, true, "test camera", "mode"};
  config.zoom.period_s = 0.02;
  config.zoom.supervision.lost_after_s = 30;
  vision.tags.database.bodies = {CellTags(), GripperBody()};
  vision.tags.tool = "gripper";
  vision.board.by_itself = false;
  auto devices = MakeCameraDevices(config, vision.tags);
  REQUIRE(devices);
  std::atomic<int> zoom{100};
  devices.value().zoom = std::make_unique<SettableZoom>(zoom);
  CameraLink link;
  const auto sink = [](const log::LogEntry&) {};
  CameraStores stores(folder.path(), CellTags(), sink);
  CameraSupervisor supervisor(config, vision, std::move(devices).value(), stores, "/bin/false",
                              link, sink);
  supervisor.Start();
  const auto becomes = [&](lens::ZoomState state) {
    for (int wait = 0; wait < kWaits; ++wait) {
      if (link.status.Read()->state == state) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  };
  REQUIRE(becomes(lens::ZoomState::kValid));
  CHECK(link.status.Read()->lens_id == 1);
  zoom = 5000;
  REQUIRE(becomes(lens::ZoomState::kStale));
  CHECK(link.status.Read()->board_wanted);
  ++link.start_board;
  REQUIRE(becomes(lens::ZoomState::kCalibrating));
  ++link.cancel_board;
  REQUIRE(becomes(lens::ZoomState::kStale));
  zoom = 100;
  REQUIRE(becomes(lens::ZoomState::kValid));
  ++link.start_board;
  supervisor.Stop();
}

}  // namespace plumbline::camera_supervisor_test
