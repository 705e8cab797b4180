// A lens that moves between the views is told, whenever it moves, and one that stands still is not.
#include "app/lens/standstill.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/app/lens/rendered_views.h"

namespace plumbline {
namespace {

constexpr ImageSize kSize{1920, 1080};
constexpr double kNoise_px = 0.03;

Standstill StandstillIn(const Capture& capture, std::uint64_t seed) {
  const Board board;
  const auto views = NoisyViews(DrawViews(capture, board, seed), board, kNoise_px, seed);
  const auto fit = FitLens(board, views, kSize);
  REQUIRE(fit);
  return StandstillOf(*fit, views, 1);
}

const Change& Of(const Standstill& standstill, Change::Of of) {
  return standstill.changes[static_cast<std::size_t>(of)];
}

}  // namespace

TEST_CASE("a jump of the focal length is found at the frame where it happened") {
  for (const double at : {0.25, 0.5, 0.75}) {
    Capture capture;
    capture.step = 0.002;
    capture.step_at = at;
    for (std::uint64_t seed = 71; seed <= 73; ++seed) {
      const Standstill standstill = StandstillIn(capture, seed);
      const Change& change = Of(standstill, Change::Of::kFocalLength);
      INFO("at " << at << ", seed " << seed << ", chi^2 " << change.chi2);
      CHECK(change.chance < 1e-6);
      CHECK_FALSE(change.steady);
      CHECK(std::abs(static_cast<double>(change.at) - 20 * at) <= 2);
      CHECK(change.by[kFx] == Approx(0.002 * 1700).epsilon(0.2));
    }
  }
}

TEST_CASE("a lens that creeps and a centre that shifts are told apart") {
  Capture capture;
  capture.creep = 0.003;
  for (std::uint64_t seed = 81; seed <= 83; ++seed) {
    const Standstill standstill = StandstillIn(capture, seed);
    const Change& change = Of(standstill, Change::Of::kFocalLength);
    CHECK(change.chance < 1e-6);
    CHECK(change.chi2 > Of(standstill, Change::Of::kCentre).chi2);
  }
  capture.creep = 0;
  capture.shift_px = 4;
  for (std::uint64_t seed = 84; seed <= 86; ++seed) {
    const Standstill standstill = StandstillIn(capture, seed);
    const Change& change = Of(standstill, Change::Of::kCentre);
    CHECK(change.chance < 1e-6);
    CHECK(change.chi2 > Of(standstill, Change::Of::kFocalLength).chi2);
  }
}

TEST_CASE("a lens that stands still is not said to have moved, and doubted little") {
  int doubted = 0;
  for (std::uint64_t seed = 91; seed <= 110; ++seed) {
    const Standstill standstill = StandstillIn({}, seed);
    // Each of 60 changes is that unlikely once in ten thousand.
    for (const Change& change : standstill.changes) CHECK(change.chance > 1e-4);
    doubted += standstill.doubt(kFx, kFx) > 0;
  }
  // One in three: 14 or more of 20 once in two thousand.
  CHECK(doubted < 14);
}

TEST_CASE("a change too small to be told adds its effect to the covariance") {
  // A jump of two and a half standard deviations: half of it is the lens's error.
  Capture capture;
  capture.step = 0.0003;
  double doubt = 0;
  for (std::uint64_t seed = 61; seed <= 66; ++seed)
    doubt += std::sqrt(StandstillIn(capture, seed).doubt(kFx, kFx)) / 6;
  CHECK(doubt > 0.25 * 0.0003 * 1700);
  CHECK(doubt < 1.0 * 0.0003 * 1700);
}

TEST_CASE("the chance of a scan falls with what is seen and rises with the freedom") {
  CHECK(ChanceOfScan(0.5, 1, 0.05) == 1);
  CHECK(ChanceOfScan(12, 1, 0.05) < ChanceOfScan(10, 1, 0.05));
  CHECK(ChanceOfScan(12, 1, 0.05) < ChanceOfScan(12, 3, 0.05));
  CHECK(ChanceOfScan(12, 1, 0.15) < ChanceOfScan(12, 1, 0.05));
  // Andrews (1993), table I: critical values for one parameter at 5 %, 2003 corrigendum.
  CHECK(ChanceOfScan(8.68, 1, 0.15) == Approx(0.05).epsilon(0.15));
  CHECK(ChanceOfScan(12.16, 1, 0.15) == Approx(0.01).epsilon(0.15));
  CHECK(ChanceOfScan(1e6, 3, 0.05) == 0);
}

}  // namespace plumbline
