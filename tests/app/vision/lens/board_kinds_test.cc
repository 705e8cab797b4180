// Detection of rendered ChArUco boards and circle grids against ground truth, and mix-ups of
// boards.
#include <catch2/catch.hpp>
#include <numeric>

#include "app/vision/lens/board_detection.h"
#include "app/vision/lens/calibration.h"
#include "app/vision/lens/disc_offsets.h"
#include "firmware-like/image/image_size.h"
#include "tests/app/vision/lens/rendered_views.h"

namespace plumbline::board_kinds_test {

using namespace plumbline::vision;

namespace {

using test::ViewOf;

constexpr image::ImageSize kSize{1920, 1080};
constexpr std::size_t kPixels = std::size_t{1920} * 1080;

/// 10 x 7 squares of 20 mm with tags of 15 mm, as such boards are usually printed.
target::Board Charuco() {
  return {9, 6, 0.020, target::BoardKind::kCharuco, 0.015, "aruco-5x5-100"};
}
/// 11 x 7 discs of 12 mm, 20 mm apart.
target::Board Circles() {
  return {11, 7, 0.020, target::BoardKind::kCircles, 0.012, {}};
}
/// OpenCV's asymmetric pattern: rows of 4, every other one shifted.
target::Board Shifted() {
  return {4, 11, 0.020, target::BoardKind::kAsymmetricCircles, 0.015, {}};
}

/// True image positions of the board's points; for discs, the centres of their images.
std::vector<lens::Vec2> TruePoints(const DrawnView& view, const target::Board& board) {
  SharedVector shared = SharedOfLens(test::LensOfCamera(view.camera));
  std::vector<lens::Vec2> points = TrueCorners(view, board);
  const Pose X_CK{view.sheet.X_CK.linear(), view.sheet.X_CK.translation()};
  const std::vector<lens::Vec2> offsets = DiscOffsets(board, shared, X_CK);
  for (std::size_t k = 0; k < points.size(); ++k) points[k] += offsets[k];
  return points;
}

struct Errors {
  double rms_px = 0;
  double worst_px = 0;
  int seen = 0;
};

Errors ErrorsOf(const BoardView& view, const std::vector<lens::Vec2>& truth) {
  Errors errors;
  for (std::size_t k = 0; k < truth.size(); ++k) {
    if (!view.seen[k]) continue;
    const double error = (view.corners_px[k] - truth[k]).norm();
    errors.rms_px += 0.5 * error * error;
    errors.worst_px = std::max(errors.worst_px, error);
    ++errors.seen;
  }
  errors.rms_px = std::sqrt(errors.rms_px / std::max(1, errors.seen));
  return errors;
}

/// A grid with half-turn symmetry may be numbered from its other end.
Errors BetterErrors(const BoardView& view, std::vector<lens::Vec2> truth) {
  const Errors as_is = ErrorsOf(view, truth);
  std::reverse(truth.begin(), truth.end());
  const Errors turned = ErrorsOf(view, truth);
  return as_is.rms_px < turned.rms_px ? as_is : turned;
}

renderer::Image Drawn(const DrawnView& view, std::uint64_t seed,
                      const renderer::Conditions& light = {}) {
  return renderer::Render(view.camera, {view.sheet}, light, seed);
}

/// A tilted view from the front in which the board fills `share` of the image width.
DrawnView Tilted(const target::Board& board, double tilt, double share, double roll = 0.1) {
  DrawnView view{renderer::ZoomLens(1700), {}};
  const lens::Vec2 centre = board.Centre();
  view.sheet.print = PrintOf(board);
  view.sheet.half_width_m = centre.x() + 2.5 * board.square_m;
  view.sheet.half_height_m = centre.y() + 2.5 * board.square_m;
  view.sheet.centre_x_m = centre.x();
  view.sheet.centre_y_m = centre.y();
  const double z = 1700 * 2 * centre.x() / (1920 * share);
  view.sheet.X_CK = Eigen::Translation3d(0, 0, z) *
                    Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()) *
                    Eigen::AngleAxisd(tilt, Eigen::Vector3d(0.8, 0.6, 0)) *
                    Eigen::Translation3d(-centre.x(), -centre.y(), 0);
  return view;
}

}  // namespace

