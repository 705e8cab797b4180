// Histogram of how late periodic work starts.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace plumbline {

/// Number of starts in each class of lateness.
struct LatenessHistogram {
  /// Upper bounds of the classes [s]; the last class has none.
  static constexpr std::array kBounds_s = {20e-6,  40e-6,  60e-6,  80e-6,  100e-6, 150e-6,
                                           200e-6, 300e-6, 400e-6, 600e-6, 800e-6, 1e-3,
                                           2e-3,   5e-3,   10e-3,  20e-3,  50e-3,  100e-3};
  static constexpr std::size_t kClasses = kBounds_s.size() + 1;

  std::array<std::uint64_t, kClasses>
      counts{};      ///< [k]: later than kBounds_s[k - 1], but not than kBounds_s[k]
  double sum_s = 0;  ///< total lateness
};

/// Records lateness: one thread adds, any thread reads; lock-free.
class LatenessRecorder {
 public:
  void Add(double late_s) {
    const auto& bounds = LatenessHistogram::kBounds_s;
    const auto k = std::lower_bound(bounds.begin(), bounds.end(), late_s) - bounds.begin();
    counts_[static_cast<std::size_t>(k)].fetch_add(1, std::memory_order_relaxed);
    sum_s_.store(sum_s_.load(std::memory_order_relaxed) + std::max(late_s, 0.0),
                 std::memory_order_relaxed);
  }
  LatenessHistogram Counts() const {
    LatenessHistogram counts;
    for (std::size_t k = 0; k < counts_.size(); ++k) {
      counts.counts[k] = counts_[k].load(std::memory_order_relaxed);
    }
    counts.sum_s = sum_s_.load(std::memory_order_relaxed);
    return counts;
  }

 private:
  std::array<std::atomic<std::uint64_t>, LatenessHistogram::kClasses> counts_{};
  std::atomic<double> sum_s_{0};
};

}  // namespace plumbline
