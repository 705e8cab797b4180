// The two threads of a CameraSupervisor in this process, for the sanitizers: a recorded camera, a
// zoom sensor set by the test, and a status reader like the control cycle. Decisions are tested in
// lens_supervisor_test.cc, the daemon as a whole in tests/app/cell/daemon/camera_test.cc.
#include "app/vision/camera/camera_supervisor.h"

#include <catch2/catch.hpp>
#include <numbers>

#include "firmware-like/image/image_size.h"
#include "tests/app/vision/camera/supervised_camera.h"

namespace plumbline::camera_supervisor_test {

using namespace plumbline::vision;
using namespace plumbline::test;

TEST_CASE(
    "camera unplugged during a capture: refused with the reason, the stored lens is unaffected") {
  SupervisedCamera bench(1.5);
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
  auto store = vision::LensStore::Open(bench.folder.path() + "/lenses.sqlite");
  CHECK(*store.value().Count() == 1);
}

TEST_CASE("nothing is measured in images of another size than the lens") {
  const auto bodies_become_valid = [](SupervisedCamera& bench, bool valid) {
    for (int wait = 0; wait < kWaits; ++wait) {
      if (bench.link.status.Read()->bodies[1].valid == valid) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  };
  SECTION("the lens was calibrated at another size in the same mode") {
    SupervisedCamera bench(60, {1280, 720});
    REQUIRE(bench.Says("images are 1920 x 1080 px, but the lens was calibrated at 1280 x 720 px"));
    REQUIRE(bench.Becomes(lens::ZoomState::kStale));
    CHECK_FALSE(bench.link.status.Read()->bodies[1].valid);
  }
  SECTION("the image size changes") {
    SupervisedCamera bench(60);
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
  SupervisedCamera bench(60, {1920, 1080}, std::numbers::pi);
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
  CHECK(vision::AngleBetween(status->bodies[1].X_WK, expected) < 5e-3);
}

TEST_CASE("drawn_by names the origin of the print; a wrong one is named, not overruled") {
  using target::DrawnBy;
  const auto drawn_by = [](target::DrawnBy library) {
    return [library](config::VisionConfig& vision) {
      for (target::Body& body : vision.tags.database.bodies) {
        for (target::BodyTag& tag : body.tags) tag.drawn_by = library;
      }
    };
  };
  SECTION("right") {
    SupervisedCamera bench(60, {1920, 1080}, std::numbers::pi, drawn_by(target::DrawnBy::kOpenCv));
    REQUIRE(bench.Becomes(lens::ZoomState::kValid));
    CHECK(bench.Count("OpenCV") == 0);
    CHECK_FALSE(bench.link.status.Read()->opencv_prints);
  }
  SECTION("wrong") {
    SupervisedCamera bench(60, {1920, 1080}, std::numbers::pi,
                           drawn_by(target::DrawnBy::kAprilTag));
    REQUIRE(bench.Becomes(lens::ZoomState::kStale));
    CHECK(bench.Says("every reference tag is turned by half a turn against its declaration"));
  }
}

TEST_CASE(
    "a reference tag that contradicts the others is named, and measuring goes on without it") {
  SupervisedCamera bench(60, {1920, 1080}, 0, [](config::VisionConfig& vision) {
    target::Body& cell = vision.tags.database.bodies[0];
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

TEST_CASE(
    "a zoom change invalidates the lens, a capture starts and is cancelled, Stop() works at any "
    "time") {
  SupervisedCamera bench(180, {1920, 1080}, 0,
                         [](config::VisionConfig& vision) { vision.tags.tool = "gripper"; });
  REQUIRE(bench.Becomes(lens::ZoomState::kValid));
  CHECK(bench.link.status.Read()->lens_id == 1);
  bench.zoom = 5000;
  REQUIRE(bench.Becomes(lens::ZoomState::kStale));
  CHECK(bench.link.status.Read()->board_wanted);
  ++bench.link.start_board;
  REQUIRE(bench.Becomes(lens::ZoomState::kCalibrating));
  ++bench.link.cancel_board;
  REQUIRE(bench.Becomes(lens::ZoomState::kStale));
  bench.zoom = 100;
  REQUIRE(bench.Becomes(lens::ZoomState::kValid));
  ++bench.link.start_board;
  bench.supervisor->Stop();
}

}  // namespace plumbline::camera_supervisor_test