TEST_CASE("each kind of board is found from many directions, to a few hundredths of a pixel") {
  for (const target::Board& board : {Charuco(), Circles(), Shifted()}) {
    REQUIRE_FALSE(FaultOf(board));
    Capture capture;
    capture.views = 6;
    int k = 0;
    for (const DrawnView& view : DrawViews(capture, board, 21)) {
      const renderer::Image image = Drawn(view, 70 + k);
      const auto found = DetectBoard(ViewOf(image), board);
      INFO(NameOf(board.kind) << ", view " << k++ << ": " << (found ? "" : found.error()));
      REQUIRE(found);
      const Errors errors = board.kind == target::BoardKind::kCircles
                                ? BetterErrors(*found, TruePoints(view, board))
                                : ErrorsOf(*found, TruePoints(view, board));
      CHECK(errors.seen >= 0.85 * board.corners());  // discs at the image's edge are not whole
      INFO("rms " << errors.rms_px << " worst " << errors.worst_px);
      CHECK(errors.rms_px < 0.06);
      CHECK(errors.worst_px < 0.25);
      CHECK(found->blur_px == Approx(0.9).margin(0.35));
    }
  }
}

TEST_CASE("ChArUco corners are identified in any rotation and if only a part is visible") {
  const target::Board board = Charuco();
  for (const double roll : {0.0, 1.6, 3.1, 4.7}) {
    const DrawnView view = Tilted(board, 0.4, 0.5, roll);
    const auto found = DetectBoard(ViewOf(Drawn(view, 3)), board);
    INFO("roll " << roll);
    REQUIRE(found);
    CHECK(ErrorsOf(*found, TruePoints(view, board)).worst_px < 0.25);
  }
  // Half of the board lies beyond the image's edge.
  DrawnView part = Tilted(board, 0.4, 0.6);
  part.sheet.X_CK.translation().x() += 960 * part.sheet.X_CK.translation().z() / 1700;
  const auto found = DetectBoard(ViewOf(Drawn(part, 4)), board);
  REQUIRE(found);
  const Errors errors = ErrorsOf(*found, TruePoints(part, board));
  CHECK(errors.seen > board.corners() / 4);
  CHECK(errors.seen < 3 * board.corners() / 4);
  CHECK(errors.worst_px < 0.3);
}

TEST_CASE("a ChArUco board with an even number of rows may start with a white square") {
  target::Board board = Charuco();
  board.rows = 7;  // of corners: eight rows of squares
  DrawnView view = Tilted(board, 0.3, 0.5);
  view.sheet.print = PrintOf(board, true);
  const auto found = DetectBoard(ViewOf(Drawn(view, 5)), board);
  REQUIRE(found);
  CHECK(ErrorsOf(*found, TruePoints(view, board)).worst_px < 0.25);
}

TEST_CASE("a hand over ChArUco's corners, and a sheet over circles") {
  const auto covered = [](const DrawnView& view, const target::Board& board, double width_m) {
    renderer::Sheet hand;
    hand.print = [](double, double) { return 0.6; };
    hand.half_width_m = hand.half_height_m = width_m / 2;
    hand.X_CK =
        view.sheet.X_CK * Eigen::Translation3d(board.Centre().x(), board.Centre().y(), -0.001);
    return renderer::Render(view.camera, {view.sheet, hand}, {}, 6);
  };
  const DrawnView charuco = Tilted(Charuco(), 0.3, 0.5);
  const auto found = DetectBoard(ViewOf(covered(charuco, Charuco(), 0.05)), Charuco());
  REQUIRE(found);
  const Errors errors = ErrorsOf(*found, TruePoints(charuco, Charuco()));
  CHECK(errors.seen < Charuco().corners());
  CHECK(errors.seen > Charuco().corners() / 2);
  CHECK(errors.worst_px < 0.3);  // corners under the hand are not made up
  const auto discs =
      DetectBoard(ViewOf(covered(Tilted(Circles(), 0.3, 0.5), Circles(), 0.1)), Circles());
  REQUIRE_FALSE(discs);
  CHECK(discs.error().find("only a part of the board") == 0);
}

