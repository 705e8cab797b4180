// Tags under shadows, out of focus, with thin margins, dark neighbours and little contrast.
#include <catch2/catch.hpp>

#include "app/vision/tracking/line_quads.h"
#include "tests/app/vision/tracking/hard_scenes.h"

namespace plumbline::tag_difficulty_test {

using namespace plumbline::vision;

namespace {

#ifdef PLUMBLINE_SANITIZED
constexpr int kScenes = 3;
#else
constexpr int kScenes = 20;
#endif

struct Expected {
  test::Difficulty kind;
  double found;  ///< share of the tags, at least
};

}  // namespace

// Shares over 200 scenes of each kind: see tag_completeness_bench.
TEST_CASE("Most tags are found under each difficulty, and no other tag") {
  const target::TagFamily family = *target::TagFamilyOfName("36h11");
  TagDetector detector(family, {});
  for (const Expected& expected :
       {Expected{test::Difficulty::kShadow, 0.8}, Expected{test::Difficulty::kDefocus, 0.8},
        Expected{test::Difficulty::kThinMargin, 0.9}, Expected{test::Difficulty::kTouched, 0.65},
        Expected{test::Difficulty::kLittleContrast, 0.9}}) {
    int found = 0;
    for (int k = 0; k < kScenes; ++k) {
      const test::HardScene scene = test::MakeHardScene(family, expected.kind, 7000 + k);
      SeenTags seen;
      detector.Detect(test::ViewOf(scene.image), nullptr, seen);
      for (const SeenTag& tag : seen.tags) {
        CHECK(tag.id == scene.id);
        found += tag.id == scene.id && (tag.corners_px[0] - scene.corners[0]).norm() < 6 ? 1 : 0;
      }
    }
    CAPTURE(static_cast<int>(expected.kind), found);
    CHECK(found >= expected.found * kScenes - 1);
  }
}

TEST_CASE("A dark square that merges with a dark bar is found by its edges") {
  constexpr int kWidth = 160, kHeight = 120;
  std::vector<std::uint8_t> grey(std::size_t{kWidth} * kHeight, 200);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const bool square = u >= 40 && u < 90 && v >= 30 && v < 80;
      const bool bar = v >= 50 && v < 62 && u >= 90;
      if (square || bar) grey[static_cast<std::size_t>(v) * kWidth + u] = 40;
    }
  }
  SearchImage search;
  const image::LumaView view{grey.data(), kWidth, kHeight, kWidth};
  MakeSearchImage(view, {0, 0, kWidth, kHeight}, Reduction::kNone, search);
  Threshold threshold(std::nullopt);
  threshold.Apply(search, true);

  QuadFinder regions({});
  std::vector<Corners> quads;
  regions.Find(search, quads);
  const Corners truth{lens::Vec2(39.5, 29.5), {89.5, 29.5}, {89.5, 79.5}, {39.5, 79.5}};
  CHECK(std::ranges::none_of(quads, [&](const Corners& q) { return AreAlike(truth, q, 2); }));

  EdgeSegmentFinder finder;
  std::vector<EdgeSegment> segments;
  finder.Find(search, {.min_step = threshold.edge_range()}, segments);
  quads.clear();
  LineQuads().Find(search, segments, quads);
  CHECK(std::ranges::any_of(quads, [&](const Corners& q) { return AreAlike(truth, q, 2); }));
}

}  // namespace plumbline::tag_difficulty_test
