// Rate limit on wrong tokens, per client address.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

namespace plumbline::http {

/// After kFreeFailures wrong tokens from an address, the next attempt has to wait 1 s, then 2, 4,
/// ... up to kMaxWait_s. The correct token, or kForgetAfter_s without an attempt, resets the count
/// of the address. Repeating the same wrong token counts once, since a browser with an outdated
/// cookie sends it every second. IPv6 addresses are grouped by /64 network, which a single host may
/// own. Memory is bounded: beyond kMaxAddresses, the address that was silent longest is dropped.
/// Thread-safe.
class LoginThrottle {
 public:
  static constexpr int kFreeFailures = 5;
  static constexpr double kMaxWait_s = 300, kForgetAfter_s = 3600;
  static constexpr std::size_t kMaxAddresses = 1024;

  /// @return  how long the address still has to wait [s]; 0 if it may try now
  double Wait_s(const std::string& address, double now_s);
  /// @param token_hash  hash of the wrong token
  void Failed(const std::string& address, std::uint64_t token_hash, double now_s);
  void Succeeded(const std::string& address);

 private:
  struct Entry {
    std::string network;
    int failures = 0;
    std::uint64_t token_hash = 0;  ///< of the last wrong token
    double last_s = 0, until_s = 0;
  };
  Entry* Find(const std::string& network);

  std::mutex mutex_;
  std::vector<Entry> entries_;
};

}  // namespace plumbline::http
