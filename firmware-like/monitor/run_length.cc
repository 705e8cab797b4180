#include "firmware-like/monitor/run_length.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace plumbline::monitor {
namespace {

constexpr int kStates = 120;
constexpr double kDaysPerYear = 365.25;
constexpr double kLongestRun = 1e15;  // beyond it (I - Q) is singular to working precision

double NormalCdf(double x) {
  return 0.5 * std::erfc(-x / std::numbers::sqrt2);
}

/// log(1/ARL) of one direction as a function of the reference error, tabulated on an even grid.
class RateTable {
 public:
  RateTable(const MonitorDesign& design, double largest_offset, double outlier_share)
      : largest_(std::max(largest_offset, 1e-9)) {
    for (int i = 0; i < kNodes; ++i) {
      const double offset = largest_ * (2.0 * i / (kNodes - 1) - 1);
      log_rate_.push_back(-std::log(MeanRunLength(design, offset, outlier_share)));
    }
  }
  double At(double offset) const {
    const double place =
        std::clamp((offset / largest_ + 1) * 0.5 * (kNodes - 1), 0.0, kNodes - 1.0);
    const int left = std::min(static_cast<int>(place), kNodes - 2);
    const double t = place - left;
    const auto index = static_cast<std::size_t>(left);
    return std::exp((1 - t) * log_rate_[index] + t * log_rate_[index + 1]);
  }

 private:
  static constexpr int kNodes = 17;
  double largest_;
  std::vector<double> log_rate_;
};

/// Probability of a year without a false alarm. The length rho of the reference error has a Maxwell
/// distribution; its direction is taken along a chart axis, the worst case.
double QuietYear(const MonitorDesign& design, const MonitorRequirements& requirements,
                 double reference_sd) {
  const double probes = kDaysPerYear * requirements.probes_per_day;
  constexpr double kLargest = 5;  // of rho [reference_sd]: beyond it lies 1.5e-5
  const RateTable table(design, kLargest * reference_sd, requirements.outlier_share);
  const Vec3 error_direction = DriftMonitor::Axes().front();
  const auto quiet = [&](double rho) {
    double rate = 0;
    for (const Vec3& axis : DriftMonitor::Axes()) {
      const double offset = rho * reference_sd * axis.dot(error_direction);
      rate += table.At(offset) + table.At(-offset);
    }
    return std::exp(-probes * rate);
  };
  if (reference_sd == 0) return quiet(0);
  constexpr int kSteps = 200;
  double sum = 0, weight = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double rho = kLargest * (i + 0.5) / kSteps;
    const double density = rho * rho * std::exp(-0.5 * rho * rho);
    sum += density * quiet(rho);
    weight += density;
  }
  return sum / weight;
}

}  // namespace

double MeanRunLength(const MonitorDesign& design, double offset, double outlier_share) {
  // State 0 covers sums up to width/2, state i those around i * width.
  const double width = 2 * design.threshold / (2 * kStates - 1);
  const auto cdf = [&](double increment) {
    const double step = increment + design.allowance;
    if (step < -design.clip) return 0.0;
    if (step >= design.clip) return 1.0;
    return (1 - outlier_share) * NormalCdf(step - offset) + 0.5 * outlier_share;
  };
  std::array<double, std::size_t{2} * kStates> at;  // cdf((j - 1/2) width), j = -kStates+1..kStates
  for (int j = -kStates + 1; j <= kStates; ++j) {
    at[static_cast<std::size_t>(j + kStates - 1)] = cdf((j - 0.5) * width);
  }
  const auto below = [&](int j) { return at[static_cast<std::size_t>(j + kStates - 1)]; };
  Eigen::MatrixXd system = Eigen::MatrixXd::Identity(kStates, kStates);
  for (int from = 0; from < kStates; ++from) {
    system(from, 0) -= below(1 - from);
    for (int to = 1; to < kStates; ++to) {
      system(from, to) -= below(to - from + 1) - below(to - from);
    }
  }
  const Eigen::VectorXd length = system.partialPivLu().solve(Eigen::VectorXd::Ones(kStates));
  const double first = length[0];
  return std::isfinite(first) && first >= 1 && first < kLongestRun ? first : kLongestRun;
}

MonitorDesign MonitorDesignFor(const MonitorRequirements& requirements,
                               const std::function<void()>& step) {
  MonitorDesign design;
  design.sigma_m = requirements.sigma_m;
  design.reference_probes = std::clamp(requirements.reference_probes, 0, kMaxReferenceProbes);
  design.allowance = std::clamp(0.5 * requirements.shift_m / requirements.sigma_m, 0.25, 1.0);
  // Outliers among the reference probes are clipped, not removed.
  const double probe_variance =
      1 - requirements.outlier_share + requirements.outlier_share * design.clip * design.clip;
  const double reference_sd = design.reference_probes > 0
                                  ? std::sqrt(probe_variance / design.reference_probes)
                                  : requirements.reference_sd_m / requirements.sigma_m;
  const double wanted = std::exp(-requirements.false_alarms_per_year);
  double low = 1, high = 100;
  while (high - low > 1e-3 * low) {
    step();
    design.threshold = 0.5 * (low + high);
    (QuietYear(design, requirements, reference_sd) < wanted ? low : high) = design.threshold;
  }
  design.threshold = high;
  return design;
}

}  // namespace plumbline::monitor
