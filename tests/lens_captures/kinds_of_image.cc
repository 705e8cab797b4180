// Rendered captures: light, optics, sensors and compression that spoil the image.
#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/lens_captures/kinds.h"

namespace plumbline::lens_captures {
namespace {

using Expected = Kind::Expected;
using After = std::function<void(int j, Photo&, Random&)>;
using Before = std::function<void(int j, double& blur_px, double& noise)>;

Kind Rendered(const char* name, Expected expected, const char* words, After after,
              Before before = {}) {
  Kind kind{name, expected, words, [](Conditions& c, Random& random) {
              c.width = 960;
              c.height = 600;
              const double f = 960 * Uniform(random, 0.9, 1.6);
              c.camera = {};
              c.camera.fx = c.camera.fy = f;
              c.camera.cx = 479.5 + Uniform(random, -8, 8);
              c.camera.cy = 299.5 + Uniform(random, -8, 8);
              c.camera.k[0] = Uniform(random, -0.12, 0.02);
              c.board.columns = 11;
              c.board.rows = 8;
              c.board.square_m = 0.2 / 11;
              c.views = 20;
            }};
  kind.rendered = true;
  kind.photo.after = std::move(after);
  kind.photo.before = std::move(before);
  return kind;
}

/// Multiplies each pixel by factor(distance from the centre of the light, 1 at the corner).
void Darken(Photo& photo, double centre_x, double centre_y,
            const std::function<double(double)>& factor) {
  const double corner = std::hypot(0.5 * photo.width, 0.5 * photo.height);
  for (int v = 0; v < photo.height; ++v) {
    for (int u = 0; u < photo.width; ++u) {
      std::uint8_t& grey = photo.grey[static_cast<std::size_t>(v) * photo.width + u];
      const double r = std::hypot(u - centre_x * photo.width, v - centre_y * photo.height) / corner;
      grey = static_cast<std::uint8_t>(std::clamp(grey * factor(r) + 0.5, 0.0, 255.0));
    }
  }
}

void Map(Photo& photo, const std::function<double(double)>& curve) {
  for (std::uint8_t& grey : photo.grey)
    grey = static_cast<std::uint8_t>(std::clamp(255 * curve(grey / 255.0) + 0.5, 0.0, 255.0));
}

cv::Mat MatOf(Photo& photo) {
  return {photo.height, photo.width, CV_8U, photo.grey.data()};
}

}  // namespace

void AddKindsOfImage(std::vector<Kind>& kinds) {
  const auto good = [&](const char* name, After after, Before before = {}) {
    kinds.push_back(Rendered(name, Expected::kGood, "", std::move(after), std::move(before)));
  };
  const auto either = [&](const char* name, const char* words, After after, Before before = {}) {
    kinds.push_back(Rendered(name, Expected::kEither, words, std::move(after), std::move(before)));
  };
  good("images", [](int, Photo&, Random&) {});
  good("images, vignetting to a tenth", [](int, Photo& photo, Random&) {
    Darken(photo, 0.5, 0.5, [](double r) { return 1 - 0.9 * r * r; });
  });
  good("images, vignetting to a tenth, steep", [](int, Photo& photo, Random&) {
    Darken(photo, 0.5, 0.5, [](double r) { return 1 - 0.9 * std::pow(r, 4); });
  });
  good("images, vignetting off the centre", [](int, Photo& photo, Random&) {
    Darken(photo, 0.42, 0.55, [](double r) { return std::max(0.1, 1 - 0.75 * r * r); });
  });
  good("images, lit from one side", [](int, Photo& photo, Random&) {
    Darken(photo, -0.2, 0.3, [](double r) { return 1 / (1 + r * r); });
  });
  good("images, gamma", [](int, Photo& photo, Random&) {
    Map(photo, [](double x) { return std::pow(x, 1 / 2.2); });
  });
  either("images, white clipped", "",
         [](int, Photo& photo, Random&) { Map(photo, [](double x) { return 1.8 * x; }); });
  either("images, JPEG of quality 30", "", [](int, Photo& photo, Random&) {
    std::vector<std::uint8_t> bytes;
    cv::imencode(".jpg", MatOf(photo), bytes, {cv::IMWRITE_JPEG_QUALITY, 30});
    cv::imdecode(bytes, cv::IMREAD_GRAYSCALE).copyTo(MatOf(photo));
  });
  either("images, sharpened", "", [](int, Photo& photo, Random&) {
    cv::Mat image = MatOf(photo), soft;
    cv::GaussianBlur(image, soft, {0, 0}, 1.5);
    cv::addWeighted(image, 2, soft, -1, 0, image);
  });
  either("images, enlarged from 640 pixels", "", [](int, Photo& photo, Random&) {
    cv::Mat image = MatOf(photo), small;
    cv::resize(image, small, {640, 400}, 0, 0, cv::INTER_AREA);
    cv::resize(small, image, image.size(), 0, 0, cv::INTER_LINEAR);
  });
  either("images, interlaced with motion", "rolling shutter|not clear",
         [](int, Photo& photo, Random& random) {
           const int shift = static_cast<int>(random() % 4);
           for (int v = 1; v < photo.height; v += 2) {
             const auto row = photo.grey.begin() + static_cast<std::ptrdiff_t>(v) * photo.width;
             std::rotate(row, row + shift, row + photo.width);
           }
         });
  either("images, motion blur in some", "blurred|last frame", [](int j, Photo& photo, Random&) {
    if (j % 4 != 1) return;
    cv::Mat image = MatOf(photo);
    cv::blur(image, image, {9, 1});
  });
  either("images, focus lost at the end", "blurred|last|focal length|not clear", {},
         [](int j, double& blur_px, double&) {
           if (j >= 17) blur_px = 4;
         });
  either(
      "images, noise of 12 grey levels", "", [](int, Photo&, Random&) {},
      [](int, double&, double& noise) { noise = 12; });
}

}  // namespace plumbline::lens_captures
