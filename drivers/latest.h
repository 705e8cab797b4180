// One writer, several readers, the newest value only; nobody waits, nothing allocates.
//
// Protocol. The values lie in fixed slots; `latest_` names the published one, and every slot counts
// the readers that hold it.
//   reader: s = latest; ++held[s]; if latest is still s, use the slot, later --held[s];
//           otherwise --held[s] and start again (only when the writer published in between).
//   writer: take any slot that is not the latest and whose count is 0, fill it, latest = that slot.
// Why it cannot tear: the count is raised before `latest_` is read again, and the writer stores
// `latest_` before it reads the counts, all sequentially consistent. If the writer saw count 0 for
// a slot that is no longer the latest, a reader's increment comes after it, so the reader's second
// look sees the newer `latest_` and lets go without having read; if that slot has been published
// again meanwhile, its filling is complete and the reader's count protects it from then on.
// Why one pass finds a slot: `latest_` stands still while the writer looks, so each reader can
// occupy at most one other slot during the pass, and with readers + 2 slots one is left over. The
// writer is wait-free, a reader lock-free.
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
    mutable std::atomic<int> held{0};
  };

 public:
  /// The value as it was published, unchanged as long as the guard lives. Keep it for the time of
  /// use only, and at most one guard for each reader at a time.
  class Guard {
   public:
    explicit Guard(const Slot& slot) : slot_(&slot) {}
    Guard(Guard&& other) noexcept : slot_(other.slot_) { other.slot_ = nullptr; }
    Guard(const Guard&) = delete;
    Guard& operator=(const Guard&) = delete;
    Guard& operator=(Guard&&) = delete;
    ~Guard() {
      if (slot_ != nullptr) slot_->held.fetch_sub(1);
    }
    const T& operator*() const { return slot_->value; }
    const T* operator->() const { return &slot_->value; }

   private:
    const Slot* slot_;
  };

  /// @param max_readers  guards that may exist at the same time
  /// @param initial      published at once and copied into every slot, so that values with buffers
  ///                     have them from the start
  Latest(int max_readers, const T& initial)
      : slot_count_(max_readers + 2), slots_(new Slot[static_cast<std::size_t>(slot_count_)]) {
    for (int i = 0; i < slot_count_; ++i) slots_[i].value = initial;
  }

  /// Any thread.
  Guard Read() const {
    for (;;) {
      const int index = latest_.load();
      const Slot& slot = slots_[index];
      slot.held.fetch_add(1);
      if (latest_.load() == index) return Guard(slot);
      slot.held.fetch_sub(1);
    }
  }

  /// The writer only: a slot to fill in place. It holds an older value, not always the last one.
  T& Begin() {
    const int latest = latest_.load();
    for (int i = 0; i < slot_count_; ++i) {
      if (i == latest || slots_[i].held.load() != 0) continue;
      filling_ = i;
      return slots_[i].value;
    }
    assert(false && "more guards than the readers announced");
    __builtin_trap();
  }

  /// The writer only: makes the slot of the last Begin() the newest value.
  void Publish() {
    assert(filling_ >= 0);
    latest_.store(filling_);
    filling_ = -1;
  }

 private:
  std::atomic<int> latest_{0};
  int filling_ = -1;  ///< the writer's own
  const int slot_count_;
  std::unique_ptr<Slot[]> slots_;
};

}  // namespace plumbline
