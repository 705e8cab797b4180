// Prometheus metrics (/metrics), text format 0.0.4.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/display/view/display_mailbox.h"

namespace plumbline::display {

/// Counters of the page itself.
struct PageCounts {
  std::uint64_t requests = 0, refused = 0;
  int connections = 0;  ///< open now
  int viewers = 0;      ///< of these, viewers of the live picture
};

/// Formats metrics: HELP and TYPE once, then the samples.
class MetricsWriter {
 public:
  enum class Type { kGauge, kCounter, kHistogram };
  using Labels = std::vector<std::pair<std::string_view, std::string>>;

  /// Starts a metric.
  /// @param name  without the prefix `plumbline_`; a counter's name ends in _total
  void Begin(std::string_view name, Type type, std::string_view help);
  /// Adds a sample to the current metric.
  /// @param suffix  _bucket, _sum or _count for a histogram's samples
  void Add(double value, const Labels& labels = {}, std::string_view suffix = "");
  /// Adds a gauge with a single sample.
  void Gauge(std::string_view name, std::string_view help, double value);

  std::string Take() { return std::move(text_); }

 private:
  std::string text_, name_;
};

/// All metrics, in SI units. A value that is unknown now has no sample, since a stale one would
/// look current. plumbline_up is 1 while DaemonReports().
/// @param now    null if there is no status yet
/// @param now_s  monotonic
std::string MetricsText(const display::DisplayStatus* now, const PageCounts& page, double now_s);

/// Whether there is a state and the daemon is not silent.
bool DaemonReports(const display::DisplayStatus* now, double now_s);

}  // namespace plumbline::display
