// Computed run length and threshold against simulation.
#include "firmware-like/monitor/run_length.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <vector>

namespace plumbline::run_length_test {

using namespace plumbline::monitor;

namespace {

/// Mean length and its standard error of simulated runs of one cumulative sum.
std::pair<double, double> SimulatedRunLength(const MonitorDesign& design, double offset,
                                             double outlier_share, int runs) {
  std::mt19937_64 random(42);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1, 1);
  double sum = 0, square_sum = 0;
  for (int run = 0; run < runs; ++run) {
    double chart = 0, length = 0;
    while (chart <= design.threshold) {
      double step = offset + normal(random);
      if (const double u = uniform(random); std::abs(u) < outlier_share) step = u < 0 ? -99 : 99;
      step = std::min(std::max(step, -design.clip), design.clip);
      chart = std::max(0.0, chart + step - design.allowance);
      ++length;
    }
    sum += length;
    square_sum += length * length;
  }
  const double mean = sum / runs;
  return {mean, std::sqrt((square_sum / runs - mean * mean) / runs)};
}

}  // namespace

TEST_CASE("the run length of unclipped sums matches the published table") {
  // One-sided sum, allowance 0.5, no clipping: D. M. Hawkins and D. H. Olwell, "Cumulative Sum
  // Charts and Charting for Quality Improvement" (1998): two-sided 168 at h = 4, 465 at h = 5.
  MonitorDesign design;
  design.allowance = 0.5;
  design.clip = 50;
  design.threshold = 4;
  CHECK(MeanRunLength(design, 0, 0) == Approx(2 * 168.0).epsilon(0.01));
  design.threshold = 5;
  CHECK(MeanRunLength(design, 0, 0) == Approx(2 * 465.0).epsilon(0.01));
}

TEST_CASE("the run length of clipped sums matches a simulation") {
  struct Case {
    double allowance, threshold, offset, outlier_share;
  };
  // Thresholds that are not multiples of clip - allowance, where the run length jumps.
  const Case cases[] = {{1, 3, 0, 0},      {1, 3, 0.2, 0},       {0.5, 6, 0, 0}, {1, 4.3, 0, 0.02},
                        {1, 5, 0.3, 0.05}, {0.5, 5, -0.2, 0.02}, {1, 4.3, 3, 0}};
  for (const Case& c : cases) {
    CAPTURE(c.allowance, c.threshold, c.offset, c.outlier_share);
    MonitorDesign design;
    design.allowance = c.allowance;
    design.threshold = c.threshold;
    const auto [mean, error] = SimulatedRunLength(design, c.offset, c.outlier_share, 4000);
    const double computed = MeanRunLength(design, c.offset, c.outlier_share);
    CHECK(std::abs(computed - mean) < 4 * error + 0.03 * mean);  // the chain's grid: 3 %
  }
}

TEST_CASE("the threshold changes with the requirements in the expected direction") {
  MonitorRequirements wish;
  const double usual = MonitorDesignFor(wish).threshold;
  MonitorRequirements strict = wish;
  strict.false_alarms_per_year = 0.01;
  CHECK(MonitorDesignFor(strict).threshold > usual);
  MonitorRequirements rare = wish;
  rare.probes_per_day = 1;
  CHECK(MonitorDesignFor(rare).threshold < usual);
  MonitorRequirements estimated = wish;
  estimated.reference_probes = 20;
  CHECK(MonitorDesignFor(estimated).threshold > usual);
  estimated.reference_probes = 100;
  CHECK(MonitorDesignFor(estimated).threshold < MonitorDesignFor([&] {
                                                  MonitorRequirements few = estimated;
                                                  few.reference_probes = 20;
                                                  return few;
                                                }())
                                                    .threshold);
}

TEST_CASE("simulated years have no more false alarms than required") {
  struct Case {
    double probes_per_day, outlier_share;
    int reference_probes, years;
  };
  const Case cases[] = {{24, 0, 0, 150}, {24, 0, 20, 150}, {24, 0.05, 20, 150}, {4, 0, 10, 300}};
  for (const Case& c : cases) {
    CAPTURE(c.probes_per_day, c.reference_probes, c.outlier_share);
    MonitorRequirements wish;
    wish.probes_per_day = c.probes_per_day;
    wish.reference_probes = c.reference_probes;
    DriftMonitor monitor(MonitorDesignFor(wish));
    std::mt19937_64 random(4711);
    std::normal_distribution<double> normal(0, wish.sigma_m);
    std::uniform_real_distribution<double> uniform(0, 1);
    int alarms = 0;
    for (int year = 0; year < c.years; ++year) {
      monitor.Restart();
      for (int i = 0; i < static_cast<int>(365.25 * c.probes_per_day); ++i) {
        Vec3 residual_m(normal(random), normal(random), normal(random));
        if (uniform(random) < c.outlier_share) residual_m *= 30;
        if (!monitor.Update(residual_m).raised) continue;
        ++alarms;
        monitor.Restart();
      }
    }
    CHECK(alarms <= c.years + 3 * std::sqrt(static_cast<double>(c.years)));
    // With the expected outliers; a threshold that is too high costs delay.
    if (c.outlier_share == wish.outlier_share) CHECK(alarms > c.years / 4);
  }
}

TEST_CASE("a declared sigma that is too small causes neither false nor late alarms") {
  for (const int reference : {0, 20}) {
    for (const double scale : {1.0, 1.2, 1.4}) {
      CAPTURE(reference, scale);
      MonitorRequirements wish;
      wish.probes_per_day = 24;
      wish.reference_probes = reference;
      DriftMonitor monitor(MonitorDesignFor(wish));
      std::mt19937_64 random(815);
      std::normal_distribution<double> normal(0, scale * wish.sigma_m);
      std::uniform_real_distribution<double> uniform(0, 1);
      const auto residual_m = [&] {
        Vec3 next(normal(random), normal(random), normal(random));
        if (uniform(random) < wish.outlier_share) next *= 20;
        return next;
      };
      constexpr int kYears = 100;
      int alarms = 0;
      for (int year = 0; year < kYears; ++year) {
        monitor.Restart();
        for (int i = 0; i < static_cast<int>(365.25 * wish.probes_per_day); ++i) {
          if (!monitor.Update(residual_m()).raised) continue;
          ++alarms;
          monitor.Restart();
        }
      }
      CHECK(alarms <= kYears + 3 * std::sqrt(static_cast<double>(kYears)));

      std::vector<int> delays;
      for (int run = 0; run < 301; ++run) {
        monitor.Restart();
        for (int i = 0; i < reference + 30; ++i) monitor.Update(residual_m());
        const Vec3 step_m =
            3e-4 * Vec3(normal(random), normal(random), normal(random)).normalized();
        int delay = 0;
        while (!monitor.alarm()) {
          monitor.Update(residual_m() + step_m);
          ++delay;
        }
        delays.push_back(delay);
      }
      std::nth_element(delays.begin(), delays.begin() + 150, delays.end());
      CHECK(delays[150] < 12);
    }
  }
}

}  // namespace plumbline::run_length_test
