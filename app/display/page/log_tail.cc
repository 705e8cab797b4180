#include "app/display/page/log_tail.h"

namespace plumbline::display {

void LogTail::Add(const display::DisplayStatus& now) {
  static const std::vector<cell::ViewLine> kNone;
  const std::vector<cell::ViewLine>& own = now.viewer_lines;
  const std::vector<cell::ViewLine>& daemon = now.state ? now.state->lines : kNone;
  const std::lock_guard lock(mutex_);
  std::set<Key> carried;
  // Merge the two programs' lines by time, keeping each program's order.
  auto a = own.begin(), b = daemon.begin();
  while (a != own.end() || b != daemon.end()) {
    const bool is_own = b == daemon.end() || (a != own.end() && a->utc_s <= b->utc_s);
    const cell::ViewLine& line = is_own ? *a++ : *b++;
    const Key key{line.utc_s, {line.number, is_own}};
    carried.insert(key);
    if (!known_.insert(key).second) continue;
    lines_.push_back(
        {key, {line.utc_s, line.level, is_own ? "plumbline-view" : "plumblined", line.text}});
  }
  while (lines_.size() > kMaxLines) lines_.pop_front();
  // Lines that the next states still contain must not be added again after trimming.
  known_ = std::move(carried);
  for (const auto& [key, line] : lines_) known_.insert(key);
}

std::vector<RecentLogEntry> LogTail::Lines() const {
  const std::lock_guard lock(mutex_);
  std::vector<RecentLogEntry> lines;
  for (const auto& [key, line] : lines_) lines.push_back(line);
  return lines;
}

}  // namespace plumbline::display
