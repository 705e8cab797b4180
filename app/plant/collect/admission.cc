#include "app/plant/collect/admission.h"

#include <algorithm>
#include <cmath>

namespace plumbline::plant {

bool Admission::Bucket::Take(std::int64_t at_ms, double per_second, double most, double cost) {
  if (newest_ms == 0) newest_ms = at_ms;
  if (at_ms > newest_ms) {
    tokens = std::min(most, tokens + 1e-3 * per_second * static_cast<double>(at_ms - newest_ms));
    newest_ms = at_ms;
  }
  if (tokens < cost) return false;
  tokens -= cost;
  return true;
}

const char* Admission::Refused(int cell, std::optional<std::int64_t> utc_ms, double now_s,
                               double cost) {
  Account& account = accounts_[cell];
  const auto day = static_cast<std::int64_t>(std::floor(now_s / 86400));
  if (day != account.day) {
    account.day = day;
    account.today = 0;
  }
  if (account.today >= per_day_) return "more messages a day than messages_per_day";
  // A time ahead of this clock earns nothing: it could be invented.
  const auto now_ms = static_cast<std::int64_t>(1e3 * now_s);
  const bool admitted =
      utc_ms ? account.timed.Take(std::min(*utc_ms, now_ms), per_second_, kBurst, cost)
             : account.untimed.Take(now_ms, kPerSecondWithoutTime, kBurstWithoutTime, 1);
  if (!admitted) return "more messages a second than messages_per_second";
  ++account.today;
  return nullptr;
}

}  // namespace plumbline::plant
