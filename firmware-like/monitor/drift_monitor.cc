#include "firmware-like/monitor/drift_monitor.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <span>

#include "firmware-like/statistics/statistics.h"

namespace plumbline::monitor {
namespace {

constexpr double kMedianOfChiSquare3 = 2.3659738843753377;
// Standard deviations added to the estimated variance, so that the false-alarm rate is met on
// average.
constexpr double kUpperEnd = 0.5;
constexpr int kFewestForScatter = 5;  // fewer probes give no useful estimate
// 99.99 % quantiles of chi^2 with 3 degrees of freedom and of the standard normal distribution.
constexpr double kQuantileOfChiSquare3 = 21.107513;
constexpr double kQuantileOfNormal = 3.719016;
constexpr double kCountChance = 0.01;
constexpr double kTrendFrom = 2;    // smallest scatter for the trend test [declared sigma]
constexpr int kScatterProbes = 20;  // probes for the scatter estimate if the model is the reference
static_assert(kScatterProbes <= kMaxReferenceProbes);

/// The number of outliers among `count` probes that is exceeded with a probability below
/// kCountChance.
int MaxOutliers(int count, double share) {
  double probability = std::pow(1 - share, count), cumulative = probability;
  int outliers = 0;
  while (1 - cumulative > kCountChance && outliers < count) {
    probability *= (count - outliers) * share / ((outliers + 1) * (1 - share));
    cumulative += probability;
    ++outliers;
  }
  return outliers;
}

}  // namespace

const std::array<Vec3, DriftMonitor::kAxes>& DriftMonitor::Axes() {
  static const std::array<Vec3, kAxes> axes = [] {
    std::array<Vec3, kAxes> list = {Vec3(1, 0, 0),  Vec3(0, 1, 0), Vec3(0, 0, 1),  Vec3(1, 1, 0),
                                    Vec3(1, -1, 0), Vec3(1, 0, 1), Vec3(1, 0, -1), Vec3(0, 1, 1),
                                    Vec3(0, 1, -1), Vec3(1, 1, 1), Vec3(1, 1, -1), Vec3(1, -1, 1),
                                    Vec3(-1, 1, 1)};
    for (Vec3& axis : list) axis.normalize();
    return list;
  }();
  return axes;
}

DriftMonitor::DriftMonitor(const MonitorDesign& design) : design_(design) {
  assert(design_.sigma_m > 0 && design_.threshold > 0 && design_.clip > design_.allowance);
  assert(design_.reference_probes >= 0 && design_.reference_probes <= kMaxReferenceProbes);
  Restart();
}

void DriftMonitor::Restart() {
  reference_known_ = design_.reference_probes == 0;
  fault_ = ReferenceFault::kNone;
  reference_m_.setZero();
  mean_radius_m_ = 0;
  sigma_m_ = design_.sigma_m;
  probes_ = 0;
  statistic_ = 0;
  charts_.fill({});
  alarm_.reset();
}

ProbeVerdict DriftMonitor::Update(const Vec3& residual_m, double radius_m) {
  assert(residual_m.allFinite());
  ++probes_;
  ProbeVerdict verdict;
  if (reference_refused()) {
    verdict.unmonitored = true;
    return verdict;
  }
  if (!reference_known_) {
    Learn(residual_m, radius_m);
    verdict.learning = true;
    return verdict;
  }
  if (design_.reference_probes == 0 && probes_ <= kScatterProbes) LearnScatter(residual_m);
  const Vec3 z = (residual_m - reference_m_) / sigma_m_;
  verdict.outlier = z.norm() > design_.clip * std::sqrt(3.0);
  double largest = 0;
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    for (const int sense : {0, 1}) {
      Chart& chart = charts_[2 * axis + static_cast<std::size_t>(sense)];
      const Vec3 direction = sense == 0 ? Axes()[axis] : -Axes()[axis];
      const bool over = Advance(chart, direction, z);
      if (over && !alarm_ && chart.sum > largest) verdict.raised = true;
      largest = std::max(largest, chart.sum);
    }
  }
  statistic_ = largest / design_.threshold;
  verdict.statistic = statistic_;
  if (verdict.raised) {
    const auto leading =
        std::max_element(charts_.begin(), charts_.end(),
                         [](const Chart& a, const Chart& b) { return a.sum < b.sum; });
    const auto taken = static_cast<double>(probes_ - leading->first_probe + 1);
    alarm_ = {probes_, leading->first_probe, sigma_m_ * leading->total / taken};
  }
  return verdict;
}

