#include "app/page/log_tail.h"

namespace plumbline {

void LogTail::Take(const ShownNow& now) {
  const std::lock_guard lock(mutex_);
  const auto take = [this](const std::vector<ViewLine>& lines, bool own) {
    for (const ViewLine& line : lines) {
      lines_.try_emplace(
          {line.utc_s, {line.number, own}},
          TailLine{line.utc_s, line.level, own ? "plumbline-view" : "plumblined", line.text});
    }
  };
  take(now.own_lines, true);
  if (now.state) take(now.state->lines, false);
  while (lines_.size() > kMost) lines_.erase(lines_.begin());
}

std::vector<TailLine> LogTail::Lines() const {
  const std::lock_guard lock(mutex_);
  std::vector<TailLine> lines;
  for (const auto& [key, line] : lines_) lines.push_back(line);
  return lines;
}

}  // namespace plumbline
