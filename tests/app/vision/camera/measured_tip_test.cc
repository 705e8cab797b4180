#include "app/vision/camera/measured_tip.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>

#include "tests/app/vision/camera/reference_tag_scene.h"

namespace plumbline::measured_tip_test {

using namespace plumbline::vision;
using namespace plumbline::test;

namespace {

/// A gripper with six tags on 400 x 200 mm and its tip 300 mm to the side.
target::Body Gripper() {
  target::Body body{"gripper", {}};
  for (int k = 0; k < 6; ++k) {
    body.tags.push_back(
        {20 + k,
         0.06,
         {Mat3::Identity(), Vec3(0.17 * (k % 3 - 1), k < 3 ? -0.07 : 0.07, 0.004 * k)}});
  }
  return body;
}
const Vec3 kTip(0.3, 0.05, 0.02);
const Pose kCellInW{RotationFromRollPitchYaw(Vec3(0.3, -0.2, 1.1)), Vec3(1, 2, 0.5)};

}  // namespace

TEST_CASE("the tip error matches the stated covariance, including the lens error") {
  const target::Body cell = CellTags(4), gripper = Gripper();
  const Pose X_CK = CellInCamera();
  const Pose X_CT{RotationFromRollPitchYaw(Vec3(-0.2, 0.25, 0.4)), Vec3(-0.1, 0.05, 1.5)};
  const Vec3 truth = kCellInW * (X_CK.Inverse() * (X_CT * kTip));
  lens::LensCovariance lens_covariance = lens::LensCovariance::Zero();
  lens_covariance.diagonal().head<9>() << 4, 4, 9, 9, 1e-6, 1e-6, 1e-10, 1e-10, 0;
  constexpr int kSeeds = 400;
  double chi2 = 0, squares = 0, apart = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal(0, 1);
    lens::KnownLens known{TagSceneLens(), lens_covariance};
    lens::Lens real = known.lens;
    real.fx += 2 * normal(random);
    real.fy += 2 * normal(random);
    real.cx += 3 * normal(random);
    real.cy += 3 * normal(random);
    real.k1 += 1e-3 * normal(random);
    auto seen = ObserveTags(real, cell, X_CK, 0.05, 10 * seed);
    for (const vision::SeenTag& tag : ObserveTags(real, gripper, X_CT, 0.05, 10 * seed + 1))
      seen.push_back(tag);
    const auto cell_seen = vision::LocateBody(known, cell, seen, std::nullopt);
    const auto tool_seen = vision::LocateBody(known, gripper, seen, std::nullopt);
    REQUIRE((cell_seen && tool_seen));
    const CameraPoint tip =
        MeasurePoint(cell_seen->estimate, tool_seen->estimate, kCellInW, kTip, lens_covariance, 0);
    const Vec3 error = tip.p_W - truth;
    chi2 += error.dot(tip.covariance_W.ldlt().solve(error));
    squares += error.squaredNorm();
    apart += tip.covariance_W.trace();
  }
  CHECK(std::sqrt(chi2 / (3 * kSeeds)) == Approx(1).epsilon(0.1));
  CHECK(std::sqrt(squares / apart) == Approx(1).epsilon(0.12));
  CHECK(std::sqrt(squares / kSeeds) < 1e-3);
}

