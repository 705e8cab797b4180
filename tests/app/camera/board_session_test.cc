#include "app/camera/board_session.h"

#include <catch2/catch.hpp>
#include <random>

#include "app/camera/view_gain.h"
#include "firmware-like/geometry/rotation.h"
#include "tests/app/lens/rendered_views.h"

using namespace plumbline;

namespace {

constexpr ImageSize kSize{1920, 1080};

/// A user who holds the board and roughly follows the prompts.
class Operator {
 public:
  Operator(double f, std::uint64_t seed) : lens_(TrueLens(renderer::ZoomLens(f))), random_(seed) {}

  /// The next frame, 1/20 s later. The pose is kept for several frames, as by hand.
  BoardView Next(BoardPrompt prompt) {
    if (frame_ % 4 == 0) {
      X_ = PoseOfPrompt(prompt, board_, lens_, kSize);
      X_.R = X_.R * RotationFromVector(0.08 * Vec3(N(), N(), N()));
      X_.p +=
          0.03 * X_.p.z() * Vec3(kSize.width / lens_.fx * N(), kSize.height / lens_.fy * N(), N());
    }
    BoardView view;
    view.time_s = 0.05 * frame_++;
    view.blur_px = 0.8;
    for (int k = 0; k < board_.corners(); ++k) {
      const Vec2 at = board_.Corner(k);
      const Vec3 p = X_ * Vec3(at.x(), at.y(), 0);
      const Vec2 pixel = Project<double>(lens_, p) + 0.04 * Vec2(N(), N());
      view.corners_px.push_back(pixel);
      view.seen.push_back(pixel.x() > 5 && pixel.y() > 5 && pixel.x() < kSize.width - 6 &&
                          pixel.y() < kSize.height - 6);
    }
    return view;
  }
  const Lens& lens() const { return lens_; }
  double time_s() const { return 0.05 * frame_; }

 private:
  double N() { return std::normal_distribution<double>(0, 1)(random_); }
  Board board_;
  Lens lens_;
  Pose X_;
  int frame_ = 0;
  std::mt19937_64 random_;
};

int FramesUntilDone(BoardSession& session, Operator& somebody, int most) {
  int frames = 0;
  for (; frames < most && session.state() == BoardSession::State::kCapturing; ++frames) {
    session.Take(somebody.Next(session.prompt()));
  }
  return frames;
}

}  // namespace

TEST_CASE("each prompt's pose matches its text, and the whole board is in the image") {
  const Board board;
  for (const double f : {1500.0, 5000.0}) {
    const Lens lens = TrueLens(renderer::ZoomLens(f));
    const auto depth = [&](BoardPrompt prompt, double x, double y) {
      const Vec2 c = board.Centre();
      return (PoseOfPrompt(prompt, board, lens, kSize) * Vec3(c.x() + x, c.y() + y, 0)).z();
    };
    CHECK(depth(BoardPrompt::kTiltLeft, -0.08, 0) < depth(BoardPrompt::kTiltLeft, 0.08, 0));
    CHECK(depth(BoardPrompt::kTiltRight, -0.08, 0) > depth(BoardPrompt::kTiltRight, 0.08, 0));
    CHECK(depth(BoardPrompt::kTiltUpper, 0, -0.05) < depth(BoardPrompt::kTiltUpper, 0, 0.05));
    CHECK(depth(BoardPrompt::kTiltLower, 0, -0.05) > depth(BoardPrompt::kTiltLower, 0, 0.05));
    CHECK(depth(BoardPrompt::kCloser, 0, 0) < depth(BoardPrompt::kFarther, 0, 0));
    for (int code = 3; code <= 12; ++code) {
      CAPTURE(f, code);
      const auto prompt = static_cast<BoardPrompt>(code);
      const Pose X = PoseOfPrompt(prompt, board, lens, kSize);
      CHECK(InformationOfView(board, SharedOfLens(lens), X, kSize, 0.05));
      const Vec2 middle =
          Project<double>(lens, X * Vec3(board.Centre().x(), board.Centre().y(), 0));
      if (prompt == BoardPrompt::kUpperLeft) CHECK((middle.x() < 700 && middle.y() < 400));
      if (prompt == BoardPrompt::kLowerRight) CHECK((middle.x() > 1200 && middle.y() > 680));
    }
  }
}

TEST_CASE("following the prompts gives a lens as accurate as its stated uncertainty") {
  for (const double f : {1700.0, 5000.0}) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      Operator somebody(f, seed);
      BoardSession session({}, kSize, 0);
      const int frames = FramesUntilDone(session, somebody, 2000);
      CAPTURE(f, seed, frames, session.kept(), session.rejection());
      REQUIRE(session.state() == BoardSession::State::kAccepted);
      CHECK(session.kept() <= 30);
      CHECK(session.prompt() == BoardPrompt::kNone);
      const auto& solved = *session.calibration();
      const double wrong = LargestDifference(solved.lens, somebody.lens(), kSize);
      CHECK(wrong < 5 * solved.uncertainty.max_px);
      CHECK(session.oldest_s() == Approx(0));
    }
  }
}

