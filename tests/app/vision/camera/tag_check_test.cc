#include "app/vision/camera/tag_check.h"

#include <catch2/catch.hpp>

#include "tests/app/vision/camera/reference_tag_scene.h"

namespace plumbline::tag_check_test {

using namespace plumbline::vision;
using namespace plumbline::test;

namespace {

struct Station {
  target::Body cell = CellTags();
  Pose X = CellInCamera();
  ActiveLens lens;
  Station() {
    lens.known.lens = TagSceneLens();
    lens.known.covariance.diagonal().head<9>() << 0.25, 0.25, 1, 1, 1e-8, 1e-8, 1e-12, 1e-12, 0;
    lens.known.size = {1920, 1080};
    lens.calibrated = true;
  }
  TagCheck Check(const lens::Lens& real, const Pose& pose, const TagBaseline* baseline,
                 std::uint64_t seed) const {
    return CheckReferenceTags(lens, baseline, cell, ObserveTags(real, cell, pose, 0.05, seed), 0.5);
  }
};

}  // namespace

TEST_CASE("first check, second check, zoom drift, camera step") {
  Station station;
  const lens::Lens real = station.lens.known.lens;
  const TagCheck first = station.Check(real, station.X, nullptr, 1);
  REQUIRE(first.verdict == TagTestOutcome::kGood);
  REQUIRE(first.baseline);
  CHECK_FALSE(first.lens);
  const TagCheck second = station.Check(real, station.X, &*first.baseline, 2);
  CHECK(second.verdict == TagTestOutcome::kGood);
  CHECK_FALSE(second.baseline);
  CHECK(second.message.empty());

  const lens::Lens drifted = Zoomed(real, 2e-3);
  const TagCheck drift = station.Check(drifted, station.X, &*first.baseline, 3);
  REQUIRE(drift.verdict == TagTestOutcome::kZoomDrifted);
  REQUIRE((drift.lens && drift.baseline));
  CHECK(drift.lens->lens.fx == Approx(drifted.fx).epsilon(2e-4));
  CHECK_THAT(drift.message, Catch::Contains("focal length +0.2"));
  station.lens.known = *drift.lens;
  CHECK(station.Check(drifted, station.X, &*drift.baseline, 4).verdict == TagTestOutcome::kGood);

  Pose stepped = station.X;
  stepped.p.x() += 0.01;
  const TagCheck step = station.Check(drifted, stepped, &*drift.baseline, 5);
  REQUIRE(step.verdict == TagTestOutcome::kCameraMoved);
  CHECK_THAT(step.message, Catch::Matches("the camera was moved by (9|10)\\..*"));
  CHECK(station.Check(drifted, stepped, &*step.baseline, 6).verdict == TagTestOutcome::kGood);
  lens::Lens other = Zoomed(drifted, 0.02);
  other.k1 += 0.1;
  const TagCheck bad = station.Check(other, stepped, &*step.baseline, 7);
  CHECK(bad.verdict == TagTestOutcome::kBad);
  CHECK_THAT(bad.message, Catch::Contains("neither"));
}

TEST_CASE("an interpolated lens is good if the tags determine it well enough") {
  Station station;
  const lens::Lens real = station.lens.known.lens;
  station.lens.calibrated = false;
  station.lens.log_focal_sd = 0.01;
  station.lens.known.lens = Zoomed(real, 0.008);
  station.lens.known.covariance.topLeftCorner<2, 2>().setConstant(std::pow(0.01 * real.fx, 2));
  const TagCheck check = station.Check(real, station.X, nullptr, 1);
  CHECK(check.verdict == TagTestOutcome::kBad);  // 0.1 % of f: a pixel at the corner
  CHECK_THAT(check.message, Catch::Contains("interpolated, and its projection uncertainty of"));
  CHECK_FALSE(check.lens);
  const TagCheck generous = CheckReferenceTags(
      station.lens, nullptr, station.cell, ObserveTags(real, station.cell, station.X, 0.05, 2), 20);
  REQUIRE(generous.verdict == TagTestOutcome::kGood);
  REQUIRE((generous.lens && generous.baseline));
  CHECK(generous.lens->lens.fx ==
        Approx(real.fx).margin(4 * std::sqrt(generous.lens->covariance(0, 0))));
}

}  // namespace plumbline::tag_check_test