bool DriftMonitor::Advance(Chart& chart, const Vec3& direction, const Vec3& z) {
  const double step = std::clamp(direction.dot(z), -design_.clip, design_.clip);
  if (chart.sum == 0) {
    chart.first_probe = probes_;
    chart.total.setZero();
  }
  chart.sum = std::max(0.0, chart.sum + step - design_.allowance);
  // Outliers are shortened without changing their direction.
  const double limit = 3 * design_.clip;
  chart.total += z.norm() > limit ? Vec3(z * (limit / z.norm())) : z;
  return chart.sum > design_.threshold;
}

void DriftMonitor::Learn(const Vec3& residual_m, double radius_m) {
  const int count = static_cast<int>(probes_);
  const bool all_stated = radius_m > 0 && (count == 1 || mean_radius_m_ > 0);
  mean_radius_m_ = all_stated ? mean_radius_m_ + (radius_m - mean_radius_m_) / count : 0;
  learned_[static_cast<std::size_t>(count - 1)] = residual_m;
  if (count < design_.reference_probes) return;

  std::array<double, kMaxReferenceProbes> values;
  Vec3& median = median_m_;
  for (int k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) values[i] = learned_[i][k];
    median[k] = statistics::MedianOf(std::span(values).first(static_cast<std::size_t>(count)));
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    values[i] = (learned_[i] - median).squaredNorm();
  }
  if (count >= kFewestForScatter) {
    UseScatter(statistics::MedianOf(std::span(values).first(static_cast<std::size_t>(count))),
               count);
  }

  fault_ = FaultOfReference();
  if (reference_refused()) return;
  const double limit_m = design_.clip * sigma_m_;
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    sum += (learned_[i] - median).cwiseMax(-limit_m).cwiseMin(limit_m);
  }
  reference_m_ = median + sum / count;
  reference_known_ = true;
}

ReferenceFault DriftMonitor::FaultOfReference() const {
  const int count = design_.reference_probes;
  if (sigma_m_ > kMaxScatterRatio * design_.sigma_m) return ReferenceFault::kScatter;
  int outliers = 0;
  for (int i = 0; i < count; ++i) outliers += Disagrees(i) ? 1 : 0;
  if (outliers > MaxOutliers(count, kOutlierShare)) return ReferenceFault::kOutliers;
  if (count < kFewestForScatter || sigma_m_ <= kTrendFrom * design_.sigma_m) {
    return ReferenceFault::kNone;
  }
  const double limit_m = design_.clip * sigma_m_;
  const auto clipped = [&](int i) -> Vec3 {
    return (learned_[static_cast<std::size_t>(i)] - median_m_).cwiseMax(-limit_m).cwiseMin(limit_m);
  };
  Vec3 mean = Vec3::Zero();
  for (int i = 0; i < count; ++i) mean += clipped(i) / count;
  double steps = 0, squares = 0;
  for (int i = 0; i < count; ++i) {
    squares += (clipped(i) - mean).squaredNorm();
    if (i > 0) steps += (clipped(i) - clipped(i - 1)).squaredNorm();
  }
  const double n = count;
  const double deviation = std::sqrt(4 * (n - 2) / (3 * (n * n - 1)));
  return steps < (2 - kQuantileOfNormal * deviation) * squares ? ReferenceFault::kTrend
                                                               : ReferenceFault::kNone;
}

bool DriftMonitor::Disagrees(int k) const {
  const double scatter_m = fault_ == ReferenceFault::kScatter ? design_.sigma_m : sigma_m_;
  return (learned_[static_cast<std::size_t>(k)] - median_m_).squaredNorm() >
         kQuantileOfChiSquare3 * scatter_m * scatter_m;
}

void DriftMonitor::LearnScatter(const Vec3& residual_m) {
  const auto count = static_cast<std::size_t>(probes_);
  learned_[count - 1] = residual_m;
  if (probes_ < kScatterProbes) return;
  std::array<double, kScatterProbes - 1> values;
  for (std::size_t i = 0; i + 1 < count; ++i) {
    values[i] = (learned_[i + 1] - learned_[i]).squaredNorm() / 2;
  }
  UseScatter(statistics::MedianOf(values), kScatterProbes - 1);
}

void DriftMonitor::UseScatter(double median_square_m2, int count) {
  // A variance from the median of N squared norms has a relative standard deviation of
  // 1.37 sqrt(2 / (3 N)).
  const double upper = 1 + kUpperEnd * 1.37 * std::sqrt(2.0 / (3.0 * count));
  const double previous_m = sigma_m_;
  sigma_m_ = std::max(design_.sigma_m, std::sqrt(upper * median_square_m2 / kMedianOfChiSquare3));
  for (Chart& chart : charts_) {
    chart.sum *= previous_m / sigma_m_;
    chart.total *= previous_m / sigma_m_;
  }
}

}  // namespace plumbline::monitor
