// /metrics: numbers for Prometheus, text format 0.0.4.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/view/shown.h"

namespace plumbline {

/// What the page counts of itself.
struct PageCounts {
  std::uint64_t requests = 0, refused = 0;  ///< refused: not answered as asked
  int connections = 0, viewers = 0;         ///< now; of the live picture
};

/// Writes metrics: HELP and TYPE once, then the samples.
class MetricsWriter {
 public:
  enum class Type { kGauge, kCounter, kHistogram };
  using Labels = std::vector<std::pair<std::string_view, std::string>>;

  /// Begins a metric. @param name  without the prefix `plumbline_`; a counter's ends in _total
  void Begin(std::string_view name, Type type, std::string_view help);
  /// @param suffix  of a histogram's samples: _bucket, _sum, _count
  void Add(double value, const Labels& labels = {}, std::string_view suffix = "");
  /// Both, of a single gauge.
  void Gauge(std::string_view name, std::string_view help, double value);

  std::string Take() { return std::move(text_); }

 private:
  std::string text_, name_;
};

/// SI, seconds and metres. What is not known now has no sample: an old value would look like a
/// present one. plumbline_up is 1 while the daemon has reported within kDaemonSilent_s.
/// @param now    null: nothing was put together yet
/// @param now_s  monotonic
std::string MetricsText(const ShownNow* now, const PageCounts& page, double now_s);

/// Whether the daemon reports: there is a state, and DaemonIsSilent() does not hold.
bool DaemonIsThere(const ShownNow* now, double now_s);

}  // namespace plumbline
