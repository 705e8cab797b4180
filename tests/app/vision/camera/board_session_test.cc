#include "app/vision/camera/board_session.h"

#include <catch2/catch.hpp>
#include <random>

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/image/image_size.h"
#include "tests/app/vision/lens/rendered_views.h"

namespace plumbline::board_session_test {

using namespace plumbline::vision;

namespace {

constexpr image::ImageSize kSize{1920, 1080};

/// A user who holds the board and roughly follows the prompts.
class Operator {
 public:
  Operator(double f, std::uint64_t seed)
      : lens_(test::LensOfCamera(renderer::ZoomLens(f))), random_(seed) {}

  /// The next frame, 1/20 s later. The pose is kept for several frames, as by hand.
  vision::BoardView Next(lens::BoardPrompt prompt) {
    if (frame_ % 4 == 0) {
      X_ = PoseOfPrompt(prompt, board_, lens_, kSize);
      X_.R = X_.R * RotationFromVector(0.08 * Vec3(N(), N(), N()));
      X_.p +=
          0.03 * X_.p.z() * Vec3(kSize.width / lens_.fx * N(), kSize.height / lens_.fy * N(), N());
    }
    vision::BoardView view;
    view.time_s = 0.05 * frame_++;
    view.blur_px = 0.8;
    for (int k = 0; k < board_.corners(); ++k) {
      const lens::Vec2 at = board_.Corner(k);
      const Vec3 p = X_ * Vec3(at.x(), at.y(), 0);
      const lens::Vec2 pixel = Project<double>(lens_, p) + 0.04 * lens::Vec2(N(), N());
      view.corners_px.push_back(pixel);
      view.seen.push_back(pixel.x() > 5 && pixel.y() > 5 && pixel.x() < kSize.width - 6 &&
                          pixel.y() < kSize.height - 6);
    }
    return view;
  }
  const lens::Lens& lens() const { return lens_; }
  double time_s() const { return 0.05 * frame_; }

