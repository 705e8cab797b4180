#include <catch2/catch.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "drivers/display/renderer.h"
#include "firmware-like/image/image_size.h"
#include "tests/drivers/display/drawing_fixture.h"

namespace plumbline::background_test {

using namespace plumbline::display;

namespace {

/// Image with edges and gradients in every direction, as blurred as a real camera image.
cv::Mat Photograph(image::ImageSize size, int channels) {
  cv::Mat image(size.height, size.width, CV_8UC(channels));
  cv::RNG random(7);
  random.fill(image, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(image, image, {}, 6);
  cv::normalize(image, image, 0, 255, cv::NORM_MINMAX);
  for (int i = 0; i < 40; ++i) {
    cv::circle(image, {random.uniform(0, size.width), random.uniform(0, size.height)},
               random.uniform(5, 60), cv::Scalar::all(random.uniform(0, 255)), 3);
  }
  cv::GaussianBlur(image, image, {}, 1.0);
  return image;
}

struct Case {
  const char* name;
  lens::Lens lens;
  lens::Lens pinhole;
};

std::vector<Case> Cases(image::ImageSize size) {
  lens::Lens barrel = test::Pinhole(0.9 * size.width, size);
  barrel.fy *= 1.01;
  barrel.cx += 7.3;
  barrel.cy -= 4.1;
  lens::Lens pincushion = barrel;
  barrel.k1 = -0.28;
  barrel.k2 = 0.09;
  barrel.p1 = 0.0012;
  barrel.p2 = -0.0007;
  barrel.k3 = -0.01;
  pincushion.k1 = 0.12;
  pincushion.p2 = 0.002;
  return {{"barrel", barrel, test::Pinhole(0.9 * size.width, size)},
          {"barrel, zoomed in", barrel, test::Pinhole(1.4 * size.width, size)},
          {"pincushion", pincushion, test::Pinhole(0.85 * size.width, size)}};
}

/// OpenCV's undistortion map with floating-point bilinear interpolation instead of the fixed-point
/// remap.
double Expected(const cv::Mat& image, const cv::Mat& map, int u, int v, int channel) {
  const cv::Vec2f s = map.at<cv::Vec2f>(v, u);
  const double x = std::clamp<double>(s[0], 0, image.cols - 1);
  const double y = std::clamp<double>(s[1], 0, image.rows - 1);
  const int x0 = std::min(static_cast<int>(x), image.cols - 2);
  const int y0 = std::min(static_cast<int>(y), image.rows - 2);
  const auto at = [&](int row, int column) {
    return static_cast<double>(image.ptr(row)[column * image.channels() + channel]);
  };
  const double tx = x - x0, ty = y - y0;
  return (1 - ty) * ((1 - tx) * at(y0, x0) + tx * at(y0, x0 + 1)) +
         ty * ((1 - tx) * at(y0 + 1, x0) + tx * at(y0 + 1, x0 + 1));
}

cv::Mat MapOf(const lens::Lens& lens, const lens::Lens& pinhole, image::ImageSize size) {
  const cv::Mat K = (cv::Mat_<double>(3, 3) << lens.fx, 0, lens.cx, 0, lens.fy, lens.cy, 0, 0, 1);
  const cv::Mat P =
      (cv::Mat_<double>(3, 3) << pinhole.fx, 0, pinhole.cx, 0, pinhole.fy, pinhole.cy, 0, 0, 1);
  const cv::Mat terms = (cv::Mat_<double>(1, 5) << lens.k1, lens.k2, lens.p1, lens.p2, lens.k3);
  cv::Mat map, none;
  cv::initUndistortRectifyMap(K, terms, {}, P, {size.width, size.height}, CV_32FC2, map, none);
  return map;
}

scene::DisplayList ListOf(const cv::Mat& image, const Case& c, cv::Mat& padded) {
  scene::DisplayList list = test::EmptyList({image.cols, image.rows});
  list.pinhole = c.pinhole;
  list.background.lens = c.lens;
  cv::Mat grey;
  if (image.channels() == 3) {
    cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
    list.background.bgr = image.data;
  } else {
    grey = image;
  }
  cv::copyMakeBorder(grey, padded, 0, 0, 0, 13, cv::BORDER_CONSTANT);  // padded stride
  list.background.luma = {padded.data, image.cols, image.rows, padded.cols};
  return list;
}

}  // namespace

TEST_CASE("the background matches OpenCV's undistortion to one grey level") {
  test::Drawing drawing;
  if (!drawing.renderer) return;
  const image::ImageSize size{960, 540};
  for (const int channels : {1, 3}) {
    const cv::Mat image = Photograph(size, channels);
    for (const Case& c : Cases(size)) {
      cv::Mat padded;
      scene::DisplayList list = ListOf(image, c, padded);
      list.background.sequence = static_cast<std::uint64_t>(channels);
      REQUIRE(drawing.renderer->Draw(list) == DrawResult::kDrawn);
      const RgbImage drawn = drawing.renderer->ReadBack();
      const cv::Mat map = MapOf(c.lens, c.pinhole, size);
      const cv::Rect2d inside(0, 0, size.width - 1, size.height - 1);
      int compared = 0, within_one = 0;
      double worst = 0;
      for (int v = 0; v < size.height; ++v) {
        for (int u = 0; u < size.width; ++u) {
          const cv::Vec2f s = map.at<cv::Vec2f>(v, u);
          if (!inside.contains(cv::Point2d(s[0], s[1]))) continue;
          const test::Pixel pixel = test::At(drawn, u, v);
          const int got[] = {pixel.b, pixel.g, pixel.r};
          for (int k = 0; k < channels; ++k) {
            const double off = std::abs(got[k] - Expected(image, map, u, v, k));
            ++compared;
            within_one += off <= 1 ? 1 : 0;
            worst = std::max(worst, off);
          }
          if (channels == 1 && pixel != test::Pixel{pixel.r, pixel.r, pixel.r}) FAIL("not grey");
        }
      }
      std::printf("background, %-18s %d channel(s): %.4f %% within 1 grey value, worst %.2f\n",
                  c.name, channels, 100.0 * within_one / compared, worst);
      CAPTURE(c.name, channels);
      CHECK(compared > size.width * size.height / 2);
      CHECK(within_one > 0.999 * compared);
      CHECK(worst < 3);
    }
  }
}

TEST_CASE("outside the image and where the lens folds back the picture is empty") {
  test::Drawing drawing;
  if (!drawing.renderer) return;
  const image::ImageSize size{640, 480};
  const cv::Mat image(size.height, size.width, CV_8UC1, cv::Scalar(200));
  lens::Lens folding = test::Pinhole(300, size);
  folding.k1 = -0.35;  // folds at r = 0.976: pixel 319.5 + 300 * 0.65 is the farthest it reaches
  cv::Mat padded;
  const scene::DisplayList list = ListOf(image, {"", folding, test::Pinhole(150, size)}, padded);
  REQUIRE(drawing.renderer->Draw(list) == DrawResult::kDrawn);
  const RgbImage drawn = drawing.renderer->ReadBack();
  CHECK(test::At(drawn, 320, 240).r == 200);
  CHECK(test::At(drawn, 320 + 140, 240).r == 200);
  CHECK(test::At(drawn, 320 + 150, 240).r == 33);
  CHECK(test::At(drawn, 320 + 250, 240).r == 33);
  CHECK(LargestRadiusSquared(folding) == Approx(1 / (3 * 0.35)).epsilon(0.005));
  CHECK(LargestRadiusSquared(test::Pinhole(300, size)) == 100);
}

TEST_CASE("an image without a lens is shown unchanged, scaled to fit if the size differs") {
  test::Drawing drawing;
  if (!drawing.renderer) return;
  const image::ImageSize size{320, 240};
  const cv::Mat image = Photograph(size, 1);
  scene::DisplayList list = test::EmptyList(size, 777);
  list.background.luma = {image.data, size.width, size.height, size.width};
  REQUIRE(drawing.renderer->Draw(list) == DrawResult::kDrawn);
  const RgbImage same = drawing.renderer->ReadBack();
  int worst = 0;
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      worst = std::max(worst, std::abs(test::At(same, u, v).r - image.at<std::uint8_t>(v, u)));
    }
  }
  CHECK(worst <= 1);
  list.size = {1280, 480};  // twice as high: the image has a margin of 320 on both sides
  list.pinhole = test::Pinhole(500, list.size);
  REQUIRE(drawing.renderer->Draw(list) == DrawResult::kDrawn);
  const RgbImage wide = drawing.renderer->ReadBack();
  CHECK(test::At(wide, 318, 240).r == 33);
  CHECK(test::At(wide, 961, 240).r == 33);
  const int middle = (image.at<std::uint8_t>(119, 159) + image.at<std::uint8_t>(120, 160)) / 2;
  CHECK(std::abs(test::At(wide, 640, 240).r - middle) < 12);
}

TEST_CASE("an image is uploaded again only if its sequence changes") {
  test::Drawing drawing;
  if (!drawing.renderer) return;
  std::vector<std::uint8_t> grey(64 * 48, 50);
  scene::DisplayList list = test::EmptyList({64, 48});
  list.background.luma = {grey.data(), 64, 48, 64};
  const auto shown = [&] {
    REQUIRE(drawing.renderer->Draw(list) == DrawResult::kDrawn);
    return test::At(drawing.renderer->ReadBack(), 30, 20).r;
  };
  CHECK(shown() == 50);
  std::fill(grey.begin(), grey.end(), std::uint8_t{90});
  CHECK(shown() == 50);
  list.background.sequence = 1;
  CHECK(shown() == 90);
  list.background.luma = {};
  CHECK(shown() == 33);
  list.background.luma = {grey.data(), 64, 48, 10};  // overlapping rows
  CHECK(shown() == 33);
  CHECK(drawing.renderer->TakeRemarks().size() == 1);
}

}  // namespace plumbline::background_test
