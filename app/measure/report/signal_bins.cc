#include "app/measure/report/signal_bins.h"

#include <algorithm>

namespace plumbline::measure {
namespace {

constexpr std::size_t kBins = 10;
constexpr double kGapShare = 0.3;  // share of the signal's range

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

}  // namespace plumbline::measure
