#include "app/camera/marks_look.h"

#include <catch2/catch.hpp>

#include "tests/app/camera/marks_scene.h"

using namespace plumbline;
using namespace plumbline::test;

namespace {

struct Station {
  Body cell = CellMarks();
  Pose X = CellInCamera();
  LensInUse lens;
  Station() {
    lens.known.lens = MarksLens();
    lens.known.covariance.diagonal() << 0.25, 0.25, 1, 1, 1e-8, 1e-8, 1e-12, 1e-12, 0;
    lens.known.size = {1920, 1080};
    lens.calibrated = true;
  }
  MarksLook Look(const Lens& real, const Pose& pose, const MarksMemory* memory,
                 std::uint64_t seed) const {
    return LookAtMarks(lens, memory, cell, SeenMarks(real, cell, pose, 0.05, seed), 0.5);
  }
};

Lens Zoomed(Lens lens, double share) {
  lens.fx *= 1 + share;
  lens.fy *= 1 + share;
  return lens;
}

}  // namespace

TEST_CASE("first look, later look, drift, step") {
  Station station;
  const Lens real = station.lens.known.lens;
  const MarksLook first = station.Look(real, station.X, nullptr, 1);
  REQUIRE(first.verdict == MarksVerdict::kGood);
  REQUIRE(first.memory);
  CHECK_FALSE(first.lens);
  const MarksLook second = station.Look(real, station.X, &*first.memory, 2);
  CHECK(second.verdict == MarksVerdict::kGood);
  CHECK_FALSE(second.memory);
  CHECK(second.words.empty());

  const Lens drifted = Zoomed(real, 2e-3);
  const MarksLook drift = station.Look(drifted, station.X, &*first.memory, 3);
  REQUIRE(drift.verdict == MarksVerdict::kZoomDrifted);
  REQUIRE((drift.lens && drift.memory));
  CHECK(drift.lens->lens.fx == Approx(drifted.fx).epsilon(2e-4));
  CHECK_THAT(drift.words, Catch::Contains("focal length +0.2"));
  station.lens.known = *drift.lens;
  CHECK(station.Look(drifted, station.X, &*drift.memory, 4).verdict == MarksVerdict::kGood);

  Pose stepped = station.X;
  stepped.p.x() += 0.01;
  const MarksLook step = station.Look(drifted, stepped, &*drift.memory, 5);
  REQUIRE(step.verdict == MarksVerdict::kCameraMoved);
  CHECK_THAT(step.words, Catch::Matches("the camera was moved by (9|10)\\..*"));
  CHECK(station.Look(drifted, stepped, &*step.memory, 6).verdict == MarksVerdict::kGood);
  Lens other = Zoomed(drifted, 0.02);
  other.k1 += 0.1;
  const MarksLook bad = station.Look(other, stepped, &*step.memory, 7);
  CHECK(bad.verdict == MarksVerdict::kBad);
  CHECK_THAT(bad.words, Catch::Contains("neither"));
}

TEST_CASE("an interpolated lens is good where the marks make it certain enough") {
  Station station;
  const Lens real = station.lens.known.lens;
  station.lens.calibrated = false;
  station.lens.log_focal_sd = 0.01;
  station.lens.known.lens = Zoomed(real, 0.008);
  station.lens.known.covariance.topLeftCorner<2, 2>().setConstant(std::pow(0.01 * real.fx, 2));
  const MarksLook look = station.Look(real, station.X, nullptr, 1);
  CHECK(look.verdict == MarksVerdict::kBad);  // 0.1 % of f: a pixel at the corner
  CHECK_THAT(look.words, Catch::Contains("interpolated, and uncertain by"));
  CHECK_FALSE(look.lens);
  const MarksLook generous = LookAtMarks(station.lens, nullptr, station.cell,
                                         SeenMarks(real, station.cell, station.X, 0.05, 2), 20);
  REQUIRE(generous.verdict == MarksVerdict::kGood);
  REQUIRE((generous.lens && generous.memory));
  CHECK(generous.lens->lens.fx ==
        Approx(real.fx).margin(4 * std::sqrt(generous.lens->covariance(0, 0))));
}
