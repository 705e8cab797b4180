// Comparison with the calibration library mrcal on the same corners: error and stated uncertainty
// of fx.
#include <catch2/catch.hpp>
#include <iostream>

#include "app/vision/lens/lens_fit.h"
#include "firmware-like/image/image_size.h"
#include "tests/app/vision/lens/rendered_views.h"
#include "tests/peers/mrcal_peer.h"

namespace plumbline::mrcal_test {

using namespace plumbline::vision;

namespace {

constexpr image::ImageSize kSize{1920, 1080};
constexpr double kNoise_px = 0.03;
constexpr int kSeeds = 30;

double RmsOf(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

}  // namespace

TEST_CASE("the focal length error is at most mrcal's and consistent with its stated uncertainty",
          "[peer]") {
  if (!HasMrcal()) {
    WARN("SKIPPED: built without mrcal (libmrcal-dev)");
    std::cout << "SKIPPED: no mrcal\n";
    return;
  }
  const target::Board board;
  for (const double f : {1700.0, 5000.0, 12000.0}) {
    Capture capture;
    capture.f = f;
    std::vector<double> ours, theirs, z;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      const auto views = NoisyViews(DrawViews(capture, board, seed), board, kNoise_px, seed);
      const auto fit = FitLens(board, views, kSize);
      REQUIRE(fit);
      const auto mrcal =
          SolveWithMrcal(board, views, kSize, LensFromShared(fit->shared), fit->X_CK);
      REQUIRE(mrcal);
      const double truth = renderer::ZoomLens(f).fx;
      ours.push_back(fit->shared[kFx] - truth);
      theirs.push_back(mrcal->lens.fx - truth);
      z.push_back(ours.back() / std::sqrt(fit->covariance(kFx, kFx)));
    }
    INFO("f " << f << ": ours " << RmsOf(ours) << " px, mrcal " << RmsOf(theirs) << " px");
    // Two equally good estimates whose errors correlate by 0.95 differ by 6 % over 30 seeds.
    CHECK(RmsOf(ours) < 1.1 * RmsOf(theirs));
    // chi^2 with 30 degrees of freedom: outside these limits once in a thousand.
    CHECK(RmsOf(z) < std::sqrt(59.7 / kSeeds));
    CHECK(RmsOf(z) > std::sqrt(11.6 / kSeeds));
  }
}

}  // namespace plumbline::mrcal_test
