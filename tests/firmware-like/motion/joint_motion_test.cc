#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "firmware-like/motion/motion_observer.h"

namespace plumbline::joint_motion_test {

using motion::JointMotion;
using motion::JointMotionEstimator;

namespace {

constexpr double kMove_s = 1.2, kTravel_rad = 1.0, kPeak = 4.0;  // [rad/s^2]

/// A move of two joints along the quintic 10 x^3 - 15 x^4 + 6 x^5.
struct Move {
  static double Position(double t_s) {
    const double x = std::clamp(t_s / kMove_s, 0.0, 1.0);
    return kTravel_rad * x * x * x * (10 + x * (6 * x - 15));
  }
  static double Acceleration(double t_s) {
    const double x = t_s / kMove_s;
    if (x < 0 || x > 1) return 0;
    return kTravel_rad / (kMove_s * kMove_s) * x * (60 + x * (120 * x - 180));
  }
};

/// How a controller and a poll sample the move.
struct Link {
  double poll_s = 0.01;
  double jitter_s = 0;   ///< sd of the arrival times
  double refresh_s = 0;  ///< cycle of the controller; 0: continuous
  double step_rad = 0;   ///< of the register
};

struct Result {
  int estimates = 0, none = 0, covered = 0;
  double largest_error = 0, mean_sd = 0;
};

/// Smallest deviation from the true accelerations within one refresh period before t: a reading may
/// be that much older than its arrival.
double ErrorOf(double qdd, double t_s, double refresh_s) {
  double least = std::abs(qdd - Move::Acceleration(t_s));
  constexpr int kParts = 10;
  for (int k = 1; refresh_s > 0 && k <= kParts; ++k) {
    const double before_s = refresh_s * k / kParts;
    least = std::min(least, std::abs(qdd - Move::Acceleration(t_s - before_s)));
  }
  return least;
}

/// Estimates every 10 ms of one move, each against the true acceleration at its instant.
Result Run(const Link& link, unsigned seed, double allowance = 0) {
  std::mt19937 random(seed);
  std::normal_distribution<double> jitter(0, link.jitter_s > 0 ? link.jitter_s : 1);
  const double phase_s = std::uniform_real_distribution(0.0, 0.02)(random);
  JointMotionEstimator estimator;
  Result result;
  for (int k = 0; phase_s + k * link.poll_s < kMove_s; ++k) {
    const double polled_s = phase_s + k * link.poll_s;
    const double sampled_s =
        link.refresh_s > 0 ? link.refresh_s * std::floor(polled_s / link.refresh_s) : polled_s;
    model::RobotState reading;
    reading.sequence = static_cast<std::uint64_t>(k + 1);
    reading.timestamp_s = 100 + polled_s + (link.jitter_s > 0 ? jitter(random) : 0);
    reading.q_resolution = link.step_rad;
    const double q = Move::Position(sampled_s);
    const double read = link.step_rad > 0 ? link.step_rad * std::round(q / link.step_rad) : q;
    reading.q = Eigen::Vector2d(read, -read);
    if (k == 0) {
      estimator.ObserveStandstill(reading);
    } else {
      estimator.ObserveMoving(reading);
    }
    const auto motion = estimator.Estimate();
    if (!motion || !estimator.full()) {
      ++result.none;
      continue;
    }
    ++result.estimates;
    const double error = ErrorOf(motion->qdd[0], motion->time_s - 100, link.refresh_s);
    const double sd = std::sqrt(motion->qdd_covariance(0, 0));
    result.largest_error = std::max(result.largest_error, std::abs(error));
    result.mean_sd += sd;
    result.covered += std::abs(error) <= 2.2 * sd + allowance;  // Student, 10 degrees of freedom
  }
  result.mean_sd /= std::max(1, result.estimates);
  return result;
}

struct Coverage {
  double share, mean_sd;
};

Coverage CoverageOf(const Link& link, double allowance = 0) {
  int covered = 0, estimates = 0;
  double sd = 0;
  constexpr unsigned kSeeds = 60;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const Result result = Run(link, seed, allowance);
    covered += result.covered;
    estimates += result.estimates;
    sd += result.mean_sd / kSeeds;
  }
  return {static_cast<double>(covered) / estimates, sd};
}

}  // namespace

TEST_CASE("the acceleration of exact readings is that of the move in the middle of the window") {
  const Result result = Run({}, 1);
  CHECK(result.estimates > 90);
  CHECK(result.largest_error < 0.2);  // of 4; largest where the move starts and ends
}

TEST_CASE(
    "the stated standard deviation holds for late readings, coarse registers and slow cycles") {
  // 95 % are expected; readings that repeat the same error are correlated, so less is allowed.
  const Coverage late = CoverageOf({.jitter_s = 0.5e-3});
  CAPTURE(late.share, late.mean_sd);
  CHECK(late.share > 0.93);
  const Coverage coarse = CoverageOf({.step_rad = 1e-3});
  CAPTURE(coarse.share, coarse.mean_sd);
  CHECK(coarse.share > 0.93);
  const Coverage cycle = CoverageOf({.refresh_s = 0.004});
  CAPTURE(cycle.share, cycle.mean_sd);
  CHECK(cycle.share > 0.9);
  const Coverage slower = CoverageOf({.refresh_s = 0.0121});
  CAPTURE(slower.share, slower.mean_sd);
  CHECK(slower.share > 0.9);
  // Without scatter, what remains is the smoothing and the controller's clock: 5 % of the peak.
  const Coverage beat = CoverageOf({.refresh_s = 0.0099}, 0.05 * kPeak);
  CAPTURE(beat.share, beat.mean_sd);
  CHECK(beat.share > 0.9);
}

TEST_CASE("a controller that refreshes too slowly gives no acceleration") {
  const Result result = Run({.refresh_s = 0.05}, 1);
  CHECK(result.estimates == 0);
}

TEST_CASE("after a stop the acceleration returns to zero while readings repeat") {
  JointMotionEstimator estimator;
  model::RobotState reading;
  for (int k = 0; k < 200; ++k) {
    const double t_s = 0.01 * k;
    reading.sequence = static_cast<std::uint64_t>(k + 1);
    reading.timestamp_s = t_s;
    reading.q = Eigen::Matrix<double, 1, 1>(Move::Position(t_s));
    if (k == 0) {
      estimator.ObserveStandstill(reading);
    } else {
      estimator.ObserveMoving(reading);
    }
  }
  const auto motion = estimator.Estimate();
  REQUIRE(motion);
  CHECK(std::abs(motion->qdd[0]) < 1e-9);
  CHECK(std::abs(motion->qd[0]) < 1e-9);
}

}  // namespace plumbline::joint_motion_test
