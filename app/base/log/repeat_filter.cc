#include "app/base/log/repeat_filter.h"

#include <fmt/format.h>

namespace plumbline::log {
namespace {

constexpr double kMinute_s = 60;

/// The point, client or device that the entry is about; empty if it has no fields.
std::string SubjectOf(const LogEntry& entry) {
  return entry.fields.empty() ? std::string() : entry.fields.front().value;
}

int MostPerMinute(Event event) {
  const bool answer = event == Event::kGaugeRecorded || event == Event::kGaugeRefused;
  return answer ? RepeatFilter::kMaxAnswersPerMinute : RepeatFilter::kMaxPerMinute;
}

LogEntry Summary(const LogEntry& latest, int suppressed) {
  const char* const name = EntryOf(latest.event).name;
  return {
      Event::kRepeated,
      fmt::format("{}: {} more in the last minute, the latest: {}", name, suppressed, latest.text),
      {{"REPEATED_EVENT", name}, {"REPEATED", fmt::format("{}", suppressed)}}};
}

}  // namespace

bool RepeatFilter::Admit(const LogEntry& entry, double now_s) {
  std::pair<Event, std::string> key{entry.event, SubjectOf(entry)};
  if (counts_.size() >= kMaxSubjects && counts_.find(key) == counts_.end()) key.second.clear();
  Count& count = counts_[key];
  if (count.logged == 0) count.since_s = now_s;
  if (count.logged < MostPerMinute(entry.event)) {
    ++count.logged;
    return true;
  }
  ++count.suppressed;
  count.latest = entry;
  return false;
}

std::vector<LogEntry> RepeatFilter::TakeSummaries(double now_s, bool all) {
  std::vector<LogEntry> summaries;
  for (auto it = counts_.begin(); it != counts_.end();) {
    const Count& count = it->second;
    if (!all && now_s - count.since_s < kMinute_s) {
      ++it;
      continue;
    }
    if (count.suppressed > 0) summaries.push_back(Summary(count.latest, count.suppressed));
    it = counts_.erase(it);
  }
  return summaries;
}

}  // namespace plumbline::log
