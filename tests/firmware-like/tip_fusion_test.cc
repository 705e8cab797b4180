// Fusion of two cameras against a Monte Carlo sample of their errors.
#include "firmware-like/tip_fusion.h"

#include <Eigen/Cholesky>
#include <array>
#include <catch2/catch.hpp>
#include <random>

namespace plumbline::tip_fusion_test {

namespace {

/// Precise across the viewing direction, ten times worse along it.
Mat3 Along(int axis, double across_m) {
  Mat3 covariance = across_m * across_m * Mat3::Identity();
  covariance(axis, axis) *= 100;
  return covariance;
}

}  // namespace

TEST_CASE("the mean of two cameras has the stated covariance, and false disagreement is rare") {
  const Vec3 truth(2, 0.5, 1);
  std::mt19937_64 random(5);
  std::normal_distribution<double> N;
  const auto error = [&](const Mat3& covariance) {
    return Vec3(covariance.llt().matrixL() * Vec3(N(random), N(random), N(random)));
  };
  std::array<MeasuredTip, 2> tips;
  tips[0].covariance_W = Along(0, 5e-5);
  tips[1].covariance_W = Along(1, 8e-5);
  tips[0].tag_covariance_W = Along(2, 1e-4);
  tips[1].tag_covariance_W = 4e-8 * Mat3::Identity();
  constexpr int kDraws = 20000;
  Mat3 seen = Mat3::Zero();
  TipFusion fused;
  int disagree = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    for (MeasuredTip& tip : tips) {
      tip.p_W = truth + error(tip.covariance_W) + error(tip.tag_covariance_W);
    }
    fused = FuseTips(tips);
    const Vec3 off = fused.tip.p_W - truth;
    seen += off * off.transpose() / kDraws;
    disagree += fused.agree ? 0 : 1;
  }
  const Mat3 stated = fused.tip.covariance_W + fused.tip.tag_covariance_W;
  CHECK((seen - stated).norm() < 0.05 * stated.norm());
  CHECK(disagree <= 4);  // expected: 0.2
  // Each camera is strong where the other is weak.
  for (int axis = 0; axis < 3; ++axis) {
    for (const MeasuredTip& tip : tips) {
      CHECK(fused.tip.covariance_W(axis, axis) < tip.covariance_W(axis, axis));
    }
  }
}

TEST_CASE("a single tip is unchanged; six deviations or a missing covariance mean disagreement") {
  std::array<MeasuredTip, 2> tips;
  for (MeasuredTip& tip : tips) tip = {Vec3(1, 2, 3), Along(0, 1e-4), Mat3::Zero()};
  const TipFusion one = FuseTips(std::span(tips).first(1));
  CHECK(one.agree);
  CHECK(one.tip.p_W == tips[0].p_W);
  CHECK(one.tip.covariance_W == tips[0].covariance_W);
  CHECK(FuseTips(tips).agree);
  tips[1].p_W.x() += 6e-3;  // the standard deviation of the difference is 1.4 mm here
  CHECK(FuseTips(tips).agree);
  tips[1].p_W.x() += 6e-3;
  CHECK_FALSE(FuseTips(tips).agree);
  tips[1].covariance_W.setZero();
  CHECK_FALSE(FuseTips(tips).agree);
}

}  // namespace plumbline::tip_fusion_test