TEST_CASE("a board of the wrong kind or size is refused; the error says what was found") {
  const auto error = [](const target::Board& drawn, const target::Board& asked) {
    const auto found = DetectBoard(ViewOf(Drawn(Tilted(drawn, 0.3, 0.35), 7)), asked);
    return found ? std::string("found") : found.error();
  };
  const target::Board chess{9, 6, 0.020};
  CHECK(error(chess, Charuco()) == "no tag of aruco-5x5-100");
  CHECK(error(chess, Circles()) == "no grid of circles");
  CHECK(error(Circles(), chess) == "no chessboard");
  target::Board other = Charuco();
  other.family = "aruco-4x4-100";
  CHECK(error(Charuco(), other).find("no tag of aruco-4x4-100") == 0);
  other = Charuco();
  other.columns = 6;
  CHECK(error(Charuco(), other).find("but not arranged as on a board of 6 x 6 inner corners") !=
        std::string::npos);
  other = Charuco();
  other.rows = 4;
  CHECK(error(Charuco(), other).find("a board of more than 9 x 4 inner corners") == 0);
  other = Circles();
  other.columns = 9;
  CHECK(error(Circles(), other).find("a grid of 77 circles instead of 63") == 0);
  other.columns = 7;
  other.rows = 11;
  CHECK(error(Circles(), other) == "found");  // the same board, turned by a quarter
  target::Board shifted = Shifted();
  shifted.columns = 11;
  shifted.rows = 4;
  CHECK(error(Shifted(), shifted).find("a grid of 44 circles, but not in 4 rows of 11") == 0);
}

TEST_CASE("frames without a board of that kind") {
  renderer::Conditions cluttered;
  cluttered.clutter = 60;
  for (const target::Board& board : {Charuco(), Circles(), Shifted()}) {
    for (int seed = 0; seed < 3; ++seed)
      CHECK_FALSE(DetectBoard(
          ViewOf(renderer::Render(renderer::ZoomLens(1700), {}, cluttered, seed)), board));
    for (const int grey : {0, 255}) {
      const std::vector<std::uint8_t> image(kPixels, static_cast<std::uint8_t>(grey));
      CHECK_FALSE(DetectBoard({image.data(), 1920, 1080, 1920}, board));
    }
    // A grid of discs over the whole frame is larger than the board.
    std::vector<std::uint8_t> dots(kPixels);
    for (std::size_t k = 0; k < kPixels; ++k) {
      const int u = static_cast<int>(k % 1920 % 24) - 12, v = static_cast<int>(k / 1920 % 24) - 12;
      dots[k] = u * u + v * v < 49 ? 20 : 220;
    }
    CHECK_FALSE(DetectBoard({dots.data(), 1920, 1080, 1920}, board));
    const std::vector<std::uint8_t> tiny(64, 7);
    CHECK_FALSE(DetectBoard({tiny.data(), 8, 8, 8}, board));
  }
}

TEST_CASE("invalid board dimensions: the error names the key") {
  const auto why = [](target::Board board, auto change) {
    change(board);
    const auto fault = FaultOf(board);
    return std::string(fault ? fault->key : "none");
  };
  CHECK(why(Charuco(), [](target::Board& b) { b.marker_m = 0; }) == "mark_mm");
  CHECK(why(Charuco(), [](target::Board& b) { b.marker_m = 0.03; }) == "mark_mm");
  CHECK(why(Charuco(), [](target::Board& b) { b.family = "none"; }) == "family");
  CHECK(why(Charuco(), [](target::Board& b) { b.rows = 40; }) == "family");
  CHECK(why(Circles(), [](target::Board& b) { b.marker_m = 0; }) == "mark_mm");
  CHECK(why(Circles(), [](target::Board& b) { b.marker_m = 0.021; }) == "mark_mm");
  CHECK(why(target::Board{}, [](target::Board& b) { b.columns = 2; }) == "columns");
  CHECK(why(target::Board{}, [](target::Board& b) { b.square_m = 0; }) == "square_mm");
  CHECK(why(target::Board{}, [](target::Board& b) { b.square_m = INFINITY; }) == "square_mm");
  CHECK(WordsOf(Charuco()) == "charuco 9x6, 20 mm, mark 15 mm, aruco-5x5-100");
  CHECK(WordsOf(target::Board{}) == "chessboard 17x11, 10 mm");
  CHECK(target::BoardKindOfName("charuco") == target::BoardKind::kCharuco);
  CHECK(target::BoardKindOfName(NameOf(target::BoardKind::kAsymmetricCircles)) ==
        target::BoardKind::kAsymmetricCircles);
  CHECK_FALSE(target::BoardKindOfName("hexagons"));
}

