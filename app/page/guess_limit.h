// How often an address may try a token.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

namespace plumbline {

/// Slows down whoever guesses: after kFree wrong tokens of an address the next attempt has to wait
/// 1 s, then 2, 4, ... up to kLongestWait_s; a right token, or kForgotten_s without an attempt,
/// clears the address. The same wrong token again counts once: a browser with an old cookie asks
/// every second. An IPv6 address counts with its /64 network, which is what one host is given.
/// Memory is bounded: beyond kMost addresses the one longest silent is forgotten. Any thread.
class GuessLimit {
 public:
  static constexpr int kFree = 5;
  static constexpr double kLongestWait_s = 300, kForgotten_s = 3600;
  static constexpr std::size_t kMost = 1024;

  /// @return  for how long the address has to wait [s]; 0: it may try now
  double Wait_s(const std::string& address, double now_s);
  /// @param token_hash  of the wrong token that was given
  void Failed(const std::string& address, std::uint64_t token_hash, double now_s);
  void Succeeded(const std::string& address);

 private:
  struct Entry {
    std::string network;
    int failures = 0;
    std::uint64_t token_hash = 0;  ///< of the last failure
    double last_s = 0, until_s = 0;
  };
  Entry* Find(const std::string& network);

  std::mutex mutex_;
  std::vector<Entry> entries_;
};

}  // namespace plumbline
