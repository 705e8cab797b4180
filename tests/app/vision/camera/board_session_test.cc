#include "app/vision/camera/board_session.h"

#include <catch2/catch.hpp>
#include <random>

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/image/image_size.h"
#include "tests/app/vision/camera/camera_scene.h"

namespace plumbline::board_session_test {

using namespace plumbline::vision;

namespace {

constexpr image::ImageSize kSize{1920, 1080};

/// A person who brings the board to the outline, and holds it there for a few frames, 1/20 s each.
class Operator {
 public:
  Operator(double f, std::uint64_t seed)
      : lens_(test::LensOfCamera(renderer::ZoomLens(f))), random_(seed) {}

  vision::BoardView Next(const BoardSession& session) {
    if (frame_ % 4 == 0) {
      X_ = test::PoseOfOutline(session.guidance().wanted_px, board_, lens_);
      const Vec3 centre_K(board_.Centre().x(), board_.Centre().y(), 0);
      Vec3 centre_C = X_ * centre_K;
      centre_C += 0.02 * centre_C.z() *
                  Vec3(kSize.width / lens_.fx * N(), kSize.height / lens_.fy * N(), N());
      X_.R = RotationFromVector(0.08 * Vec3(N(), N(), N())) * X_.R;
      X_.p = centre_C - X_.R * centre_K;
    }
    return Same();
  }
  /// Without moving.
  vision::BoardView Same() {
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
  void HoldAt(const Pose& X_CK) { X_ = X_CK; }
  const lens::Lens& lens() const { return lens_; }

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
    session.Take(somebody.Next(session));
  }
  return frames;
}

}  // namespace

TEST_CASE("following the outlines gives a lens as accurate as its stated uncertainty") {
  for (const double f : {1700.0, 5000.0}) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      Operator somebody(f, seed);
      BoardSession session({}, kSize, 0);
      const int frames = FramesUntilDone(session, somebody, 2000);
      CAPTURE(f, seed, frames, session.kept(), session.rejection());
      REQUIRE(session.state() == BoardSession::State::kAccepted);
      CHECK(session.kept() <= 15);
      CHECK(session.guidance().wanted_px.empty());
      CHECK(session.prompt() == lens::BoardPrompt::kNone);
      const auto& solved = *session.calibration();
      const double wrong = vision::LargestDifference(solved.lens, somebody.lens(), kSize);
      CHECK(wrong < 5 * solved.uncertainty.max_px);
      CHECK(session.oldest_s() == Approx(0));
    }
  }
}

TEST_CASE("rejected views, their reasons and the instruction") {
  Operator somebody(1700, 2);
  BoardSession session({}, kSize, 0);
  CHECK(session.prompt() == lens::BoardPrompt::kShowBoard);
  CHECK_FALSE(session.guidance().wanted_px.empty());
  session.Take(somebody.Next(session));
  CHECK(session.kept() == 1);
  CHECK(session.guidance().views == 1);
  CHECK(session.guidance().expected_views >= 6);

  session.Take(somebody.Same());
  CHECK(session.kept() == 1);
  CHECK_THAT(session.rejection(), Catch::Contains("too similar"));
  CHECK(session.prompt() > lens::BoardPrompt::kHoldStill);
  CHECK_FALSE(session.guidance().met);
  CHECK_FALSE(session.guidance().seen_px.empty());

  SECTION("where it is wanted, a board only has to be held still") {
    for (int k = 0; k < 3; ++k) somebody.Next(session);
    vision::BoardView moving = somebody.Same();
    somebody.HoldAt(test::PoseOfOutline(session.guidance().wanted_px, {}, somebody.lens()));
    vision::BoardView there = somebody.Same();
    session.Take(moving);
    session.Take(there);
    CHECK(session.guidance().met);
    CHECK(session.prompt() == lens::BoardPrompt::kHoldStill);
    CHECK_THAT(session.rejection(), Catch::Contains("since the previous frame"));
    CHECK(session.kept() == 1);
    session.Take(somebody.Same());
    CHECK(session.kept() == 2);

    vision::BoardView blurred = somebody.Next(session);
    blurred.blur_px = 4;
    blurred.time_s += 1;
    session.Take(blurred);
    CHECK(session.kept() == 2);
  }
  SECTION("a board that is not seen") {
    session.TakeFailure("only a part of the board", 0.25);
    CHECK(session.prompt() == lens::BoardPrompt::kShowBoard);
    CHECK(session.guidance().seen_px.empty());
    CHECK(session.kept() == 1);
  }
}

TEST_CASE("an outline where the board never comes is replaced by another") {
  Operator somebody(1700, 6);
  BoardSession session({}, kSize, 0);
  while (session.kept() < 5) session.Take(somebody.Next(session));
  const std::vector<lens::Vec2> stuck = session.guidance().wanted_px;
  double waited_s = 0;
  for (; waited_s < 60 && session.guidance().wanted_px == stuck; waited_s += 0.05)
    session.Take(somebody.Same());
  CHECK(session.guidance().wanted_px != stuck);
  CHECK(waited_s > 5);
  CHECK(session.kept() == 5);
}

TEST_CASE("a board that is never moved: refused at the timeout, with the reason") {
  Operator somebody(1700, 3);
  BoardSession session({}, kSize, 0);
  const vision::BoardView view = somebody.Next(session);
  double time_s = 0;
  for (; session.state() == BoardSession::State::kCapturing && time_s < 1000; time_s += 0.05) {
    vision::BoardView same = view;
    same.time_s = time_s;
    session.Take(same);
  }
  CHECK(session.state() == BoardSession::State::kRefused);
  CHECK(time_s == Approx(BoardSettings{}.patience_s).margin(0.1));
  REQUIRE_FALSE(session.reasons().empty());
  CHECK_THAT(session.reasons().back(), Catch::Contains("1 view kept"));
}

TEST_CASE("a lens that creeps during the capture is refused at once: further views cannot help") {
  BoardSession session({}, kSize, 0);
  Operator somebody(1700, 5);
  int frames = 0;
  for (; frames < 2000 && session.state() == BoardSession::State::kCapturing; ++frames) {
    vision::BoardView view = somebody.Next(session);
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
