#include "app/plant/sparkplug/metric_store.h"

#include <utility>

namespace plumbline::plant {
namespace {

/// A state does not repeat these metrics.
constexpr const char* kOnChangeOnly = "Points/";

}  // namespace

Metric* MetricStore::Find(const Reading& reading) {
  const auto found = indices_.find(reading.metric);
  if (found != indices_.end()) {
    Metric& metric = metrics_[found->second];
    return metric.type == reading.type ? &metric : nullptr;
  }
  if (metrics_.size() >= kMaxMetrics) {
    ++refused_;
    return nullptr;
  }
  indices_[reading.metric] = metrics_.size();
  metrics_.push_back({});
  Metric& metric = metrics_.back();
  metric.name = reading.metric;
  metric.type = reading.type;
  metric.unit = reading.unit;
  const auto kept = restored_.find(reading.metric);
  if (kept != restored_.end() && kept->second.type == reading.type) {
    metric.value = std::move(kept->second.value);
    metric.utc_ms = kept->second.utc_ms;
    metric.quality = kept->second.quality;
    restored_.erase(kept);
  }
  return &metric;
}

MetricStore::Kept MetricStore::ToKeep() const {
  Kept kept{stream_, seq_, {}};
  for (const auto& [name, value] : restored_) {
    if (value.quality == Quality::kGood) kept.values[name] = value;
  }
  for (const Metric& metric : metrics_) {
    if (metric.name.starts_with(kOnChangeOnly) && metric.quality == Quality::kGood)
      kept.values[metric.name] = {metric.type, metric.value, metric.utc_ms, metric.quality};
  }
  return kept;
}

void MetricStore::Restore(Kept kept) {
  stream_ = std::move(kept.stream);
  seq_ = kept.seq;
  restored_ = std::move(kept.values);
}

void MetricStore::Mark(Metric& metric) {
  if (metric.changed) return;
  metric.changed = true;
  changed_.push_back(static_cast<std::size_t>(&metric - metrics_.data()));
}

/// @param always  publish the value even if it is the same: it belongs to another event
void MetricStore::Set(Metric& metric, MetricValue value, std::int64_t utc_ms, bool historical,
                      bool always) {
  const Quality quality =
      std::holds_alternative<std::monostate>(value) ? Quality::kBad : Quality::kGood;
  const bool differs =
      always || metric.quality != quality || metric.value != value || metric.utc_ms == 0;
  metric.utc_ms = utc_ms;
  if (!differs) return;
  metric.value = std::move(value);
  metric.quality = quality;
  metric.historical = historical;
  metric.not_live = historical;
  any_not_live_ = any_not_live_ || historical;
  Mark(metric);
}

void MetricStore::ApplyReading(const Reading& reading, const CellMessage& message,
                               bool historical) {
  if (reading.use == Reading::Use::kUnknown) {
    for (Metric& metric : metrics_) {
      if (metric.name.starts_with(reading.metric))
        Set(metric, {}, message.utc_ms, historical, false);
    }
    return;
  }
  if (reading.use == Reading::Use::kResync && (!resync_ || historical)) return;
  Metric* const metric = Find(reading);
  if (metric == nullptr || reading.use == Reading::Use::kDeclaration) return;
  Set(*metric, reading.value, message.utc_ms, historical, message.topic == CellTopic::kProbe);
}

void MetricStore::MarkStale() {
  resync_ = true;
  for (Metric& metric : metrics_) {
    const bool good = metric.quality == Quality::kGood;
    if (!good || !metric.name.starts_with(kOnChangeOnly)) continue;
    metric.quality = Quality::kStale;
    Mark(metric);
  }
  for (auto& [name, kept] : restored_) kept.quality = Quality::kStale;
}

void MetricStore::PublishAsLive() {
  for (Metric& metric : metrics_) {
    if (!metric.not_live) continue;
    metric.not_live = metric.historical = false;
    Mark(metric);
  }
  any_not_live_ = false;
}

MetricStore::Outcome MetricStore::Apply(const CellMessage& message) {
  Outcome outcome = Outcome::kApplied;
  if (message.seq > 0) {
    if (message.stream == stream_ && message.seq <= seq_) return Outcome::kRepeated;
    if (!stream_.empty() && (message.stream != stream_ || message.seq != seq_ + 1)) {
      outcome = Outcome::kMissed;
      MarkStale();
    }
    stream_ = message.stream;
    seq_ = message.seq;
  }
  if (message.topic == CellTopic::kDeath) {
    death_bdSeq_ = message.bdSeq;
    return outcome;
  }
  if (message.topic == CellTopic::kBirth) {
    if (born_ && message.bdSeq == birth_bdSeq_) return Outcome::kRepeated;
    born_ = true;
    birth_bdSeq_ = message.bdSeq;
    birth_utc_ms_ = message.utc_ms;
    ++births_;
  }
  const bool historical = message.topic != CellTopic::kBirth && message.utc_ms < birth_utc_ms_;
  for (const Reading& reading : message.readings) ApplyReading(reading, message, historical);
  if (message.topic == CellTopic::kState && !historical) resync_ = false;
  if (message.seq > 0 && !historical && any_not_live_) PublishAsLive();
  return outcome;
}

std::vector<MetricStore::Change> MetricStore::TakeChanges() {
  std::vector<Change> changes;
  for (const std::size_t index : changed_) {
    Metric& metric = metrics_[index];
    metric.changed = false;
    changes.push_back({index, std::exchange(metric.published, metric.quality) != metric.quality});
  }
  changed_.clear();
  return changes;
}

void MetricStore::Published() {
  for (Metric& metric : metrics_) {
    metric.changed = metric.historical = metric.not_live = false;
    metric.published = metric.quality;
  }
  changed_.clear();
  any_not_live_ = false;
}

}  // namespace plumbline::plant
