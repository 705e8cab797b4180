#include "app/log/repeats.h"

#include <fmt/format.h>

namespace plumbline {
namespace {

constexpr double kMinute_s = 60;

/// What the entry is about, as far as its fields tell: a point, a client, a device.
std::string SubjectOf(const LogEntry& entry) {
  return entry.fields.empty() ? std::string() : entry.fields.front().value;
}

LogEntry Summary(const LogEntry& latest, int held) {
  LogEntry told{
      Event::kRepeated,
      fmt::format("{}: {} more in the last minute, the latest: {}", EntryOf(latest.event).name,
                  held, latest.text),
      {{"REPEATED_EVENT", EntryOf(latest.event).name}, {"REPEATED", fmt::format("{}", held)}}};
  return told;
}

}  // namespace

bool Repeats::Pass(const LogEntry& entry, double now_s) {
  std::pair<Event, std::string> key{entry.event, SubjectOf(entry)};
  if (counts_.size() >= kMostSubjects && counts_.find(key) == counts_.end()) key.second.clear();
  Count& count = counts_[key];
  if (count.told == 0) count.since_s = now_s;
  if (count.told < kMostAMinute) {
    ++count.told;
    return true;
  }
  ++count.held;
  count.latest = entry;
  return false;
}

std::vector<LogEntry> Repeats::Due(double now_s, bool all) {
  std::vector<LogEntry> due;
  for (auto it = counts_.begin(); it != counts_.end();) {
    const Count& count = it->second;
    if (!all && now_s - count.since_s < kMinute_s) {
      ++it;
      continue;
    }
    if (count.held > 0) due.push_back(Summary(count.latest, count.held));
    it = counts_.erase(it);
  }
  return due;
}

}  // namespace plumbline