TEST_CASE("disc offsets agree with the dual conic of a tilted circle") {
  // Without distortion the image of a circle is an ellipse, whose centre follows from its dual
  // conic: H diag(r^2, r^2, -1) H^T about the disc's centre.
  const target::Board board{3, 3, 0.1, target::BoardKind::kCircles, 0.06, {}};
  const lens::Lens lens{1500, 1510, 900, 500};
  const Pose X_CK{Eigen::AngleAxisd(0.7, Vec3(0.6, -0.8, 0)).toRotationMatrix(),
                  Vec3(-0.05, -0.1, 0.8)};
  const auto offsets = DiscOffsets(board, SharedOfLens(lens), X_CK);
  Mat3 K = Mat3::Identity();
  K << 1500, 0, 900, 0, 1510, 500, 0, 0, 1;
  double largest = 0;
  for (int k = 0; k < board.corners(); ++k) {
    const lens::Vec2 c = board.Corner(k);
    Mat3 H;
    H << X_CK.R.col(0), X_CK.R.col(1), X_CK.R * Vec3(c.x(), c.y(), 0) + X_CK.p;
    H = Mat3(K * H);
    const Mat3 dual = H * Vec3(0.03 * 0.03, 0.03 * 0.03, -1).asDiagonal() * H.transpose();
    const lens::Vec2 ellipse(dual(0, 2) / dual(2, 2), dual(1, 2) / dual(2, 2));
    const lens::Vec2 expected = ellipse - H.col(2).hnormalized();
    largest = std::max(largest, expected.norm());
    CHECK((offsets[k] - expected).norm() < 0.01 * expected.norm() + 1e-6);
  }
  CHECK(largest > 1);
}

TEST_CASE("with each kind of board, the lens error is within its stated uncertainty") {
  for (const target::Board& board : {Charuco(), Circles(), Shifted()}) {
    Capture capture;
    capture.views = 14;
    std::vector<BoardView> views;
    for (const DrawnView& drawn : DrawViews(capture, board, 31)) {
      const auto found = DetectBoard(ViewOf(Drawn(drawn, views.size())), board);
      if (!found) continue;
      views.push_back(*found);
      views.back().name = std::to_string(views.size());
      views.back().time_s = static_cast<double>(views.size());
    }
    CHECK(views.size() >= 13);
    const LensCalibration c = CalibrateLens(board, views, kSize);
    const lens::Lens truth = test::LensOfCamera(renderer::ZoomLens(capture.f));
    std::string reasons;
    for (const std::string& reason : c.reasons) reasons += reason + "\n";
    INFO(NameOf(board.kind) << ": " << reasons << "fx " << c.lens.fx << " +- "
                            << std::sqrt(c.covariance(kFx, kFx)) << ", true " << truth.fx
                            << ", rms " << c.rms_px << ", claimed " << c.uncertainty.max_px
                            << ", true " << LargestDifference(truth, c.lens, kSize));
    CHECK(c.accepted);
    CHECK(std::abs(c.lens.fx - truth.fx) < 4.5 * std::sqrt(c.covariance(kFx, kFx)));
    CHECK(LargestDifference(truth, c.lens, kSize) < 4 * c.uncertainty.max_px);
    CHECK(c.rms_px < 0.1);
  }
}

}  // namespace plumbline::board_kinds_test
