// BoardWorker with the real worker process and with misbehaving substitutes.
#include "app/vision/camera/board_worker.h"

#include <sys/stat.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <fstream>
#include <thread>

#include "tests/app/temporary_folder.h"
#include "tests/app/vision/lens/rendered_views.h"

namespace plumbline::board_worker_test {

using namespace plumbline::vision;
using plumbline::test::TemporaryFolder;

namespace {

/// Advances only when the test says so: the worker has low priority, so on a busy machine it starts
/// late.
double now_s = 0;
double OwnClock() {
  return now_s;
}

Result<vision::BoardView> Await(BoardWorker& worker) {
  for (int wait = 0; wait < 12000; ++wait) {
    if (auto answer = worker.Poll()) return *std::move(answer);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return Error{"the test's patience ended"};
}

renderer::Image DrawnBoard(const target::Board& board) {
  const vision::DrawnView view = DrawViews({}, board, 3).front();
  return renderer::Render(view.camera, {view.sheet}, {}, 1);
}

}  // namespace

TEST_CASE("the board is found by the worker process, in frames of changing size") {
  BoardWorker worker(PLUMBLINE, OwnClock);
  const target::Board board;
  CHECK(worker.idle());
  CHECK_FALSE(worker.Poll());
  const std::vector<std::uint8_t> black(64 * 48, 0);
  REQUIRE(worker.Submit({black.data(), 64, 48, 64}, board));
  CHECK_FALSE(worker.idle());
  const auto none = Await(worker);
  CHECK_THAT(none.error(), Catch::Contains("no chessboard"));
  const renderer::Image image = DrawnBoard(board);
  for (int frame = 0; frame < 3; ++frame) {
    REQUIRE(worker.Submit(test::ViewOf(image), board));
    const auto found = Await(worker);
    INFO((found ? "" : found.error()));
    REQUIRE(found);
    CHECK(found->corners_px.size() == static_cast<std::size_t>(board.corners()));
  }
  CHECK(worker.failures() == 0);
}

TEST_CASE("a worker that does not respond is killed at the deadline and replaced") {
  const TemporaryFolder folder;
  const std::string program = folder.path() + "/plumbline";
  std::ofstream(program) << "#!/bin/sh\n[ -e " << folder.path() << "/sound ] && exec " << PLUMBLINE
                         << " \"$@\"\nexec sleep 1000\n";
  chmod(program.c_str(), 0755);
  now_s = 0;
  BoardWorker worker(program, OwnClock);
  const target::Board board;
  const renderer::Image image = DrawnBoard(board);
  REQUIRE(worker.Submit(test::ViewOf(image), board));
  now_s = BoardWorker::kStartupDeadline_s - 1;
  CHECK_FALSE(worker.Poll());
  now_s = BoardWorker::kStartupDeadline_s + 1;
  const auto late = worker.Poll();
  REQUIRE(late);
  CHECK_THAT(late->error(), Catch::Contains("did not finish within"));
  CHECK(worker.failures() == 1);
  CHECK(worker.idle());

  std::ofstream(folder.path() + "/sound") << "1";
  REQUIRE(worker.Submit(test::ViewOf(image), board));
  REQUIRE(Await(worker));
  REQUIRE(worker.Submit(test::ViewOf(image), board));
  now_s += BoardWorker::kDeadline_s / 2;  // it has answered before: the short deadline holds
  CHECK(Await(worker).ok());
}

TEST_CASE("a program that cannot be started, or exits, is reported") {
  const target::Board board;
  const std::vector<std::uint8_t> black(64 * 48, 0);
  for (const char* program : {"/nonexistent/plumbline", "/bin/true"}) {
    BoardWorker worker(program, MonotonicSeconds);
    const auto context = worker.Submit({black.data(), 64, 48, 64}, board);
    const std::string why = context ? Await(worker).error() : context.error();
    CHECK_FALSE(why.empty());
    CHECK(worker.failures() == 1);
    CHECK(worker.idle());
  }
}

}  // namespace plumbline::board_worker_test
