// False detections in images without tags, and worst cases of run time.
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "app/vision/tracking/tag_detector.h"
#include "tests/app/vision/tracking/natural_image.h"

namespace plumbline::tag_clutter_test {

using namespace plumbline::vision;

namespace {

// A sanitizer checks memory accesses, not the rate of false detections.
#ifdef PLUMBLINE_SANITIZED
constexpr int kClutteredFrames = 20, kNaturalImages = 1, kScenesWithoutTags = 2;
#else
constexpr int kClutteredFrames = 200, kNaturalImages = 8, kScenesWithoutTags = 10;
#endif

struct Canvas {
  int width, height;
  std::vector<std::uint8_t> grey;

  Canvas(int w, int h, int level)
      : width(w),
        height(h),
        grey(static_cast<std::size_t>(w) * h, static_cast<std::uint8_t>(level)) {}
  image::LumaView View() const { return {grey.data(), width, height, width}; }
  void Set(int u, int v, double level) {
    if (u >= 0 && v >= 0 && u < width && v < height)
      grey[static_cast<std::size_t>(v) * width + u] =
          static_cast<std::uint8_t>(std::clamp(level, 0.0, 255.0));
  }
};

/// Rotated rectangles, some with random cells and a border like a tag's, and noise.
Canvas Clutter(std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  Canvas canvas(640, 480, static_cast<int>(255 * uniform(random)));
  const int shapes = 20 + static_cast<int>(random() % 60);
  for (int k = 0; k < shapes; ++k) {
    const double cu = 640 * uniform(random), cv = 480 * uniform(random);
    const double half = 5 + 60 * uniform(random), turn = 6.3 * uniform(random);
    const double stretch = 0.4 + uniform(random), dark = 120 * uniform(random);
    const double bright = dark + 130 * uniform(random);
    const bool cells = uniform(random) < 0.5;
    const std::uint64_t code = random();
    const double cos_turn = std::cos(turn), sin_turn = std::sin(turn);
    for (int v = static_cast<int>(cv - 90); v < cv + 90; ++v) {
      for (int u = static_cast<int>(cu - 90); u < cu + 90; ++u) {
        const double x = (cos_turn * (u - cu) + sin_turn * (v - cv)) / half;
        const double y = (cos_turn * (v - cv) - sin_turn * (u - cu)) / half / stretch;
        const double far = std::max(std::abs(x), std::abs(y));
        if (far > (cells ? 1.25 : 1)) continue;
        const int c = static_cast<int>(std::floor((x + 1) * 4)) - 1;
        const int r = static_cast<int>(std::floor((y + 1) * 4)) - 1;
        const bool data = c >= 0 && r >= 0 && c < 6 && r < 6;
        const bool white = far > 1 || (cells && data && ((code >> (6 * r + c)) & 1) != 0);
        canvas.Set(u, v, white ? bright : dark);
      }
    }
  }
  std::normal_distribution<double> noise(0, 12 * uniform(random));
  for (std::uint8_t& grey : canvas.grey) {
    grey = static_cast<std::uint8_t>(std::clamp(grey + noise(random), 0.0, 255.0));
  }
  return canvas;
}

/// Draws a frame of `border` cells around n x n random cells, or around strokes as of a letter.
void DrawSquare(Canvas& canvas, int u0, int v0, int side, bool strokes, std::mt19937_64& random) {
  const int n = 3 + static_cast<int>(random() % 6), border = 1 + static_cast<int>(random() % 3);
  const int cells = n + 2 * border;
  std::vector<bool> bright(static_cast<std::size_t>(n) * n);
  for (std::size_t i = 0; i < bright.size(); ++i) bright[i] = strokes || random() % 2 == 0;
  for (std::uint64_t stroke = strokes ? 1 + random() % 4 : 0; stroke > 0; --stroke) {
    const int at = static_cast<int>(random() % n);
    const bool across = random() % 2 == 0;
    for (int k = static_cast<int>(random() % n); k < n; ++k) {
      bright[static_cast<std::size_t>(across ? at * n + k : k * n + at)] = false;
    }
  }
  for (int v = 0; v < side; ++v) {
    for (int u = 0; u < side; ++u) {
      const int r = v * cells / side - border, c = u * cells / side - border;
      const bool data = r >= 0 && c >= 0 && r < n && c < n;
      canvas.Set(u0 + u, v0 + v, data && bright[static_cast<std::size_t>(r) * n + c] ? 220 : 30);
    }
  }
}

enum class Scenery { kNoise, kCheckerboard, kRandomSquares, kLetters };

/// A scene without tags, in which about 48 squares could be taken for one.
Canvas SceneWithoutTags(Scenery scenery, std::mt19937_64& random) {
  constexpr int kPitch_px = 80;
  Canvas canvas(640, 480, 220);
  const int block = 6 + static_cast<int>(random() % 40);
  for (int v = 0; v < canvas.height; ++v) {
    for (int u = 0; u < canvas.width; ++u) {
      if (scenery == Scenery::kNoise) canvas.Set(u, v, static_cast<double>(random() % 256));
      if (scenery == Scenery::kCheckerboard && (u / block + v / block) % 2 == 0) {
        canvas.Set(u, v, 30);
      }
    }
  }
  if (scenery == Scenery::kNoise || scenery == Scenery::kCheckerboard) return canvas;
  for (int v = 10; v + kPitch_px <= canvas.height; v += kPitch_px) {
    for (int u = 10; u + kPitch_px <= canvas.width; u += kPitch_px) {
      DrawSquare(canvas, u, v, 40 + static_cast<int>(random() % 25), scenery == Scenery::kLetters,
                 random);
    }
  }
  return canvas;
}

}  // namespace

// Over 300 scenes of each kind, about 28,800 framed squares, a border of up to two cells instead of
// one raised the false tags of 16h5 from 12 to 23 and of aruco-4x4-50 from 67 to 99, but left 36h11
// and 25h9 at 0. Families in which random cells often match are therefore read with one only.
TEST_CASE("a border of two cells adds no false tags in scenes without tags") {
  for (const char* name : {"36h11", "25h9"}) {
    TagDetector detector(*target::TagFamilyOfName(name), {});
    for (const Scenery scenery :
         {Scenery::kNoise, Scenery::kCheckerboard, Scenery::kRandomSquares, Scenery::kLetters}) {
      std::mt19937_64 random(11);
      for (int scene = 0; scene < kScenesWithoutTags; ++scene) {
        CAPTURE(name, static_cast<int>(scenery), scene);
        SeenTags seen;
        detector.Detect(SceneWithoutTags(scenery, random).View(), nullptr, seen);
        CHECK(seen.tags.empty());
      }
    }
  }
}

TEST_CASE("No tag is detected in frames of clutter without tags") {
  std::mt19937_64 random(3);
  TagDetector detector(*target::TagFamilyOfName("36h11"), {});
  int tags = 0;
  for (int frame = 0; frame < kClutteredFrames; ++frame) {
    SeenTags seen;
    detector.Detect(Clutter(random).View(), nullptr, seen);
    tags += static_cast<int>(seen.tags.size());
  }
  CHECK(tags == 0);
}

TEST_CASE("No tag of any family is detected in images like photographs") {
  std::vector<TagDetector> detectors;
  for (const char* family : {"36h11", "25h9", "16h5", "aruco-4x4-50", "aruco-6x6-250"}) {
    detectors.emplace_back(*target::TagFamilyOfName(family), DetectorSettings{.strict = true});
  }
  for (int seed = 1; seed <= kNaturalImages; ++seed) {
    const std::vector<std::uint8_t> grey = test::NaturalImage(960, 540, 700, seed);
    for (TagDetector& detector : detectors) {
      CAPTURE(detector.family().name, seed);
      SeenTags seen;
      detector.Detect({grey.data(), 960, 540, 960}, nullptr, seen);
      CHECK(seen.tags.empty());
    }
  }
}

TEST_CASE("Images of any content and size are processed safely") {
  std::mt19937_64 random(4);
  TagDetector automatic(*target::TagFamilyOfName("36h11"), {.small_tags = true});
  TagDetector fixed(*target::TagFamilyOfName("aruco-4x4-50"),
                    {.threshold = 128, .small_tags = true});
  const lens::Lens lens{300, 300, 100, 100, -0.3, 0.1, 0.001, 0.001, 0};
  for (int frame = 0; frame < 300; ++frame) {
    const int width = 1 + static_cast<int>(random() % (frame % 10 == 0 ? 900 : 90));
    const int height = 1 + static_cast<int>(random() % (frame % 7 == 0 ? 900 : 90));
    const int stride = width + static_cast<int>(random() % 5);
    // Allocated without slack, so that the sanitizer detects reads beyond the pixels.
    std::vector<std::uint8_t> grey(static_cast<std::size_t>(stride) * (height - 1) + width);
    const int block = 1 + static_cast<int>(random() % 12);
    const std::uint64_t kind = random() % 4;
    for (std::size_t i = 0; i < grey.size(); ++i) {
      const auto u = static_cast<int>(i) % stride / block, v = static_cast<int>(i) / stride / block;
      grey[i] = kind == 0   ? static_cast<std::uint8_t>(random())
                : kind == 1 ? static_cast<std::uint8_t>(255 * ((u + v) % 2))
                : kind == 2 ? static_cast<std::uint8_t>(u * v)
                            : static_cast<std::uint8_t>(random() % 2 * 255);
    }
    const image::LumaView view{grey.data(), width, height, stride};
    for (TagDetector* detector : {&automatic, &fixed}) {
      SeenTags seen;
      detector->Detect(view, &lens, seen);
      for (const SeenTag& tag : seen.tags) CHECK(tag.covariance.allFinite());
    }
  }
}

TEST_CASE("More dark regions than the limit: the smaller ones are skipped, and this is reported") {
  Canvas canvas(1920, 1080, 255);
  for (int v = 0; v < 1080; ++v) {
    for (int u = 0; u < 1920; ++u) {
      if (u % 20 < 12 && v % 20 < 12) canvas.Set(u, v, 0);
    }
  }
  SeenTags seen;
  TagDetector detector(*target::TagFamilyOfName("36h11"), {});
  detector.Detect(canvas.View(), nullptr, seen);
  CHECK(seen.limited);
  CHECK(seen.tags.empty());
  // The next frame is not affected.
  std::fill(canvas.grey.begin(), canvas.grey.end(), std::uint8_t{0});
  detector.Detect(canvas.View(), nullptr, seen);
  CHECK_FALSE(seen.limited);
}

}  // namespace plumbline::tag_clutter_test