 private:
  double N() { return std::normal_distribution<double>(0, 1)(random_); }
  target::Board board_;
  lens::Lens lens_;
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
  const target::Board board;
  for (const double f : {1500.0, 5000.0}) {
    const lens::Lens lens = test::LensOfCamera(renderer::ZoomLens(f));
    const auto depth = [&](lens::BoardPrompt prompt, double x, double y) {
      const lens::Vec2 c = board.Centre();
      return (PoseOfPrompt(prompt, board, lens, kSize) * Vec3(c.x() + x, c.y() + y, 0)).z();
    };
    CHECK(depth(lens::BoardPrompt::kTiltLeft, -0.08, 0) <
          depth(lens::BoardPrompt::kTiltLeft, 0.08, 0));
    CHECK(depth(lens::BoardPrompt::kTiltRight, -0.08, 0) >
          depth(lens::BoardPrompt::kTiltRight, 0.08, 0));
    CHECK(depth(lens::BoardPrompt::kTiltUpper, 0, -0.05) <
          depth(lens::BoardPrompt::kTiltUpper, 0, 0.05));
    CHECK(depth(lens::BoardPrompt::kTiltLower, 0, -0.05) >
          depth(lens::BoardPrompt::kTiltLower, 0, 0.05));
    CHECK(depth(lens::BoardPrompt::kCloser, 0, 0) < depth(lens::BoardPrompt::kFarther, 0, 0));
    for (int code = 3; code <= 12; ++code) {
      CAPTURE(f, code);
      const auto prompt = static_cast<lens::BoardPrompt>(code);
      const Pose X = PoseOfPrompt(prompt, board, lens, kSize);
      CHECK(InformationOfView(board, vision::SharedOfLens(lens), X, kSize, 0.05));
      const lens::Vec2 middle =
          Project<double>(lens, X * Vec3(board.Centre().x(), board.Centre().y(), 0));
      if (prompt == lens::BoardPrompt::kUpperLeft) CHECK((middle.x() < 700 && middle.y() < 400));
      if (prompt == lens::BoardPrompt::kLowerRight) CHECK((middle.x() > 1200 && middle.y() > 680));
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
      CHECK(session.prompt() == lens::BoardPrompt::kNone);
      const auto& solved = *session.calibration();
      const double wrong = vision::LargestDifference(solved.lens, somebody.lens(), kSize);
      CHECK(wrong < 5 * solved.uncertainty.max_px);
      CHECK(session.oldest_s() == Approx(0));
    }
  }
}

TEST_CASE("a view that follows the prompt adds more information than repeating the last view") {
  Operator somebody(3000, 4);
  const target::Board board;
  std::vector<vision::BoardView> views;
  for (int k = 0; k < 6; ++k) {
    for (int i = 0; i < 4; ++i) {
      vision::BoardView view =
          somebody.Next(k < 3 ? lens::BoardPrompt::kTiltLeft : lens::BoardPrompt::kTiltUpper);
      if (i == 0) views.push_back(view);
    }
  }
  const auto worst = [&](lens::BoardPrompt prompt) {
    Operator next(3000, 9);
    std::vector<vision::BoardView> more = views;
    more.push_back(next.Next(prompt));
    more.back().time_s = 10;
    const auto fit = vision::FitLens(board, more, kSize);
    REQUIRE(fit);
    const vision::LensMatrix C =
        fit->covariance.topLeftCorner<vision::kLensCount, vision::kLensCount>();
    return vision::ProjectionUncertaintyOf(vision::LensFromShared(fit->shared), C, kSize).max_px;
  };
  const auto fit = vision::FitLens(board, views, kSize);
  REQUIRE(fit);
  const lens::BoardPrompt best = BestPrompt(board, *fit, kSize);
  CHECK(best != lens::BoardPrompt::kTiltLeft);
  CHECK(worst(best) < worst(lens::BoardPrompt::kTiltLeft));
  CHECK(BestPrompt(board, *fit, kSize, {best}) != best);
}

TEST_CASE("rejected views and their reasons") {
  Operator somebody(1700, 2);
  BoardSession session({}, kSize, 0);
  CHECK(session.prompt() == lens::BoardPrompt::kShowBoard);
  const vision::BoardView first = somebody.Next(lens::BoardPrompt::kTiltLeft);
  session.Take(first);
  CHECK(session.kept() == 1);
  CHECK(session.prompt() == lens::BoardPrompt::kTiltUpper);

  session.Take(somebody.Next(lens::BoardPrompt::kTiltLeft));
  CHECK(session.kept() == 1);
  CHECK_THAT(session.rejection(), Catch::Contains("too similar"));

  vision::BoardView moved = somebody.Next(lens::BoardPrompt::kTiltLeft);
  for (lens::Vec2& corner : moved.corners_px) corner.x() += 200;
  session.Take(moved);
  CHECK_THAT(session.rejection(), Catch::Contains("moved by 200"));
  CHECK(session.prompt() == lens::BoardPrompt::kHoldStill);

  vision::BoardView blurred = somebody.Next(lens::BoardPrompt::kTiltLeft);
  blurred.blur_px = 4;
  session.Take(blurred);
  CHECK_THAT(session.rejection(), Catch::Contains("blurred"));
  CHECK(session.prompt() == lens::BoardPrompt::kHoldStill);

  session.TakeFailure("only a part of the board", 0.25);
  CHECK(session.prompt() == lens::BoardPrompt::kShowBoard);
  CHECK(session.kept() == 1);
}

TEST_CASE("a prompt that brings no new view is replaced by another") {
  Operator somebody(1700, 6);
  BoardSession session({}, kSize, 0);
  while (session.kept() < 4) session.Take(somebody.Next(session.prompt()));
  vision::BoardView view = somebody.Next(session.prompt());
  while (session.kept() < 5) session.Take(view = somebody.Next(session.prompt()));
  const lens::BoardPrompt stuck = session.prompt();
  int frames = 0;
  for (; frames < 200 && session.prompt() == stuck; ++frames) {
    view.time_s += 0.05;
    session.Take(view);
  }
  CHECK(session.prompt() != stuck);
  CHECK(session.prompt() != lens::BoardPrompt::kHoldStill);
  CHECK(frames > 10);
  CHECK(session.kept() == 5);
}

TEST_CASE("a board that is never moved: refused at the timeout, with the reason") {
  Operator somebody(1700, 3);
  BoardSession session({}, kSize, 0);
  const vision::BoardView view = somebody.Next(lens::BoardPrompt::kTiltLeft);
  double time_s = 0;
  for (; session.state() == BoardSession::State::kCapturing && time_s < 1000; time_s += 0.05) {
    vision::BoardView same = view;
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
    vision::BoardView view = somebody.Next(session.prompt());
    const double grown = 1 + 1e-4 * frames;
    for (lens::Vec2& p : view.corners_px) {
      p = (lens::Vec2(959.5, 539.5) + grown * (p - lens::Vec2(959.5, 539.5))).eval();
    }
    session.Take(view);
  }
  CHECK(session.state() == BoardSession::State::kRefused);
  REQUIRE_FALSE(session.reasons().empty());
  CHECK(session.kept() < 40);
}

}  // namespace plumbline::board_session_test
