#include "app/vision/camera/next_view.h"

#include <catch2/catch.hpp>

#include "app/vision/lens/lens_fit.h"
#include "app/vision/lens/projection_uncertainty.h"
#include "firmware-like/geometry/rotation.h"
#include "tests/app/vision/lens/rendered_views.h"

namespace plumbline::next_view_test {

using namespace plumbline::vision;

namespace {

constexpr image::ImageSize kSize{1920, 1080};

std::vector<BoardView> SomeViews(int count, Capture::Kind kind = Capture::Kind::kVaried) {
  Capture capture;
  capture.views = count;
  capture.kind = kind;
  return NoisyViews(DrawViews(capture, {}, 5), {}, 0.05, 5);
}

/// The pose turned by a rotation vector about the board's centre, which is moved.
Pose Moved(const Pose& X, const Vec3& turn, const Vec3& shift_C) {
  const target::Board board;
  const Vec3 centre_K(board.Centre().x(), board.Centre().y(), 0);
  const Vec3 centre_C = X * centre_K + shift_C;
  const Mat3 R = RotationFromVector(turn) * X.R;
  return {R, centre_C - R * centre_K};
}

lens::BoardPrompt Instruction(const Pose& X_wanted, const Pose& X_seen, const lens::Lens& lens) {
  const HandCorrection correction = CorrectionTowards(X_wanted, X_seen, {}, lens, kSize);
  return PartsOf(correction)[PartToCorrect(correction, std::nullopt)].instruction;
}

}  // namespace

TEST_CASE("the information of a view is that of the fit") {
  const target::Board board;
  const std::vector<BoardView> views = SomeViews(6);
  const auto fit = FitLens(board, views, kSize);
  REQUIRE(fit);
  for (std::size_t j = 0; j < views.size(); ++j) {
    const auto information = InformationOfView(board, fit->shared, fit->X_CK[j], fit->sigma_px);
    REQUIRE(information);
    const SharedMatrix& fitted = fit->view_information[j].information;
    CHECK((*information - fitted).norm() < 1e-6 * fitted.norm());
  }
}

TEST_CASE("the weight gives the mean variance of the projection") {
  const lens::Lens lens = test::LensOfCamera(renderer::ZoomLens(1700));
  lens::LensCovariance covariance = lens::LensCovariance::Zero();
  covariance(1, 1) = 4;  // fy: moves pixels vertically, in its worst direction
  const auto weighted = ProjectionWeight(lens, kSize).cwiseProduct(covariance).sum();
  double mean = 0;
  const ProjectionUncertainty uncertainty = ProjectionUncertaintyOf(lens, covariance, kSize);
  for (const double sd_px : uncertainty.sd_px)
    mean += sd_px * sd_px / static_cast<double>(uncertainty.sd_px.size());
  CHECK(weighted == Approx(mean).epsilon(1e-3));
}

TEST_CASE("candidates are inside the image, for wide and long lenses, before and after a fit") {
  for (const double f : {1000.0, 1700.0, 6000.0}) {
    const lens::Lens lens = test::LensOfCamera(renderer::ZoomLens(f));
    const std::vector<Pose> poses = CandidatePoses({}, lens, kSize);
    CAPTURE(f, poses.size());
    CHECK(poses.size() > 100);
    for (const Pose& X_CK : poses) {
      for (const lens::Vec2& p : OutlineOf({}, lens, X_CK)) {
        CHECK((p.x() > 0 && p.y() > 0 && p.x() < kSize.width && p.y() < kSize.height));
      }
    }
  }
}

TEST_CASE("the chosen view reduces the uncertainty more than another one or a repeated one") {
  const target::Board board;
  const std::vector<BoardView> views = SomeViews(5, Capture::Kind::kBurst);
  NextViewChoice choice(board, KnowledgeFrom(board, views, kSize), kSize, std::nullopt);
  const auto repeated = choice.SeenAt(views.back());
  REQUIRE(repeated);
  CHECK(choice.GainAt(*repeated) > 0);
  CHECK(choice.gain() > 2 * choice.GainAt(*repeated));
  CHECK(choice.gain() == Approx(choice.GainAt(choice.X_CK())));
  const int until = choice.ViewsUntil(0.5, 30);
  CHECK(until >= 1);
  CHECK(until < 10);
  CHECK(choice.ViewsUntil(1000, 30) == 0);
  CHECK(choice.ViewsUntil(1e-6, 30) == 30);

  const Pose first = choice.X_CK();
  const double gain = choice.gain();
  choice.ChooseAnother();
  CHECK(choice.gain() < gain);
  CHECK(choice.gain() > 0);
  const HandCorrection correction =
      CorrectionTowards(choice.X_CK(), first, board, choice.lens(), kSize);
  CHECK(PartsOf(correction)[PartToCorrect(correction, std::nullopt)].size > 1);
}

TEST_CASE("without views, a tilted board is wanted; each view adds to what is known") {
  const target::Board board;
  const NextViewChoice first(board, KnowledgeFrom(board, {}, kSize), kSize, std::nullopt);
  const Vec3 normal_C = first.X_CK().R.col(2);
  CHECK(normal_C.z() < std::cos(0.25));
  double before =
      ProjectionUncertaintyOf(first.lens(), first.knowledge().covariance(), kSize).max_px;
  CHECK(before > 20);
  const std::vector<BoardView> views = SomeViews(4);
  for (std::size_t count = 1; count <= views.size(); ++count) {
    const LensKnowledge knowledge = KnowledgeFrom(board, std::span(views).first(count), kSize);
    const double after =
        ProjectionUncertaintyOf(LensFromShared(knowledge.shared), knowledge.covariance(), kSize)
            .max_px;
    CAPTURE(count, before, after);
    CHECK(after < before);
    before = after;
  }
}

TEST_CASE("the instruction leads from the board that is seen to the one that is wanted") {
  using lens::BoardPrompt;
  const lens::Lens lens = test::LensOfCamera(renderer::ZoomLens(1700));
  const Pose wanted = Moved({Mat3::Identity(), Vec3(-0.08, -0.05, 0)}, {0.2, -0.3, 0}, {0, 0, 0.4});
  const auto from = [&](const Vec3& turn, const Vec3& shift_C) {
    return Instruction(wanted, Moved(wanted, turn, shift_C), lens);
  };
  const Vec3 none = Vec3::Zero();
  CHECK(from(none, {-0.1, 0, 0}) == BoardPrompt::kRight);
  CHECK(from(none, {0.1, 0, 0}) == BoardPrompt::kLeft);
  CHECK(from(none, {0, -0.1, 0}) == BoardPrompt::kDown);
  CHECK(from(none, {0, 0.1, 0}) == BoardPrompt::kUp);
  CHECK(from(none, {0.1, 0.1, 0}) == BoardPrompt::kUpperLeft);
  CHECK(from(none, {-0.1, 0.1, 0}) == BoardPrompt::kUpperRight);
  CHECK(from(none, {0.1, -0.1, 0}) == BoardPrompt::kLowerLeft);
  CHECK(from(none, {-0.1, -0.1, 0}) == BoardPrompt::kLowerRight);
  CHECK(from(none, {0, 0, 0.2}) == BoardPrompt::kCloser);
  CHECK(from(none, {0, 0, -0.2}) == BoardPrompt::kFarther);
  CHECK(from({0, 0.4, 0}, none) == BoardPrompt::kTiltLeft);
  CHECK(from({0, -0.4, 0}, none) == BoardPrompt::kTiltRight);
  CHECK(from({-0.4, 0, 0}, none) == BoardPrompt::kTiltUpper);
  CHECK(from({0.4, 0, 0}, none) == BoardPrompt::kTiltLower);
  CHECK(from({0, 0, -0.5}, none) == BoardPrompt::kClockwise);
  CHECK(from({0, 0, 0.5}, none) == BoardPrompt::kCounterclockwise);

  // A part that has been begun is finished before a larger one.
  const HandCorrection both =
      CorrectionTowards(wanted, Moved(wanted, {0, 0.2, 0}, {0.2, 0, 0}), {}, lens, kSize);
  CHECK(PartToCorrect(both, std::nullopt) == 0);
  CHECK(PartToCorrect(both, 2) == 2);
  CHECK(PartToCorrect(both, 1) == 0);
}

TEST_CASE("an outline starts with the upper edge and is closed") {
  const lens::Lens lens = test::LensOfCamera(renderer::ZoomLens(1700));
  const std::vector<lens::Vec2> outline =
      OutlineOf({}, lens, {Mat3::Identity(), Vec3(-0.08, -0.05, 0.4)});
  REQUIRE(outline.size() == 17);
  CHECK((outline.front() - outline.back()).norm() < 1e-9);
  CHECK(outline[0].x() < outline[4].x());
  CHECK(outline[4].y() < outline[8].y());
  CHECK(outline[12].x() == Approx(outline[0].x()).margin(3));
}

}  // namespace plumbline::next_view_test
