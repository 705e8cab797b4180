// Printed sheets as a viewer shows them: drawn by poppler (PDF) and librsvg (SVG), found by the
// product's detectors and by OpenCV's, and measured.
#include <apriltag/tag36h11.h>
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <optional>

#include "app/vision/lens/board_detection.h"
#include "app/vision/print/board_sheet.h"
#include "app/vision/print/sheet_frame.h"
#include "app/vision/print/sheet_writer.h"
#include "app/vision/print/tag_sheets.h"
#include "app/vision/tracking/tag_detector.h"
#include "drivers/camera/image_file.h"
#include "drivers/files/text_file.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::printed_sheets_test {

using namespace plumbline::vision;

namespace {

constexpr double kResolution_dpi = 300;
constexpr double kPixelsPerMm = kResolution_dpi / 25.4;
constexpr double kTolerance_mm = 0.05;

bool Runs(const std::string& command) {
  return std::system((command + " > /dev/null 2>&1").c_str()) == 0;
}

/// The first sheet as a viewer of that format shows it; nullopt if it is not installed.
std::optional<camera::GreyImage> Rendered(const Document& document, SheetFormat format) {
  const bool svg = format == SheetFormat::kSvg;
  if (!Runs(svg ? "rsvg-convert --version" : "pdftoppm -v")) {
    std::cout << "SKIPPED: " << (svg ? "librsvg2-bin" : "poppler-utils") << " is not installed\n";
    return std::nullopt;
  }
  const test::TemporaryFolder folder;
  const std::string name = folder.path() + "/sheet";
  const auto file = FileOfSheets(document, format, PLUMBLINE_SHEETS);
  REQUIRE(file);
  REQUIRE(files::WriteTextFile(name, *file));
  REQUIRE(Runs(svg ? fmt::format("rsvg-convert -d {0} -p {0} {1} -o {1}.png", kResolution_dpi, name)
                   : fmt::format("pdftoppm -r {0} -gray -f 1 -l 1 -singlefile {1} {1}",
                                 kResolution_dpi, name)));
  auto image = camera::ReadImage(name + (svg ? ".png" : ".pgm"));
  REQUIRE(image);
  return std::move(image).value();
}

/// Point of the sheet [mm] at a pixel, whose (0, 0) is the centre of the top left one.
Vec2 OnSheet(const Vec2& pixel) {
  return (pixel + Vec2(0.5, 0.5)) / kPixelsPerMm;
}

int GreyAt(const camera::GreyImage& image, const Vec2& at_mm) {
  const int u = static_cast<int>(at_mm.x() * kPixelsPerMm);
  const int v = static_cast<int>(at_mm.y() * kPixelsPerMm);
  return image.View().row(v)[u];
}

cv::Mat MatOf(camera::GreyImage& image) {
  return {image.height, image.width, CV_8U, image.grey.data()};
}

vision::SeenTags DetectedTags(const camera::GreyImage& image, const target::TagFamily& family) {
  vision::TagDetector detector(family, {.small_tags = true});
  vision::SeenTags seen;
  detector.Detect(image.View(), nullptr, seen);
  return seen;
}

/// Largest distance between a detected point and its place on the board, after the best shift: the
/// scale and the direction are not fitted [mm].
double LargestError(const target::Board& board, const std::vector<Vec2>& points_px) {
  Vec2 shift = Vec2::Zero();
  const auto error = [&](int k) -> Vec2 { return OnSheet(points_px[k]) - 1e3 * board.Corner(k); };
  for (int k = 0; k < board.corners(); ++k) shift += error(k) / board.corners();
  double largest = 0;
  for (int k = 0; k < board.corners(); ++k) largest = std::max(largest, (error(k) - shift).norm());
  return largest;
}

/// The same for OpenCV's points.
double LargestError(const target::Board& board, const std::vector<cv::Point2f>& points_px) {
  std::vector<Vec2> points;
  for (const cv::Point2f& point : points_px) points.emplace_back(point.x, point.y);
  return LargestError(board, points);
}

/// Distance between the outermost dark lines across a line of the sheet [mm].
/// @param from, to  of that line [mm]
double DistanceOfEndTicks(const camera::GreyImage& image, const Vec2& from, const Vec2& to) {
  const double step = 0.1 / kPixelsPerMm, length = (to - from).norm();
  std::vector<double> ticks;  // centres
  double sum = 0, weight = 0;
  for (double at = 0; at < length; at += step) {
    const double dark = 255 - GreyAt(image, from + at / length * (to - from));
    if (dark > 0) {
      sum += dark * at;
      weight += dark;
    } else if (weight > 0) {
      ticks.push_back(sum / weight);
      sum = weight = 0;
    }
  }
  return ticks.size() == 2 ? ticks[1] - ticks[0] : -1;
}

const SheetFormat kFormats[] = {SheetFormat::kPdf, SheetFormat::kSvg};
const Paper kA4 = *PaperOfName("A4");

}  // namespace

