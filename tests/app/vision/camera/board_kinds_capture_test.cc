// Complete capture of each kind of board as the daemon runs it: rendered frames, the real worker
// process, and a user who follows the prompts.
#include <catch2/catch.hpp>
#include <chrono>
#include <thread>

#include "app/vision/camera/board_session.h"
#include "app/vision/camera/board_worker.h"
#include "tests/app/vision/camera/camera_scene.h"

namespace plumbline::board_kinds_capture_test {

using namespace plumbline::vision;

namespace {

/// Disables the deadline: speed is not tested here.
double StoppedClock() {
  return 0;
}

Result<vision::BoardView> Await(BoardWorker& worker) {
  for (int wait = 0; wait < 6000; ++wait) {
    if (auto answer = worker.Poll()) return *std::move(answer);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return Error{"the test's patience ended"};
}

/// The same view at 1280 x 720 pixels, which renders faster.
renderer::Camera Small(renderer::Camera camera) {
  const double scale = 1280.0 / camera.width;
  camera.width = 1280;
  camera.height = 720;
  camera.fx *= scale;
  camera.fy *= scale;
  camera.cx = scale * (camera.cx + 0.5) - 0.5;
  camera.cy = scale * (camera.cy + 0.5) - 0.5;
  return camera;
}

}  // namespace

TEST_CASE(
    "every kind of board: following the outlines gives a lens as accurate as its stated "
    "uncertainty") {
  const target::Board boards[] = {
      {17, 11, 0.010},
      {9, 6, 0.020, target::BoardKind::kCharuco, 0.015, "aruco-5x5-100"},
      {11, 7, 0.020, target::BoardKind::kCircles, 0.012, {}},
      {4, 11, 0.020, target::BoardKind::kAsymmetricCircles, 0.015, {}}};
  const renderer::Camera camera = Small(renderer::ZoomLens(2200));
  for (const target::Board& board : boards) {
    CAPTURE(WordsOf(board));
    BoardWorker worker(PLUMBLINE, StoppedClock);
    BoardSettings settings;
    settings.board = board;
    settings.views = 12;
    BoardSession session(settings, {camera.width, camera.height}, 0);
    test::GuidedPerson person(camera, board);
    std::uint64_t frame = 0;
    std::string misses;
    for (; frame < 120 && session.state() == BoardSession::State::kCapturing; ++frame) {
      const renderer::Image image = person.Next(session.guidance().wanted_px, 0.1);
      REQUIRE(worker.Submit(test::ViewOf(image), board));
      auto found = Await(worker);
      const double time_s = static_cast<double>(frame);
      if (found) {
        vision::BoardView view = std::move(found).value();
        view.time_s = time_s;
        session.Take(std::move(view));
      } else {
        session.TakeFailure(found.error(), time_s);
        misses += found.error() + "; ";
      }
    }
    CAPTURE(frame, session.kept(), session.rejection(), misses, session.reasons());
    REQUIRE(session.state() == BoardSession::State::kAccepted);
    const vision::LensCalibration& solved = *session.calibration();
    const double wrong =
        vision::LargestDifference(solved.lens, test::LensOfCamera(camera), solved.size);
    CHECK(wrong < 4 * solved.uncertainty.max_px);
    CHECK(worker.failures() == 0);
  }
}

}  // namespace plumbline::board_kinds_capture_test
