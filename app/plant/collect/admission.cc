#include "app/plant/collect/admission.h"

#include <algorithm>
#include <cmath>

namespace plumbline::plant {

const char* Admission::Refused(int cell, std::int64_t utc_ms, double now_s) {
  Account& account = accounts_[cell];
  const auto day = static_cast<std::int64_t>(std::floor(now_s / 86400));
  if (day != account.day) {
    account.day = day;
    account.today = 0;
  }
  if (account.newest_ms == 0) account.newest_ms = utc_ms;
  // A time ahead of this clock earns nothing: it could be invented.
  const auto latest_ms = static_cast<std::int64_t>(1e3 * now_s);
  const std::int64_t at_ms = std::min(utc_ms, latest_ms);
  if (at_ms > account.newest_ms) {
    const double since_s = 1e-3 * static_cast<double>(at_ms - account.newest_ms);
    account.tokens = std::min(kBurst, account.tokens + per_second_ * since_s);
    account.newest_ms = at_ms;
  }
  if (account.today >= per_day_) return "more messages a day than messages_per_day";
  if (account.tokens < 1) return "more messages a second than messages_per_second";
  account.tokens -= 1;
  ++account.today;
  return nullptr;
}

}  // namespace plumbline::plant