TEST_CASE("a view that follows the prompt adds more information than repeating the last view") {
  Operator somebody(3000, 4);
  const Board board;
  std::vector<BoardView> views;
  for (int k = 0; k < 6; ++k) {
    for (int i = 0; i < 4; ++i) {
      BoardView view = somebody.Next(k < 3 ? BoardPrompt::kTiltLeft : BoardPrompt::kTiltUpper);
      if (i == 0) views.push_back(view);
    }
  }
  const auto worst = [&](BoardPrompt prompt) {
    Operator next(3000, 9);
    std::vector<BoardView> more = views;
    more.push_back(next.Next(prompt));
    more.back().time_s = 10;
    const auto fit = FitLens(board, more, kSize);
    REQUIRE(fit);
    const LensMatrix C = fit->covariance.topLeftCorner<kLensCount, kLensCount>();
    return ProjectionUncertaintyOf(LensFromShared(fit->shared), C, kSize).max_px;
  };
  const auto fit = FitLens(board, views, kSize);
  REQUIRE(fit);
  const BoardPrompt best = BestPrompt(board, *fit, kSize);
  CHECK(best != BoardPrompt::kTiltLeft);
  CHECK(worst(best) < worst(BoardPrompt::kTiltLeft));
  CHECK(BestPrompt(board, *fit, kSize, {best}) != best);
}

TEST_CASE("rejected views and their reasons") {
  Operator somebody(1700, 2);
  BoardSession session({}, kSize, 0);
  CHECK(session.prompt() == BoardPrompt::kShowBoard);
  const BoardView first = somebody.Next(BoardPrompt::kTiltLeft);
  session.Take(first);
  CHECK(session.kept() == 1);
  CHECK(session.prompt() == BoardPrompt::kTiltUpper);

  session.Take(somebody.Next(BoardPrompt::kTiltLeft));
  CHECK(session.kept() == 1);
  CHECK_THAT(session.rejection(), Catch::Contains("too similar"));

  BoardView moved = somebody.Next(BoardPrompt::kTiltLeft);
  for (Vec2& corner : moved.corners_px) corner.x() += 200;
  session.Take(moved);
  CHECK_THAT(session.rejection(), Catch::Contains("moved by 200"));
  CHECK(session.prompt() == BoardPrompt::kHoldStill);

  BoardView blurred = somebody.Next(BoardPrompt::kTiltLeft);
  blurred.blur_px = 4;
  session.Take(blurred);
  CHECK_THAT(session.rejection(), Catch::Contains("blurred"));
  CHECK(session.prompt() == BoardPrompt::kHoldStill);

  session.TakeFailure("only a part of the board", 0.25);
  CHECK(session.prompt() == BoardPrompt::kShowBoard);
  CHECK(session.kept() == 1);
}

TEST_CASE("a prompt that brings no new view is replaced by another") {
  Operator somebody(1700, 6);
  BoardSession session({}, kSize, 0);
  while (session.kept() < 4) session.Take(somebody.Next(session.prompt()));
  BoardView view = somebody.Next(session.prompt());
  while (session.kept() < 5) session.Take(view = somebody.Next(session.prompt()));
  const BoardPrompt stuck = session.prompt();
  int frames = 0;
  for (; frames < 200 && session.prompt() == stuck; ++frames) {
    view.time_s += 0.05;
    session.Take(view);
  }
  CHECK(session.prompt() != stuck);
  CHECK(session.prompt() != BoardPrompt::kHoldStill);
  CHECK(frames > 10);
  CHECK(session.kept() == 5);
}

TEST_CASE("a board that is never moved: refused at the timeout, with the reason") {
  Operator somebody(1700, 3);
  BoardSession session({}, kSize, 0);
  const BoardView view = somebody.Next(BoardPrompt::kTiltLeft);
  double time_s = 0;
  for (; session.state() == BoardSession::State::kCapturing && time_s < 1000; time_s += 0.05) {
    BoardView same = view;
    same.time_s = time_s;
    session.Take(same);
  }
  CHECK(session.state() == BoardSession::State::kRefused);
  CHECK(time_s == Approx(BoardSettings{}.patience_s).margin(0.1));
  REQUIRE_FALSE(session.reasons().empty());
  CHECK_THAT(session.reasons().back(), Catch::Contains("1 views kept"));
}

TEST_CASE("a lens that creeps during the capture is refused at once: further views cannot help") {
  BoardSession session({}, kSize, 0);
  Operator somebody(1700, 5);
  int frames = 0;
  for (; frames < 2000 && session.state() == BoardSession::State::kCapturing; ++frames) {
    BoardView view = somebody.Next(session.prompt());
    const double grown = 1 + 1e-4 * frames;
    for (Vec2& p : view.corners_px) {
      p = (Vec2(959.5, 539.5) + grown * (p - Vec2(959.5, 539.5))).eval();
    }
    session.Take(view);
  }
  CHECK(session.state() == BoardSession::State::kRefused);
  REQUIRE_FALSE(session.reasons().empty());
  CHECK(session.kept() < 40);
}
