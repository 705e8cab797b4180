#include "app/plant/collect/stream_ledger.h"

#include <iterator>

namespace plumbline::plant {

void StreamLedger::GiveUpOldest() {
  if (gaps_.size() <= kMostGaps) return;
  const auto [from, to] = *gaps_.begin();
  given_up_ += to - from + 1;
  gaps_.erase(gaps_.begin());
}

bool StreamLedger::Take(std::int64_t seq) {
  if (seq >= next_) {
    if (seq > next_) gaps_[next_] = seq - 1;
    next_ = seq + 1;
    GiveUpOldest();
    return true;
  }
  if (seq < first_) {
    if (seq < first_ - 1) gaps_[seq + 1] = first_ - 1;
    first_ = seq;
    GiveUpOldest();
    return true;
  }
  auto gap = gaps_.upper_bound(seq);
  if (gap == gaps_.begin()) return false;
  --gap;
  const auto [from, to] = *gap;
  if (seq > to) return false;
  gaps_.erase(gap);
  if (from < seq) gaps_[from] = seq - 1;
  if (seq < to) gaps_[seq + 1] = to;
  GiveUpOldest();
  return true;
}

}  // namespace plumbline::plant
