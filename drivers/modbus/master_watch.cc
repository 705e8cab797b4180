#include "drivers/modbus/master_watch.h"

#include <algorithm>

namespace plumbline::modbus {

std::optional<Client> MasterWatch::RecordWrite(const Client& writer, double now_s) {
  const auto end = writes_.begin() + static_cast<std::ptrdiff_t>(count_);
  const auto own =
      std::find_if(writes_.begin(), end, [&](const Write& w) { return w.client == writer; });
  const bool wrote_before = own != end && now_s - own->time_s <= kConflictWindow_s;
  std::optional<Client> other;
  for (auto write = writes_.begin(); write != end && !other; ++write) {
    if (write->client == writer || now_s - write->time_s > kConflictWindow_s) continue;
    const bool since_own = wrote_before && write < own;  // most recent first
    if (write->client.address != writer.address || since_own) other = write->client;
  }
  const bool room = count_ < kMaxClients;
  if (own == end && room) ++count_;
  const auto last = own == end && !room ? std::prev(end) : own;
  std::move_backward(writes_.begin(), last, std::next(last));
  writes_.front() = {writer, now_s};
  return other;
}

}  // namespace plumbline::modbus
