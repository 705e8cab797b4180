// The watch's two threads in this process, for the sanitizers: a recorded camera, a sensor that the
// test turns, a reader as the cycle is one. What it decides is tested in watch_core_test.cc, the
// whole of it in tests/app/daemon/camera_test.cc.
#include "app/camera/camera_watch.h"

#include <atomic>
#include <catch2/catch.hpp>

#include "tests/app/camera/camera_scene.h"
#include "tests/app/temporary_folder.h"

using namespace plumbline;
using namespace plumbline::test;

namespace {

class TurnedByHand : public ZoomSensor {
 public:
  explicit TurnedByHand(const std::atomic<int>& zoom) : zoom_(zoom) {}
  ZoomResult Read(ZoomReading& reading) override {
    if (zoom_ < 0) return ZoomResult::kTimeout;
    reading = {};
    reading.zoom_counts = zoom_;
    reading.time_s = MonotonicSeconds();
    return ZoomResult::kOk;
  }
  std::string_view problem() const override { return "turned away"; }

 private:
  const std::atomic<int>& zoom_;
};

}  // namespace

TEST_CASE("valid, stale on a turn of the zoom, board asked for, ended at any moment") {
  const TemporaryFolder folder;
  const ShownImage image(folder.path());
  image.Show(DrawCell(renderer::ZoomLens(2600), CellInCamera(), GripperInCamera()));
  {
    auto store = LensStore::Open(folder.path() + "/lenses.sqlite");
    LensEntry entry;
    entry.key = {"test camera", "mode", 100, std::nullopt};
    entry.lens = TrueLens(renderer::ZoomLens(2600));
    entry.covariance.diagonal() << 0.04, 0.04, 0.04, 0.04, 1e-9, 1e-9, 1e-12, 1e-12, 0;
    entry.image = {1920, 1080};
    entry.utc = "2026-01-01T00:00:00Z";
    REQUIRE(store.value().Append(entry));
  }
  CameraConfig config;
  config.kind = "recorded";
  config.connection.recorded = {folder.path() + "/frames", 20, true, true, "test camera", "mode"};
  config.zoom.period_s = 0.02;
  config.zoom.supervision.lost_after_s = 30;
  config.tags.database.bodies = {CellMarks(), GripperBody()};
  config.tags.tool = "gripper";
  config.board.by_itself = false;
  auto devices = CameraDevicesFrom(config);
  REQUIRE(devices);
  std::atomic<int> zoom{100};
  devices.value().zoom = std::make_unique<TurnedByHand>(zoom);
  CameraLink link;
  CameraWatch watch(config, std::move(devices).value(), {folder.path(), "/bin/false"}, link,
                    [](LogLevel, const std::string&) {});
  watch.Start();
  const auto becomes = [&](ZoomState state) {
    for (int wait = 0; wait < 6000; ++wait) {
      if (link.told.Read()->state == state) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  };
  REQUIRE(becomes(ZoomState::kValid));
  CHECK(link.told.Read()->lens_id == 1);
  zoom = 5000;
  REQUIRE(becomes(ZoomState::kStale));
  CHECK((link.told.Read()->bits & camera_bits::kBoardWanted) != 0);
  ++link.start_board;
  REQUIRE(becomes(ZoomState::kCalibrating));
  ++link.cancel_board;
  REQUIRE(becomes(ZoomState::kStale));
  zoom = 100;
  REQUIRE(becomes(ZoomState::kValid));
  ++link.start_board;
  watch.Stop();
}
