// A calibration with the real board worker that the reference tags contradict.
#include <catch2/catch.hpp>

#include "tests/app/vision/camera/supervised_camera.h"

namespace plumbline::contradicted_calibration_test {

using namespace plumbline::vision;
using namespace plumbline::test;

TEST_CASE("a calibration that the tags contradict is not repeated while the board stays in view") {
  SupervisedCamera bench(
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
  const target::Board board;
  GuidedPerson person(camera, board);
  while (person.images() < 400 && bench.Count("camera: calibrated: f") == 0) {
    const auto kept = bench.link.status.Read()->board_views;
    bench.image.Show(person.Next(bench.Outline()));
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
  bench.image.Show(DrawBoard(camera, board, FirstPose(camera, board), 7));
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));  // five searches' worth
  CHECK(bench.link.status.Read()->state == lens::ZoomState::kStale);
  CHECK(bench.Count("the board is in view; capture started") == 1);
}

}  // namespace plumbline::contradicted_calibration_test
