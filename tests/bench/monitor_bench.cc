// Benchmark of the drift monitor: probes until a step raises an alarm, false alarms in simulated
// years.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "firmware-like/monitor/run_length.h"
#include "tests/bench/rows.h"

using namespace plumbline;

namespace {

class Residuals {
 public:
  Residuals(unsigned seed, double sigma_m, double outlier_fraction)
      : random_(seed), sigma_m_(sigma_m), outlier_fraction_(outlier_fraction) {}
  Vec3 Next() {
    const Vec3 noise(normal_(random_), normal_(random_), normal_(random_));
    return (uniform_(random_) < outlier_fraction_ ? 20 : 1) * sigma_m_ * noise;
  }
  Vec3 Direction() {
    return Vec3(normal_(random_), normal_(random_), normal_(random_)).normalized();
  }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_{0, 1};
  double sigma_m_, outlier_fraction_;
};

void Delays(bench::Effort effort) {
  const bool smoke = effort == bench::Effort::kSmoke;
  const int runs = bench::Choose(effort, 5, 200, 2000);
  fmt::print("## Probes until a step raises an alarm, {} runs, random directions\n\n", runs);
  fmt::print(
      "| sigma mm | step mm | probes per day | reference | outliers | threshold | median | 95 % "
      "|\n");
  fmt::print("|---|---|---|---|---|---|---|---|\n");
  for (const double sigma_mm : {0.05, 0.1}) {
    for (const double step_mm : {0.1, 0.3}) {
      for (const double probes_per_day : {1.0, 24.0, 1440.0}) {
        for (const int reference : {0, 20}) {
          for (const double outliers : {0.0, 0.05}) {
            // A design takes seconds.
            if (smoke && (sigma_mm > 0.05 || step_mm < 0.3 || probes_per_day != 24)) continue;
            monitor::MonitorRequirements wish;
            wish.sigma_m = 1e-3 * sigma_mm;
            wish.probes_per_day = probes_per_day;
            wish.reference_probes = reference;
            const monitor::MonitorDesign design = monitor::MonitorDesignFor(wish);
            std::vector<int> delays;
            for (int run = 0; run < runs; ++run) {
              Residuals residuals(static_cast<unsigned>(run), wish.sigma_m, outliers);
              monitor::DriftMonitor monitor(design);
              const Vec3 step_m = 1e-3 * step_mm * residuals.Direction();
              for (int i = 0; i < reference + 30; ++i) monitor.Update(residuals.Next());
              if (monitor.alarm()) continue;  // false alarms are counted below
              int delay = 0;
              while (!monitor.alarm() && delay < 100000) {
                monitor.Update(residuals.Next() + step_m);
                ++delay;
              }
              delays.push_back(delay);
            }
            std::sort(delays.begin(), delays.end());
            const auto at = [&](double fraction) {
              return delays[static_cast<std::size_t>(fraction *
                                                     static_cast<double>(delays.size() - 1))];
            };
            fmt::print("| {} | {} | {} | {} | {:.0f} % | {:.2f} | {} | {} |\n", sigma_mm, step_mm,
                       probes_per_day,
                       reference == 0 ? "model" : fmt::format("{} probes", reference),
                       100 * outliers, design.threshold, at(0.5), at(0.95));
            if (step_mm < 0.3 || probes_per_day != 24 || reference == 0 || outliers > 0) continue;
            bench::Report({.what = fmt::format(
                               "probes until an alarm, step 0.3 mm, sigma {} mm, median", sigma_mm),
                           .ours = static_cast<double>(at(0.5)),
                           .timed = false});
          }
        }
      }
    }
  }
}

/// Median delay in probes for a 0.3 mm step in random directions, after learning from this scatter.
int MedianDelay(const monitor::MonitorDesign& design, double sigma_m, double outliers, int runs) {
  monitor::DriftMonitor monitor(design);
  Residuals residuals(7, sigma_m, outliers);
  std::vector<int> delays;
  for (int run = 0; run < runs; ++run) {
    monitor.Restart();
    for (int i = 0; i < design.reference_probes + 30; ++i) monitor.Update(residuals.Next());
    const Vec3 step_m = 3e-4 * residuals.Direction();
    int delay = 0;
    for (; !monitor.alarm(); ++delay) monitor.Update(residuals.Next() + step_m);
    delays.push_back(delay);
  }
  std::sort(delays.begin(), delays.end());
  return delays[delays.size() / 2];
}

/// @return  the largest rate of alarms over references and shares of outliers [1/year]
double FalseAlarms(double probes_per_day, int years, double true_over_declared, int delays = 501) {
  double largest = 0;
  for (const int reference : {0, 20}) {
    for (const double outliers : {0.0, 0.02, 0.05}) {
      monitor::MonitorRequirements wish;
      wish.probes_per_day = probes_per_day;
      wish.reference_probes = reference;
      monitor::DriftMonitor monitor(monitor::MonitorDesignFor(wish));
      const double sigma_m = true_over_declared * wish.sigma_m;
      Residuals residuals(99, sigma_m, outliers);
      int alarms = 0, worst = 0, at_most_one = 0;
      for (int year = 0; year < years; ++year) {
        monitor.Restart();
        int in_year = 0;
        for (int i = 0; i < static_cast<int>(365.25 * probes_per_day); ++i) {
          if (!monitor.Update(residuals.Next()).raised) continue;
          ++in_year;
          monitor.Restart();
        }
        alarms += in_year;
        worst = std::max(worst, in_year);
        at_most_one += in_year <= 1 ? 1 : 0;
      }
      fmt::print("| {} | {} | {} | {:.0f} % | {} | {:.2f} | {:.3f} | {:.1f} % | {} | {} |\n",
                 true_over_declared, probes_per_day,
                 reference == 0 ? "model" : fmt::format("{} probes", reference), 100 * outliers,
                 years, monitor.design().threshold, static_cast<double>(alarms) / years,
                 100.0 * at_most_one / years, worst,
                 MedianDelay(monitor.design(), sigma_m, outliers, delays));
      largest = std::max(largest, static_cast<double>(alarms) / years);
    }
  }
  return largest;
}

}  // namespace

int main(int argc, char** argv) {
  const bench::Effort effort = bench::EffortFrom(argc, argv);
  Delays(effort);
  fmt::print("\n## False alarms, designed for one per year, declared sigma 0.05 mm\n\n");
  fmt::print(
      "| true / declared sigma | probes per day | reference | outliers | years | threshold | per "
      "year | years with at most one | worst year | median delay for 0.3 mm |\n");
  fmt::print("|---|---|---|---|---|---|---|---|---|---|\n");
  const int delays = bench::Choose(effort, 5, 501, 501);
  for (const double scale : {1.0, 1.2, 1.4}) {
    double largest = FalseAlarms(24, bench::Choose(effort, 1, 50, 1000), scale, delays);
    if (effort != bench::Effort::kSmoke) {
      largest = std::max(largest, FalseAlarms(1, bench::Choose(effort, 0, 100, 2000), scale));
    }
    if (effort == bench::Effort::kWhole) largest = std::max(largest, FalseAlarms(1440, 20, scale));
    bench::Report(
        {.what = fmt::format("false alarms a year, true sigma {} times the declared", scale),
         .ours = largest,
         .goal = scale == 1 ? bench::AtMost(1) : bench::Goal{},
         .timed = false});
    if (effort == bench::Effort::kSmoke) return 0;
  }
  return 0;
}