TEST_CASE("tags are found upright, with their ids and sizes") {
  const target::TagFamily family = target::TagFamilyOfName("36h11").value();
  const std::vector<int> ids = {0, 7, 21, 586};
  const auto document = TagSheets(family, ids, 62.5, kA4);
  REQUIRE(document);
  for (const SheetFormat format : kFormats) {
    auto image = Rendered(*document, format);
    if (!image) continue;
    CAPTURE(format == SheetFormat::kSvg);
    const vision::SeenTags seen = DetectedTags(*image, family);
    REQUIRE(seen.tags.size() == ids.size());
    for (const vision::SeenTag& tag : seen.tags) {
      CAPTURE(tag.id);
      CHECK(std::count(ids.begin(), ids.end(), tag.id) == 1);
      CHECK(tag.wrong_bits == 0);
      const Vec2 top_left = OnSheet(tag.corners_px[0]);
      const Vec2 expected[] = {{0, 0}, {62.5, 0}, {62.5, 62.5}, {0, 62.5}};
      for (std::size_t k = 0; k < 4; ++k) {
        CHECK((OnSheet(tag.corners_px[k]) - top_left - expected[k]).norm() < kTolerance_mm);
      }
    }
    // OpenCV's dictionary is turned by half a turn: its first corner is the bottom right one.
    std::vector<int> found;
    std::vector<std::vector<cv::Point2f>> corners;
    cv::aruco::detectMarkers(MatOf(*image),
                             cv::aruco::getPredefinedDictionary(cv::aruco::DICT_APRILTAG_36h11),
                             corners, found);
    REQUIRE(found.size() == ids.size());
    for (std::size_t k = 0; k < found.size(); ++k) {
      CHECK(std::count(ids.begin(), ids.end(), found[k]) == 1);
      CHECK(corners[k][0].x > corners[k][1].x + 100);
      CHECK(corners[k][0].y > corners[k][3].y + 100);
    }
  }
}

TEST_CASE("a printed tag has the cells of the AprilTag library's picture") {
  const target::TagFamily family = target::TagFamilyOfName("36h11").value();
  const auto document = TagSheets(family, {7}, 80, kA4);
  REQUIRE(document);
  const auto image = Rendered(*document, SheetFormat::kPdf);
  if (!image) return;
  const vision::SeenTags seen = DetectedTags(*image, family);
  REQUIRE(seen.tags.size() == 1);
  const std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)> library(tag36h11_create(),
                                                                                 tag36h11_destroy);
  image_u8_t* const picture = apriltag_to_image(library.get(), 7);
  REQUIRE(picture->width == 10);  // a white border, the black one, and six cells
  const Vec2 corner = OnSheet(seen.tags[0].corners_px[0]);
  for (int row = 0; row < 10; ++row) {
    for (int column = 0; column < 10; ++column) {
      CAPTURE(row, column);
      const Vec2 middle = corner + 10 * Vec2(column - 0.5, row - 0.5);
      CHECK((GreyAt(*image, middle) > 128) == (picture->buf[row * picture->stride + column] > 128));
    }
  }
  std::free(picture->buf);  // Debian's library does not export image_u8_destroy
  std::free(picture);
}

TEST_CASE("both rulers measure 100 mm") {
  const auto document = TagSheets(target::TagFamilyOfName("36h11").value(), {7}, 80, kA4);
  REQUIRE(document);
  Vec2 of_level, of_upright;  // their zeros
  for (const Line& line : document->sheets[0].lines) {
    if ((line.to - line.from).norm() != Approx(kRulerLength_mm)) continue;
    (line.to.y() == line.from.y() ? of_level : of_upright) = line.from;
  }
  for (const SheetFormat format : kFormats) {
    const auto image = Rendered(*document, format);
    if (!image) continue;
    CAPTURE(format == SheetFormat::kSvg);
    // 4.2 mm beside the ruler, where only the ticks at its ends reach.
    CHECK(DistanceOfEndTicks(*image, of_level + Vec2(-1, 4.2), of_level + Vec2(101, 4.2)) ==
          Approx(100).margin(kTolerance_mm));
    CHECK(DistanceOfEndTicks(*image, of_upright + Vec2(-4.2, 1), of_upright + Vec2(-4.2, -101)) ==
          Approx(100).margin(kTolerance_mm));
  }
}

