#include "app/measure/report/signal_bins.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace plumbline::measure {
namespace {

constexpr std::size_t kBins = 10;
constexpr double kGapShare = 0.3;  // share of the signal's range

Cloud CloudOf(const Diagnosis& diagnosis, const SignalTrace& signal, int axis) {
  std::vector<RowIndex> order;
  const std::size_t count = std::min(signal.values.size(), diagnosis.rows.size());
  for (const RowIndex row : FirstIndices<RowIndex>(count)) {
    if (!diagnosis.rows[row].outlier && std::isfinite(signal.values[row])) order.push_back(row);
  }
  std::ranges::stable_sort(
      order, [&](RowIndex a, RowIndex b) { return signal.values[a] < signal.values[b]; });
  Cloud cloud;
  for (const RowIndex row : order) {
    cloud.value.push_back(signal.values[row]);
    cloud.before.push_back(1e3 * diagnosis.rows[row].before[axis]);
    cloud.after.push_back(1e3 * diagnosis.rows[row].after[axis]);
  }
  return cloud;
}

/// Along the axis whose binned means, before and after, are largest.
Dependence DependenceOn(const SignalTrace& signal, const Diagnosis& diagnosis) {
  Dependence strongest{&signal, 2, {}};
  double most = -1;
  for (int axis = 0; axis < 3; ++axis) {
    Cloud cloud = CloudOf(diagnosis, signal, axis);
    const std::vector<Bin> bins = BinsOf(cloud);
    double spread = 0;
    for (const Bin& bin : bins) spread += bin.before * bin.before + bin.after * bin.after;
    if (spread <= most) continue;
    most = spread;
    strongest.axis = axis;
    strongest.share_before = ExplainedBy(bins, &Bin::before, cloud.before).second;
    strongest.share_after = ExplainedBy(bins, &Bin::after, cloud.after).second;
    strongest.cloud = std::move(cloud);
  }
  return strongest;
}

}  // namespace

std::vector<Bin> BinsOf(const Cloud& cloud) {
  std::vector<Bin> bins;
  const std::size_t n = cloud.value.size();
  if (n == 0) return bins;
  const double gap = kGapShare * (cloud.value.back() - cloud.value.front());
  bool after_gap = false;
  std::size_t start = 0;
  while (start < n) {
    const std::size_t least = std::min(n, start + std::max<std::size_t>(4, n / kBins));
    std::size_t end = start + 1;
    const auto step = [&](std::size_t k) { return cloud.value[k] - cloud.value[k - 1]; };
    while (end < n && step(end) <= gap && (end < least || step(end) == 0)) ++end;
    Bin bin;
    for (std::size_t k = start; k < end; ++k) {
      bin.value += cloud.value[k];
      bin.before += cloud.before[k];
      bin.after += cloud.after[k];
    }
    const auto count = static_cast<double>(end - start);
    bins.push_back({bin.value / count, bin.before / count, bin.after / count,
                    static_cast<int>(end - start), after_gap});
    after_gap = end < n && gap > 0 && step(end) > gap;
    start = end;
  }
  return bins;
}

std::pair<double, double> ExplainedBy(const std::vector<Bin>& bins, double Bin::*mean,
                                      const std::vector<double>& residual) {
  const auto n = static_cast<double>(residual.size());
  const auto k = static_cast<double>(bins.size());
  if (n <= k || k < 2) return {0, 0};
  double sum = 0, square = 0, between = 0;
  for (const double one : residual) sum += one;
  for (const double one : residual) square += (one - sum / n) * (one - sum / n);
  for (const Bin& bin : bins) between += bin.count * std::pow(bin.*mean - sum / n, 2);
  if (square <= 0) return {0, 0};
  return {square / (n - 1), std::max(0.0, 1 - (square - between) / (n - k) / (square / (n - 1)))};
}

std::string Dependence::PText() const {
  return signal->p_value < 0.001 ? "<\u00a00.001" : fmt::format("=\u00a0{:.2g}", signal->p_value);
}

std::vector<Dependence> DependencesOf(const Diagnosis& diagnosis) {
  std::vector<Dependence> all;
  for (const SignalTrace& signal : diagnosis.signals) {
    all.push_back(DependenceOn(signal, diagnosis));
  }
  std::ranges::stable_sort(all, [](const Dependence& a, const Dependence& b) {
    return std::pair(a.signal->p_value, -a.signal->share) <
           std::pair(b.signal->p_value, -b.signal->share);
  });
  return all;
}

}  // namespace plumbline::measure
