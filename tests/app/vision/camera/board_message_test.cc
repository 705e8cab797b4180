#include "app/vision/camera/board_message.h"

#include <catch2/catch.hpp>
#include <random>

namespace plumbline::board_message_test {

using namespace plumbline::vision;

TEST_CASE("requests and responses survive a round trip") {
  for (const target::Board& board :
       {target::Board{},
        target::Board{9, 6, 0.02, target::BoardKind::kCharuco, 0.015, "aruco-5x5-100"},
        target::Board{4, 11, 0.02, target::BoardKind::kAsymmetricCircles, 0.015, {}}}) {
    const auto read = DecodeRequest(EncodeRequest({1920, 1080, board}));
    REQUIRE(read);
    CHECK(read->width == 1920);
    CHECK(WordsOf(read->board) == WordsOf(board));
    CHECK(read->board.family == board.family);
  }
  CHECK_FALSE(DecodeRequest(
      EncodeRequest({640, 480, {9, 6, 0.02, target::BoardKind::kCharuco, 0.015, "no family"}})));
  CHECK_FALSE(
      DecodeRequest(EncodeRequest({640, 480, {9, 6, 0.02, target::BoardKind::kCircles, 0, {}}})));

  vision::BoardView view;
  view.blur_px = 0.9;
  view.corners_px = {{1.5, 2.5}, {NAN, 7}, {-3, 4}};
  view.seen = {true, false, true};
  const auto answer = DecodeResponse(EncodeResponse(Result<vision::BoardView>(view)));
  REQUIRE(answer);
  REQUIRE(answer->ok());
  CHECK((*answer)->seen == view.seen);
  CHECK((*answer)->corners_px[2] == view.corners_px[2]);
  CHECK((*answer)->blur_px == 0.9);
  view.blur_px = -1;
  CHECK_FALSE(DecodeResponse(EncodeResponse(Result<vision::BoardView>(view))));
  const auto none =
      DecodeResponse(EncodeResponse(Result<vision::BoardView>(Error{"no chessboard"})));
  REQUIRE(none);
  CHECK(none->error() == "no chessboard");
}

TEST_CASE("truncated or corrupted messages are refused or decode to valid values") {
  vision::BoardView view;
  view.corners_px.assign(187, lens::Vec2(10, 20));
  view.seen.assign(187, true);
  const Bytes sound = EncodeResponse(Result<vision::BoardView>(view));
  for (std::size_t length = 1; length < sound.size(); ++length) {
    CHECK_FALSE(DecodeResponse(std::span(sound).first(length)));
  }
  const Bytes request =
      EncodeRequest({640, 480, {9, 6, 0.02, target::BoardKind::kCharuco, 0.015, "aruco-5x5-100"}});
  for (std::size_t length = 0; length < request.size(); ++length) {
    CHECK_FALSE(DecodeRequest(std::span(request).first(length)));
  }
  std::mt19937_64 random(5);
  for (int trial = 0; trial < 20000; ++trial) {
    Bytes changed = trial % 2 == 0 ? sound : request;
    for (int k = 0; k < 4; ++k) {
      changed[random() % changed.size()] = static_cast<std::uint8_t>(random());
    }
    if (const auto answer = DecodeResponse(changed); answer && *answer) {
      CHECK((*answer)->corners_px.size() == (*answer)->seen.size());
    }
    if (const auto read = DecodeRequest(changed)) CHECK((read->width > 0 && !FaultOf(read->board)));
  }
}

}  // namespace plumbline::board_message_test
