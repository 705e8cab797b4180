// Last values of one cell's metrics, and which of them a host does not have yet.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "app/plant/sparkplug/cell_message.h"

namespace plumbline::plant {

/// Quality codes of Sparkplug.
enum class Quality : std::uint32_t { kBad = 0, kGood = 192, kStale = 500 };

struct Metric {
  std::string name;
  DataType type = DataType::kDouble;
  const char* unit = "";
  MetricValue value;
  std::int64_t utc_ms = 0;             ///< of the value, by the cell's clock; 0: never reported
  Quality quality = Quality::kStale;   ///< kBad: the cell reports that the value is unknown
  bool historical = false;             ///< the value is to be published as historical
  bool changed = false;                ///< a host does not have the value yet
  bool not_live = false;               ///< a host has the value only as historical
  Quality published = Quality::kGood;  ///< last quality that was published
};

/// The alias of a metric is its index plus one, for as long as this object exists.
class MetricStore {
 public:
  /// 1000 points, and room for what newer cells report.
  static constexpr std::size_t kMaxMetrics = 16384;

  enum class Outcome {
    kApplied,
    kRepeated,  ///< of this sequence number or a later one was applied before
    kMissed,    ///< applied; messages before it are missing, so that values may be out of date
  };
  /// What a new process can continue with.
  struct KeptValue {
    DataType type = DataType::kDouble;
    MetricValue value;
    std::int64_t utc_ms = 0;
    Quality quality = Quality::kGood;
  };
  struct Kept {
    std::string stream;
    std::int64_t seq = 0;                     ///< of the last message
    std::map<std::string, KeptValue> values;  ///< those that only a change reports
  };
  Kept ToKeep() const;
  /// To be called first. A value counts once the cell declares or reports its metric.
  void Restore(Kept kept);

  /// Applies a message. Messages older than the birth were queued at the cell: their values are
  /// historical, and become live values with the first message that is newer.
  Outcome Apply(const CellMessage& message);

  /// The last birth and death that arrived decide: a broker that keeps both sends them in any
  /// order.
  bool online() const { return born_ && birth_bdSeq_ != death_bdSeq_; }
  /// Number of births of the cell, and of metrics; a host needs an NBIRTH after a change of either.
  std::uint64_t births() const { return births_; }
  std::size_t size() const { return metrics_.size(); }
  /// Metrics that were not stored because there were kMaxMetrics.
  std::size_t refused() const { return refused_; }

  const std::vector<Metric>& All() const { return metrics_; }
  bool has_changes() const { return !changed_.empty(); }
  struct Change {
    std::size_t index = 0;
    bool quality = false;  ///< differs from what was published
  };
  /// The metrics that changed since the last call, which count as published.
  std::vector<Change> TakeChanges();
  /// All metrics count as published.
  void Published();

 private:
  Metric* Find(const Reading& reading);
  void Set(Metric& metric, MetricValue value, std::int64_t utc_ms, bool historical, bool always);
  void Mark(Metric& metric);
  void ApplyReading(const Reading& reading, const CellMessage& message, bool historical);
  /// Values that only a change reports may be out of date.
  void MarkStale();
  void PublishAsLive();

  std::vector<Metric> metrics_;
  std::map<std::string, std::size_t, std::less<>> indices_;
  std::vector<std::size_t> changed_;
  std::map<std::string, KeptValue> restored_;
  std::string stream_;
  std::int64_t seq_ = 0;
  bool born_ = false, resync_ = true, any_not_live_ = false;
  std::int64_t birth_bdSeq_ = -1, death_bdSeq_ = -1, birth_utc_ms_ = 0;
  std::uint64_t births_ = 0;
  std::size_t refused_ = 0;
};

}  // namespace plumbline::plant
