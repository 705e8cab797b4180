#include "app/base/http/login_throttle.h"

#include <arpa/inet.h>

#include <algorithm>
#include <cmath>

namespace plumbline::http {
namespace {

constexpr int kMaxDoublings = 16;

/// The first 64 bits of an IPv6 address; any other text as it is.
std::string NetworkOf(const std::string& address) {
  in6_addr v6{};
  if (inet_pton(AF_INET6, address.c_str(), &v6) != 1) return address;
  return {reinterpret_cast<const char*>(v6.s6_addr), 8};
}

}  // namespace

LoginThrottle::Entry* LoginThrottle::Find(const std::string& network) {
  const auto found = std::find_if(entries_.begin(), entries_.end(),
                                  [&](const Entry& entry) { return entry.network == network; });
  return found == entries_.end() ? nullptr : &*found;
}

double LoginThrottle::Wait_s(const std::string& address, double now_s) {
  const std::lock_guard lock(mutex_);
  const Entry* const entry = Find(NetworkOf(address));
  return entry == nullptr ? 0 : std::max(0.0, entry->until_s - now_s);
}

void LoginThrottle::Failed(const std::string& address, std::uint64_t token_hash, double now_s) {
  const std::lock_guard lock(mutex_);
  const std::string network = NetworkOf(address);
  Entry* entry = Find(network);
  if (entry == nullptr) {
    if (entries_.size() < kMaxAddresses) {
      entry = &entries_.emplace_back();
    } else {
      entry =
          &*std::min_element(entries_.begin(), entries_.end(),
                             [](const Entry& a, const Entry& b) { return a.last_s < b.last_s; });
    }
    *entry = {network, 0, 0, now_s, 0};
  }
  if (now_s - entry->last_s > kForgetAfter_s) entry->failures = 0;
  entry->last_s = now_s;
  if (entry->failures > 0 && entry->token_hash == token_hash) return;
  entry->token_hash = token_hash;
  ++entry->failures;
  if (entry->failures < kFreeFailures) return;
  const int doublings = std::min(entry->failures - kFreeFailures, kMaxDoublings);
  entry->until_s = now_s + std::min(std::ldexp(1.0, doublings), kMaxWait_s);
}

void LoginThrottle::Succeeded(const std::string& address) {
  const std::lock_guard lock(mutex_);
  const std::string network = NetworkOf(address);
  std::erase_if(entries_, [&](const Entry& entry) { return entry.network == network; });
}

}  // namespace plumbline::http
