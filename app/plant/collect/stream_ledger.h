// Ledger of a cell's stream: which sequence numbers have arrived, and which are missing.
#pragma once

#include <cstdint>
#include <map>

namespace plumbline::plant {

/// The numbers first..next-1 have arrived, but for the gaps. A number arrives once: a second
/// arrival is a repetition, whatever happened between cell and table.
class StreamLedger {
 public:
  using Gaps = std::map<std::int64_t, std::int64_t>;  ///< first missing -> last missing
  /// Gaps that are kept. With one more, the oldest is given up: its numbers count as missing for
  /// good, so that a cell that skips every other number costs a bounded time.
  static constexpr std::size_t kMostGaps = 1000;

  /// A ledger in which nothing has arrived: `next` is the number that is expected first.
  explicit StreamLedger(std::int64_t next) : first_(next), next_(next) {}
  StreamLedger(std::int64_t first, std::int64_t next, Gaps gaps)
      : first_(first), next_(next), gaps_(std::move(gaps)) {}

  /// Records an arrival. Numbers before the first, which came from a time before the stream was
  /// collected, extend it downwards.
  /// @param seq  1..2^53
  /// @return     false if it had arrived before
  bool Take(std::int64_t seq);

  std::int64_t first() const { return first_; }
  std::int64_t next() const { return next_; }
  const Gaps& gaps() const { return gaps_; }
  /// Numbers given up by this object.
  std::int64_t given_up() const { return given_up_; }

 private:
  void GiveUpOldest();

  std::int64_t first_, next_, given_up_ = 0;
  Gaps gaps_;
};

}  // namespace plumbline::plant
