// Detection of a lens that changes during a capture, without false alarms for one that does not.
#include "app/vision/lens/capture_change.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "firmware-like/image/image_size.h"
#include "tests/app/vision/lens/rendered_views.h"

namespace plumbline::capture_change_test {

using namespace plumbline::vision;

namespace {

constexpr image::ImageSize kSize{1920, 1080};
constexpr double kNoise_px = 0.03;

CaptureChangeTest ChangesIn(const Capture& capture, std::uint64_t seed) {
  const target::Board board;
  const auto views = NoisyViews(DrawViews(capture, board, seed), board, kNoise_px, seed);
  const auto fit = FitLens(board, views, kSize);
  REQUIRE(fit);
  return TestForCaptureChanges(*fit, views, 1);
}

const CaptureChange& Of(const CaptureChangeTest& test, CaptureChange::Kind kind) {
  return test.changes[static_cast<std::size_t>(kind)];
}

}  // namespace

TEST_CASE("a jump of the focal length is found at the frame where it happened") {
  for (const double at : {0.25, 0.5, 0.75}) {
    Capture capture;
    capture.step = 0.002;
    capture.step_at = at;
    for (std::uint64_t seed = 71; seed <= 73; ++seed) {
      const CaptureChangeTest test = ChangesIn(capture, seed);
      const CaptureChange& change = Of(test, CaptureChange::Kind::kFocalLength);
      INFO("at " << at << ", seed " << seed << ", chi^2 " << change.chi2);
      CHECK(change.p_value < 1e-6);
      CHECK_FALSE(change.steady);
      CHECK(std::abs(static_cast<double>(change.first_view_after) - 20 * at) <= 2);
      CHECK(change.delta[kFx] == Approx(0.002 * 1700).epsilon(0.2));
    }
  }
}

TEST_CASE("a focal length that creeps and a principal point that shifts are distinguished") {
  Capture capture;
  capture.creep = 0.003;
  for (std::uint64_t seed = 81; seed <= 83; ++seed) {
    const CaptureChangeTest test = ChangesIn(capture, seed);
    const CaptureChange& change = Of(test, CaptureChange::Kind::kFocalLength);
    CHECK(change.p_value < 1e-6);
    CHECK(change.chi2 > Of(test, CaptureChange::Kind::kCentre).chi2);
  }
  capture.creep = 0;
  capture.shift_px = 4;
  for (std::uint64_t seed = 84; seed <= 86; ++seed) {
    const CaptureChangeTest test = ChangesIn(capture, seed);
    const CaptureChange& change = Of(test, CaptureChange::Kind::kCentre);
    CHECK(change.p_value < 1e-6);
    CHECK(change.chi2 > Of(test, CaptureChange::Kind::kFocalLength).chi2);
  }
}

TEST_CASE("a constant lens raises no alarm and rarely widens the covariance") {
  int widened = 0;
  for (std::uint64_t seed = 91; seed <= 110; ++seed) {
    const CaptureChangeTest test = ChangesIn({}, seed);
    // With 60 changes, a false alarm at this level is rare.
    for (const CaptureChange& change : test.changes) CHECK(change.p_value > 1e-4);
    widened += test.undetected_covariance(kFx, kFx) > 0;
  }
  // Expected in one of three; 14 or more of 20 once in two thousand.
  CHECK(widened < 14);
}

TEST_CASE("a change too small to be detected adds its effect to the covariance") {
  // A jump of 2.5 standard deviations; half of it is the error of the lens.
  Capture capture;
  capture.step = 0.0003;
  double mean_sd_px = 0;
  for (std::uint64_t seed = 61; seed <= 66; ++seed)
    mean_sd_px += std::sqrt(ChangesIn(capture, seed).undetected_covariance(kFx, kFx)) / 6;
  CHECK(mean_sd_px > 0.25 * 0.0003 * 1700);
  CHECK(mean_sd_px < 1.0 * 0.0003 * 1700);
}

TEST_CASE("the p-value of a scan falls with chi^2 and rises with the degrees of freedom") {
  CHECK(ScanPValue(0.5, 1, 0.05) == 1);
  CHECK(ScanPValue(12, 1, 0.05) < ScanPValue(10, 1, 0.05));
  CHECK(ScanPValue(12, 1, 0.05) < ScanPValue(12, 3, 0.05));
  CHECK(ScanPValue(12, 1, 0.15) < ScanPValue(12, 1, 0.05));
  // Andrews (1993), table I: critical values for one parameter at 5 %, 2003 corrigendum.
  CHECK(ScanPValue(8.68, 1, 0.15) == Approx(0.05).epsilon(0.15));
  CHECK(ScanPValue(12.16, 1, 0.15) == Approx(0.01).epsilon(0.15));
  CHECK(ScanPValue(1e6, 3, 0.05) == 0);
}

}  // namespace plumbline::capture_change_test
