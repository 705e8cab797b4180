#include "firmware-like/lens/lens_curve.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

namespace plumbline::lens_curve_test {

using namespace plumbline::lens;

namespace {

/// A synthetic zoom lens: ln f rises progressively over the counts with an individual wave, and
/// principal point and distortion vary with it.
struct MadeUpZoom {
  double range, linear, power, wave, phase;

  explicit MadeUpZoom(unsigned seed) {
    std::mt19937 random(seed);
    const auto draw = [&random](double a, double b) {
      return std::uniform_real_distribution(a, b)(random);
    };
    range = std::log(draw(6, 30));
    linear = draw(0.2, 0.9);
    power = draw(2, 5);
    wave = draw(-0.02, 0.02);
    phase = draw(0, 6);
  }
  double LogF(double counts) const {
    const double u = counts / 16384;
    return std::log(1000.0) + range * (linear * u + (1 - linear) * std::pow(u, power) +
                                       wave * std::sin(4 * u + phase));
  }
  Lens At(double counts) const {
    const double f = std::exp(LogF(counts)), s = std::log(f / 1000);
    return {f,           1.002 * f,       960 + 4 * s + 2 * std::sin(3 * s),
            540 - 3 * s, -0.2 + 0.11 * s, 0.03,
            1e-4,        -2e-4 * s,       0};
  }
  /// Counts at which ln f has covered the given fraction of its range.
  double CountsAt(double share) const {
    double low = 0, high = 16384;
    const double wanted = LogF(0) + share * (LogF(16384) - LogF(0));
    for (int i = 0; i < 60; ++i)
      (LogF(0.5 * (low + high)) < wanted ? low : high) = 0.5 * (low + high);
    return low;
  }
};

LensNode NodeAt(const MadeUpZoom& zoom, double counts, double relative_sd, std::mt19937& random) {
  std::normal_distribution<double> normal;
  LensNode node;
  node.zoom_counts = static_cast<std::int32_t>(counts);
  node.lens = zoom.At(node.zoom_counts);
  const double off = relative_sd * normal(random);
  node.lens.fx *= 1 + off;
  node.lens.fy *= 1 + off;
  const double sd = relative_sd * node.lens.fx;
  node.covariance.setIdentity();
  node.covariance *= 1e-12;
  node.covariance(0, 0) = node.covariance(1, 1) = node.covariance(0, 1) = node.covariance(1, 0) =
      sd * sd;
  return node;
}

/// `count` nodes, evenly in ln f.
LensCurve CurveOf(const MadeUpZoom& zoom, int count, double relative_sd, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<LensNode> nodes;
  for (int i = 0; i < count; ++i) {
    nodes.push_back(NodeAt(zoom, zoom.CountsAt(i / (count - 1.0)), relative_sd, random));
  }
  std::shuffle(nodes.begin(), nodes.end(), random);
  return LensCurve(nodes);
}

}  // namespace

TEST_CASE("slopes of the monotone cubic match values computed by hand") {
  // h = 1, 2, 1; slopes 1, 2, -1: harmonic in the middle of the first pair, 0 where the sign turns.
  const std::vector<double> x = {0, 1, 3, 4}, y = {0, 1, 5, 4};
  const std::vector<double> d = MonotoneSlopes(x, y);
  // w1 = 2*2+1 = 5, w2 = 2+2*1 = 4: 9 / (5/1 + 4/2) = 9/7
  CHECK(d[1] == Approx(9.0 / 7));
  CHECK(d[2] == 0);
  // ((2*1+2)*1 - 1*2) / 3 = 2/3;  right: ((2+2)*(-1) - 1*2) / 3 = -2, sign as m and |.| < 3 |m|
  CHECK(d[0] == Approx(2.0 / 3));
  CHECK(d[3] == Approx(-2));
  CHECK(MonotoneSlopes({5, 7}, {1, 4}) == std::vector<double>{1.5, 1.5});
  CHECK(MonotoneSlopes({5}, {1}) == std::vector<double>{0});
  // An end slope of the wrong sign is set to zero.
  CHECK(MonotoneSlopes({0, 1, 2}, {0, 1, 11})[0] == 0);
}

TEST_CASE("the cubic interpolates end values and slopes; its slope is its derivative") {
  const auto at = [](double x) { return CubicAt(2, 5, 1, 7, 0.5, 3, x); };
  CHECK(at(2).value == Approx(1));
  CHECK(at(5).value == Approx(7));
  CHECK(at(2).slope == Approx(0.5));
  CHECK(at(5).slope == Approx(3));
  for (double x = 2.1; x < 5; x += 0.3) {
    CHECK(at(x).slope == Approx((at(x + 1e-6).value - at(x - 1e-6).value) / 2e-6).margin(1e-6));
  }
}

TEST_CASE("monotone data remain monotone for any spacing") {
  std::mt19937 random(3);
  std::exponential_distribution<double> step(1);
  for (int run = 0; run < 300; ++run) {
    std::vector<double> x = {0}, y = {0};
    for (int i = 0; i < 9; ++i) {
      x.push_back(x.back() + 0.01 + std::pow(step(random), 3));
      y.push_back(y.back() + (i % 4 == 1 ? 0 : std::pow(step(random), 3)));
    }
    const std::vector<double> d = MonotoneSlopes(x, y);
    for (std::size_t i = 0; i + 1 < x.size(); ++i) {
      double before = y[i];
      for (double t = 0; t <= 1; t += 0.05) {
        const double value =
            CubicAt(x[i], x[i + 1], y[i], y[i + 1], d[i], d[i + 1], x[i] + t * (x[i + 1] - x[i]))
                .value;
        REQUIRE(value >= before - 1e-9 * y.back());
        before = value;
      }
    }
  }
}

TEST_CASE("a node is reproduced exactly with its covariance; beyond the nodes there is no lens") {
  const MadeUpZoom zoom(4);
  const LensCurve curve = CurveOf(zoom, 7, 1e-3, 1);
  for (const LensNode& node : curve.nodes()) {
    const auto at = curve.At(node.zoom_counts);
    REQUIRE(at);
    CHECK((VectorOfLens(at->lens) - VectorOfLens(node.lens)).norm() < 1e-9 * node.lens.fx);
    CHECK((at->covariance - node.covariance).norm() < 1e-9 * node.covariance.norm());
    CHECK(at->log_focal_sd == Approx(1e-3).epsilon(0.01));
  }
  CHECK_FALSE(curve.At(-1));
  CHECK_FALSE(curve.At(16385));
  CHECK_FALSE(curve.At(std::nan("")));
  CHECK_FALSE(LensCurve({}).At(0));
  const double per_count = curve.At(8000)->log_focal_per_count;
  CHECK(per_count ==
        Approx((std::log(curve.At(8001)->lens.fx) - std::log(curve.At(7999)->lens.fx)) / 2)
            .epsilon(1e-3));
}

TEST_CASE("the error decreases with more nodes") {
  double worst[2] = {0, 0};
  const int nodes[2] = {9, 21};
  for (unsigned seed = 0; seed < 50; ++seed) {
    const MadeUpZoom zoom(seed);
    for (int k = 0; k < 2; ++k) {
      const LensCurve curve = CurveOf(zoom, nodes[k], 0, seed);
      for (int c = 1; c < 16384; c += 37) {
        const auto at = curve.At(c);
        if (at) worst[k] = std::max(worst[k], std::abs(std::log(at->lens.fx) - zoom.LogF(c)));
      }
    }
  }
  CAPTURE(worst[0], worst[1]);
  CHECK(worst[0] < 0.03);
  CHECK(worst[1] < worst[0] / 4);
}

TEST_CASE("the stated deviation covers the actual error without being excessive") {
  struct Case {
    int nodes;
    double relative_sd;
  };
  for (const Case& c : {Case{2, 0}, Case{3, 0}, Case{5, 0}, Case{9, 0}, Case{21, 0}, Case{9, 1e-3},
                        Case{21, 1e-3}}) {
    int inside = 0, total = 0, inside_cx = 0;
    double error_square = 0, claimed_square = 0;
    for (unsigned seed = 1000; seed < 1300; ++seed) {
      const MadeUpZoom zoom(seed);
      const LensCurve curve = CurveOf(zoom, c.nodes, c.relative_sd, seed);
      for (double place = 0.013; place < 0.99; place += 0.0517) {  // never at a node
        const double counts = std::round(zoom.CountsAt(place));
        const auto at = curve.At(counts);
        REQUIRE(at);
        const double error = std::log(at->lens.fx) - zoom.LogF(counts);
        ++total;
        inside += std::abs(error) < 2 * at->log_focal_sd ? 1 : 0;
        inside_cx +=
            std::abs(at->lens.cx - zoom.At(counts).cx) < 2 * std::sqrt(at->covariance(2, 2)) ? 1
                                                                                             : 0;
        error_square += error * error;
        claimed_square += at->log_focal_sd * at->log_focal_sd;
      }
    }
    CAPTURE(c.nodes, c.relative_sd, inside, inside_cx, total, std::sqrt(error_square / total),
            std::sqrt(claimed_square / total));
    CHECK(inside > 0.95 * total);
    CHECK(inside_cx > 0.9 * total);
    CHECK(claimed_square < 25 * error_square);
  }
}

TEST_CASE("unusable nodes are ignored; of two nodes at one zoom the last is used") {
  std::mt19937 random(1);
  const MadeUpZoom zoom(1);
  LensNode good = NodeAt(zoom, 100, 0, random), later = good, bad = NodeAt(zoom, 200, 0, random);
  later.lens.fx = 1234;
  bad.lens.fy = 0;
  LensNode wild = bad;
  wild.lens.fy = 1;
  wild.lens.cx = std::nan("");
  const LensCurve curve({good, bad, wild, later});
  REQUIRE(curve.nodes().size() == 1);
  CHECK(curve.At(100)->lens.fx == 1234);
  CHECK_FALSE(curve.At(101));
}

}  // namespace plumbline::lens_curve_test
