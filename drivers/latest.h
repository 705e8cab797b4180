// Wait-free mailbox that holds the newest value: one writer, several readers, no allocation.
//
// Protocol. The values are in fixed slots; `latest_` is the index of the published one, and every
// slot counts the readers that use it.
//   reader: s = latest; ++use_count[s]; if latest is still s, use the slot, later --use_count[s];
//           otherwise --use_count[s] and retry (only if the writer published in between).
//   writer: pick any slot that is not the latest and whose count is 0, fill it, latest = that slot.
// Why a value cannot tear: a reader increments the count before it reads `latest_` again, and the
// writer stores `latest_` before it reads the counts, all sequentially consistent. If the writer
// saw count 0 for a slot that is no longer the latest, a reader's increment comes later, so the
// reader's second load sees the newer `latest_` and releases the slot without having read it; if
// that slot has been published again meanwhile, it is completely filled and the reader's count
// protects it. Why one pass finds a slot: `latest_` does not change while the writer searches, so
// each reader can occupy at most one other slot during the pass, and of readers + 2 slots one
// remains free. The writer is wait-free, a reader lock-free.
#pragma once

#include <atomic>
#include <cassert>
#include <cstddef>
#include <memory>

namespace plumbline {

template <typename T>
class Latest {
  struct alignas(64) Slot {
    T value;
    mutable std::atomic<int> use_count{0};
  };

 public:
  /// Read access to a published value, which does not change while the guard exists. Keep a guard
  /// only while the value is in use; each reader may hold at most one guard at a time.
  class Guard {
   public:
    explicit Guard(const Slot& slot) : slot_(&slot) {}
    Guard(Guard&& other) noexcept : slot_(other.slot_) { other.slot_ = nullptr; }
    Guard(const Guard&) = delete;
    Guard& operator=(const Guard&) = delete;
    Guard& operator=(Guard&&) = delete;
    ~Guard() {
      if (slot_ != nullptr) slot_->use_count.fetch_sub(1);
    }
    const T& operator*() const { return slot_->value; }
    const T* operator->() const { return &slot_->value; }

   private:
    const Slot* slot_;
  };

  /// @param max_readers  number of guards that may exist at the same time
  /// @param initial      published at once and copied into every slot, so that values that own
  ///                     buffers have them allocated from the start
  Latest(int max_readers, const T& initial)
      : slot_count_(max_readers + 2), slots_(new Slot[static_cast<std::size_t>(slot_count_)]) {
    for (int i = 0; i < slot_count_; ++i) slots_[i].value = initial;
  }

  /// The newest value. Any thread.
  Guard Read() const {
    for (;;) {
      const int index = latest_.load();
      const Slot& slot = slots_[index];
      slot.use_count.fetch_add(1);
      if (latest_.load() == index) return Guard(slot);
      slot.use_count.fetch_sub(1);
    }
  }

  /// Writer only: a slot to fill in place. It contains an older value, not necessarily the previous
  /// one.
  T& Begin() {
    const int latest = latest_.load();
    for (int i = 0; i < slot_count_; ++i) {
      if (i == latest || slots_[i].use_count.load() != 0) continue;
      filling_ = i;
      return slots_[i].value;
    }
    assert(false && "more guards than max_readers");
    __builtin_trap();
  }

  /// Writer only: makes the slot returned by Begin() the newest value.
  void Publish() {
    assert(filling_ >= 0);
    latest_.store(filling_);
    filling_ = -1;
  }

 private:
  std::atomic<int> latest_{0};
  int filling_ = -1;  ///< slot being filled; writer only
  const int slot_count_;
  std::unique_ptr<Slot[]> slots_;
};

}  // namespace plumbline
