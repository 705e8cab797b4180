// plumbline calibrate-lens with each kind of board and with impossible boards.
#include <catch2/catch.hpp>

#include "app/base/text/json_text.h"
#include "app/cli/commands.h"
#include "tests/app/cli/run_command.h"
#include "tests/app/temporary_folder.h"
#include "tests/app/vision/lens/rendered_views.h"
#include "tests/renderer/pgm.h"

namespace plumbline::calibrate_lens_boards_test {

using namespace plumbline::cli;
using test::Answer;
using test::RunCommand;

namespace {

/// A folder with one image of a board of shifted circles.
struct Images {
  test::TemporaryFolder folder;

  Images() {
    const target::Board board{4, 5, 0.02, target::BoardKind::kAsymmetricCircles, 0.015, {}};
    vision::Capture capture;
    capture.views = 1;
    const vision::DrawnView view = DrawViews(capture, board, 3).at(0);
    const auto shot = renderer::Render(view.camera, {view.sheet}, {}, 1);
    renderer::WritePgm(folder.path() + "/1.pgm", shot);
  }
  Answer Run(const std::string& arguments) const {
    return RunCommand(AddCalibrateLensCommand,
                      "calibrate-lens --images " + folder.path() + " " + arguments);
  }
};

}  // namespace

TEST_CASE("a kind of board is chosen, and one frame of it is not enough") {
  const Images images;
  const Answer answer =
      images.Run("--board-kind acircles --board 4x5 --square-mm 20 --mark-mm 15 --json - --quiet");
  INFO(answer.out << answer.err);
  CHECK(answer.exit_code == 0);
  const auto json = text::JsonOrNull(answer.out);
  CHECK(json["accepted"] == false);
  CHECK(json["board"]["kind"] == "acircles");
  CHECK(json["board"]["mark_mm"] == Approx(15));
  CHECK(json["frames_refused"].empty());  // the board was found
  CHECK(std::string(json["reasons"][0]).find("found in 1 usable frames") != std::string::npos);
}

TEST_CASE("another kind of board than shown: each frame reports what it shows") {
  const Images images;
  const Answer answer = images.Run("--board-kind charuco --board 9x6 --mark-mm 7 --json - --quiet");
  CHECK(answer.exit_code == 0);
  const auto json = text::JsonOrNull(answer.out);
  CHECK(json["frames_refused"][0]["reason"] == "no tag of aruco-6x6-250");
  CHECK(json["board"]["family"] == "aruco-6x6-250");
}

TEST_CASE("an impossible board is refused, naming the option to fix") {
  const Images images;
  const auto refused = [&](const std::string& arguments, const std::string& words) {
    const Answer answer = images.Run(arguments);
    INFO(answer.out << answer.err);
    CHECK(answer.exit_code == 2);
    CHECK((answer.out + answer.err).find(words) != std::string::npos);
  };
  refused("--board-kind hexagons", "--board-kind");
  refused("--board-kind charuco", "--mark-mm: a ChArUco board needs the side of its tags");
  refused("--board-kind circles", "--mark-mm: a board of circles needs their diameter");
  refused("--board-kind charuco --mark-mm 7 --family none", "--family");
  refused("--board 2x9",
          "--board: 2 x 9 points; a board must have 3 to 100 points in each direction");
  refused("--board nine", "is not COLUMNSxROWS");
}

}  // namespace plumbline::calibrate_lens_boards_test
