// Persistent store-and-forward queue of messages to the broker.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "app/base/sqlite/database.h"
#include "app/plant/publish/message.h"

namespace plumbline::plant {

/// One SQLite file (write-ahead log, synchronous=FULL), written by one process. When Append()
/// returns, its messages survive a crash or power cut; the producer's memory is stored in the same
/// transaction, so that no event is reported twice or lost.
///
/// The bound limits the bytes of the messages plus kRowBytes for each; the file is slightly larger.
/// When the bound is exceeded, the oldest messages of the lowest importance are dropped.
class FleetQueue {
 public:
  static constexpr std::int64_t kRowBytes = 40;
  /// @return  or the reason: no such folder, in use by another process, not a queue, newer version
  static Result<FleetQueue> Open(const std::string& path, std::int64_t bound_bytes);

  /// Appends all messages or none.
  /// @param memory  replaces the stored memory
  /// @param anyway  write even if nothing is new, to test whether the queue works
  Result<void> Append(const std::vector<Message>& messages, const std::string& memory,
                      bool anyway = false);
  const std::string& memory() const { return memory_; }

  /// The oldest messages after `after_seq`, at most `most`.
  Result<std::vector<QueuedMessage>> Next(std::int64_t after_seq, std::size_t most);
  /// Removes acknowledged messages; numbers that are not in the queue are ignored.
  Result<void> Remove(std::span<const std::int64_t> seqs);

  /// Number of messages dropped since the file was created, by importance.
  using Dropped = std::array<std::int64_t, kImportances>;
  const Dropped& dropped() const { return counts_.dropped; }
  std::int64_t size() const { return counts_.messages; }
  std::int64_t bytes() const { return counts_.bytes; }

  /// Identifier of this file, eight hexadecimal digits. Each stream has its own count of `seq`.
  const std::string& stream() const { return stream_; }

 private:
  struct Counts {
    std::int64_t messages = 0, bytes = 0;
    Dropped dropped{};
  };
  FleetQueue(sqlite::Database database, std::int64_t bound_bytes)
      : database_(std::move(database)), bound_bytes_(bound_bytes) {}
  Result<void> Prepare();
  Result<void> LoadCounts();
  bool DropOldest(Counts& counts);
  Error Failed(const char* what) const;

  sqlite::Database database_;
  std::int64_t bound_bytes_;
  Counts counts_;
  std::string stream_, memory_;
};

}  // namespace plumbline::plant