TEST_CASE("errors of the tags' declared places are stated and are not reduced by averaging") {
  // The tags are displaced from their declared places, differently in each run.
  constexpr double kCellSd_m = 3e-4, kToolSd_m = 1e-4;
  target::Body cell = CellTags(4), gripper = Gripper();
  cell.place_sd_m = kCellSd_m;
  gripper.place_sd_m = kToolSd_m;
  const Pose X_CK = CellInCamera();
  const Pose X_CT{RotationFromRollPitchYaw(Vec3(-0.2, 0.25, 0.4)), Vec3(-0.1, 0.05, 1.5)};
  const Vec3 truth = kCellInW * (X_CK.Inverse() * (X_CT * kTip));
  constexpr int kRuns = 400;
  double chi2 = 0, by_noise = 0;
  for (int run = 1; run <= kRuns; ++run) {
    std::mt19937_64 random(run);
    std::normal_distribution<double> normal(0, 1);
    const auto moved = [&](target::Body body, double sd_m) {
      for (target::BodyTag& tag : body.tags) {
        tag.X_KM.p += sd_m * Vec3(normal(random), normal(random), normal(random));
      }
      return body;
    };
    const lens::KnownLens known{TagSceneLens(), lens::LensCovariance::Zero()};
    auto seen = ObserveTags(known.lens, moved(cell, kCellSd_m), X_CK, 0.05, 10 * run);
    for (const vision::SeenTag& tag :
         ObserveTags(known.lens, moved(gripper, kToolSd_m), X_CT, 0.05, 10 * run + 1)) {
      seen.push_back(tag);
    }
    const auto cell_seen = vision::LocateBody(known, cell, seen, std::nullopt);
    const auto tool_seen = vision::LocateBody(known, gripper, seen, std::nullopt);
    REQUIRE((cell_seen && tool_seen));
    REQUIRE((cell_seen->left_out.empty() && tool_seen->left_out.empty()));
    const CameraPoint tip = MeasurePoint(cell_seen->estimate, tool_seen->estimate, kCellInW, kTip,
                                         known.covariance, 0, {kCellSd_m, kToolSd_m});
    const Vec3 error = tip.p_W - truth;
    chi2 += error.dot((tip.covariance_W + tip.tag_covariance_W).ldlt().solve(error));
    by_noise += error.dot(tip.covariance_W.ldlt().solve(error));
  }
  CHECK(std::sqrt(chi2 / (3 * kRuns)) == Approx(1).epsilon(0.1));
  CHECK(std::sqrt(by_noise / (3 * kRuns)) > 2);  // without them it would be a lie
}

TEST_CASE("the placement error of a single tag is that of its body") {
  const lens::KnownLens known{TagSceneLens(), lens::LensCovariance::Zero()};
  const target::Body one{"one", {{7, 0.08, {Mat3::Identity(), Vec3::Zero()}}}};
  const Pose X{RotationFromRollPitchYaw(Vec3(0.4, 0.3, 0.1)), Vec3(0, 0, 1)};
  const auto located =
      vision::LocateBody(known, one, ObserveTags(known.lens, one, X, 0, 1), std::optional(X));
  REQUIRE(located);
  vision::Mat6 expected = vision::Mat6::Zero();
  expected.topLeftCorner<3, 3>().setIdentity();
  CHECK((located->estimate.unit_position_covariance - expected).cwiseAbs().maxCoeff() < 1e-6);
}

TEST_CASE("the tip is stationary only while three samples agree") {
  StationaryPointFilter filter;
  CameraPoint point;
  point.covariance_W = 1e-10 * Mat3::Identity();
  point.p_W = Vec3(1, 2, 3);
  const auto take = [&](double time_s, double x) {
    point.time_s = time_s;
    point.p_W.x() = x;
    filter.Take(point);
  };
  take(0.0, 1.0);
  take(0.1, 1.00001);
  CHECK_FALSE(filter.Point());
  take(0.2, 0.99999);
  REQUIRE(filter.Point());
  CHECK(filter.Point()->p_W.x() == Approx(1).margin(1e-9));
  CHECK(filter.Point()->time_s == 0.2);
  take(0.3, 1.0005);
  CHECK_FALSE(filter.Point());
  take(0.4, 1.0005);
  take(0.5, 1.0005);
  CHECK(filter.Point());
  take(2.5, 1.0005);  // after a gap the samples are discarded
  CHECK_FALSE(filter.Point());
  take(2.6, NAN);
  take(2.7, 1.0005);
  take(2.8, 1.0005);
  CHECK_FALSE(filter.Point());
}

}  // namespace plumbline::measured_tip_test
