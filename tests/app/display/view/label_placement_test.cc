#include "app/display/view/label_placement.h"

#include <catch2/catch.hpp>
#include <random>

#include "app/display/view/screen_text.h"
#include "app/display/view/tip_inset.h"

namespace plumbline::label_placement_test {

using namespace plumbline::display;

namespace {

constexpr scene::Area kImage{100, 50, 1000, 600};
constexpr float kEm = 20;

}  // namespace

TEST_CASE("labels cover neither marks nor each other, and stay in the image") {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> x(kImage.x, kImage.right()), y(kImage.y, kImage.bottom());
  std::size_t placed_in_all = 0;
  for (int scene = 0; scene < 30; ++scene) {
    LabelPlacer placer(kImage, kEm);
    std::vector<scene::PicturePoint> points;
    std::vector<scene::Area> marks;
    for (int k = 0; k < 12; ++k) {
      points.push_back({x(random), y(random)});
      marks.push_back({points.back().x - kEm, points.back().y - kEm, 2 * kEm, 2 * kEm});
      placer.KeepClear(marks.back());
    }
    std::vector<PlacedLabel> labels;
    for (const scene::PicturePoint& point : points) {
      const auto placed = placer.Place(point, 160, 26);
      if (!placed) continue;
      labels.push_back(*placed);
      CHECK(placed->leader.from.x == point.x);
      CHECK(placed->leader.from.y == point.y);
    }
    placed_in_all += labels.size();
    for (std::size_t a = 0; a < labels.size(); ++a) {
      CHECK(OverlapOf(labels[a].area, kImage) == Approx(160 * 26));
      for (const scene::Area& mark : marks) CHECK(OverlapOf(labels[a].area, mark) == 0);
      for (std::size_t b = 0; b < a; ++b) CHECK(OverlapOf(labels[a].area, labels[b].area) == 0);
    }
  }
  CHECK(placed_in_all >= 30 * 12 * 95 / 100);
}

TEST_CASE("a label is placed to the right of a free point; outside the image there is none") {
  LabelPlacer placer(kImage, kEm);
  const auto placed = placer.Place({500, 300}, 160, 26);
  REQUIRE(placed);
  CHECK(placed->area.x == Approx(500 + 1.6 * 20));
  CHECK(placed->area.y == Approx(300 - 13));
  CHECK_FALSE(placer.Place({50, 300}, 160, 26));
  LabelPlacer full(kImage, kEm);
  full.KeepClear(kImage);
  CHECK_FALSE(full.Place({500, 300}, 160, 26));
  CHECK_FALSE(full.TakeFreeCorner(100, 100, {Corner::kTopLeft}));
}

TEST_CASE("a leader line avoids the label of a neighbour") {
  LabelPlacer placer(kImage, kEm);
  const auto first = placer.Place({500, 300}, 160, 26);
  const auto second = placer.Place({480, 300}, 160, 26);
  REQUIRE((first && second));
  // To the right of the second point lies the first one's label.
  CHECK(second->leader.to.x < first->area.x);
}

TEST_CASE("a leader line covers no other mark, even where the way around it is long") {
  LabelPlacer placer(kImage, kEm);
  // Marks in a ring around the point, with a gap below.
  const scene::PicturePoint at{600, 350};
  for (const float x : {-60.0F, 60.0F}) placer.KeepClear({at.x + x - 10, at.y - 60, 20, 120});
  placer.KeepClear({at.x - 60, at.y - 70, 120, 20});
  const auto placed = placer.Place(at, 160, 26);
  REQUIRE(placed);
  CHECK(placed->leader.to.y > at.y + 60);
  placer.KeepClear({at.x - 60, at.y + 50, 120, 20});
  CHECK_FALSE(placer.Place(at, 160, 26));
  // A mark that contains the point itself is no obstacle.
  LabelPlacer inside(kImage, kEm);
  inside.KeepClear({at.x - 100, at.y - 40, 200, 80});
  CHECK(inside.Place(at, 160, 26));
}

TEST_CASE("a leader line passes behind labels") {
  const LeaderLine line{{0, 0}, {100, 0}};
  const PlacedLabel first{{20, -5, 30, 10}, {}}, at_its_end{{90, -5, 30, 10}, {}};
  const std::vector<LeaderLine> parts = PartsOutside(line, {first, at_its_end});
  REQUIRE(parts.size() == 2);
  CHECK(parts[0].from.x == 0);
  CHECK(parts[0].to.x == Approx(20));
  CHECK(parts[1].from.x == Approx(50));
  CHECK(parts[1].to.x == Approx(90));
  CHECK(PartsOutside(line, {{{0, -5, 100, 10}, {}}}).empty());
}

TEST_CASE("corners are taken in order, or where least is covered") {
  LabelPlacer placer(kImage, kEm);
  placer.KeepClear({kImage.x, kImage.y, 200, 200});
  const scene::Area area = placer.TakeCorner(100, 100, {Corner::kTopLeft, Corner::kBottomRight});
  CHECK(area.right() == Approx(kImage.right() - 0.6F * kEm));
  CHECK(area.bottom() == Approx(kImage.bottom() - 0.6F * kEm));
}

TEST_CASE("scale bars and ticks are 1, 2 or 5 times a power of ten") {
  CHECK(RoundedDown125(4.9) == Approx(2));
  CHECK(RoundedDown125(0.051) == Approx(0.05));
  CHECK(RoundedDown125(1000) == Approx(1000));
  for (const double full : {0.3, 1.0, 7.0, 20.0, 250.0, 999.0}) {
    const std::vector<double> ticks = ScaleTicks(full);
    CAPTURE(full, ticks.size());
    CHECK(ticks.front() == 0);
    CHECK(ticks.back() <= full * 1.001);
    CHECK(ticks.size() >= 4);
    CHECK(ticks.size() <= 8);
  }
}

}  // namespace plumbline::label_placement_test