TEST_CASE("boards of every kind are found, each point in its place even if the sheet is turned") {
  using target::BoardKind;
  const target::Board boards[] = {
      {},
      {.columns = 9, .rows = 6, .square_m = 0.02},
      {.columns = 9,
       .rows = 6,
       .square_m = 0.02,
       .kind = target::BoardKind::kCharuco,
       .marker_m = 0.015,
       .family = "aruco-5x5-100"},
      {.columns = 9,
       .rows = 7,
       .square_m = 0.018,
       .kind = target::BoardKind::kCircles,
       .marker_m = 0.011},
      {.columns = 4,
       .rows = 11,
       .square_m = 0.015,
       .kind = target::BoardKind::kAsymmetricCircles,
       .marker_m = 0.011},
  };
  for (const target::Board& board : boards) {
    CAPTURE(WordsOf(board));
    const auto document = BoardSheet(board, kA4);
    REQUIRE(document);
    for (const SheetFormat format : kFormats) {
      auto image = Rendered(*document, format);
      if (!image) continue;
      CAPTURE(format == SheetFormat::kSvg);
      for (const bool turned : {false, true}) {
        CAPTURE(turned);
        if (turned && board.kind == target::BoardKind::kCircles) continue;  // looks the same
        if (turned) std::ranges::reverse(image->grey);
        const auto view = DetectBoard(image->View(), board);
        REQUIRE(view);
        for (int k = 0; k < board.corners(); ++k) CHECK(view->seen[k]);
        std::vector<Vec2> points = view->corners_px;
        if (turned) {
          for (Vec2& point : points) point = Vec2(image->width - 1, image->height - 1) - point;
        }
        CHECK(LargestError(board, points) < kTolerance_mm);
      }
    }
  }
}

TEST_CASE("OpenCV finds the boards, too") {
  using target::BoardKind;
  std::vector<cv::Point2f> points;
  {
    const target::Board board{.columns = 9, .rows = 6, .square_m = 0.02};
    auto image = Rendered(BoardSheet(board, kA4).value(), SheetFormat::kPdf);
    if (!image) return;
    REQUIRE(cv::findChessboardCornersSB(MatOf(*image), {9, 6}, points));
    std::reverse(points.begin(), points.end());  // OpenCV starts in the other corner
    CHECK(LargestError(board, points) < kTolerance_mm);
  }
  {
    const target::Board board{.columns = 4,
                              .rows = 11,
                              .square_m = 0.015,
                              .kind = target::BoardKind::kAsymmetricCircles,
                              .marker_m = 0.011};
    auto image = Rendered(BoardSheet(board, kA4).value(), SheetFormat::kPdf);
    cv::SimpleBlobDetector::Params blobs;
    blobs.maxArea = 1e5;
    REQUIRE(cv::findCirclesGrid(MatOf(*image), {4, 11}, points, cv::CALIB_CB_ASYMMETRIC_GRID,
                                cv::SimpleBlobDetector::create(blobs)));
    CHECK(LargestError(board, points) < 0.1);  // means of contours of whole pixels
  }
  {
    const target::Board board{.columns = 9,
                              .rows = 6,
                              .square_m = 0.02,
                              .kind = target::BoardKind::kCharuco,
                              .marker_m = 0.015,
                              .family = "aruco-5x5-100"};
    auto image = Rendered(BoardSheet(board, kA4).value(), SheetFormat::kPdf);
    const auto dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_100);
    const auto peer = cv::aruco::CharucoBoard::create(10, 7, 20, 15, dictionary);
    std::vector<std::vector<cv::Point2f>> corners;
    std::vector<int> ids, corner_ids;
    cv::aruco::detectMarkers(MatOf(*image), dictionary, corners, ids);
    CHECK(ids.size() == 35);
    cv::aruco::interpolateCornersCharuco(corners, ids, MatOf(*image), peer, points, corner_ids);
    REQUIRE(points.size() == 54);
    for (int k = 0; k < 54; ++k) CHECK(corner_ids[k] == k);
    CHECK(LargestError(board, points) < kTolerance_mm);
  }
}

TEST_CASE("a module that cannot be loaded is reported with the remedy") {
  const auto document = TagSheets(target::TagFamilyOfName("36h11").value(), {7}, 80, kA4);
  const auto missing = FileOfSheets(*document, SheetFormat::kPdf, "/nonexistent/sheets.so");
  REQUIRE_FALSE(missing);
  CHECK_THAT(missing.error(),
             Catch::StartsWith("the module that draws sheets, /nonexistent/sheets.so, cannot be "
                               "loaded: ") &&
                 Catch::Contains("apt install --reinstall plumbline"));
}

}  // namespace plumbline::printed_sheets_test
