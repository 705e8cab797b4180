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
/// An acknowledged message may be kept, because a broker that is killed forgets what it has not
/// saved: it is then published again on the next connection, under the same number.
///
/// The bound limits the bytes of all messages plus kRowBytes for each; the file is slightly larger.
/// When the bound is exceeded, the oldest acknowledged messages are removed first; then the oldest
/// messages of the lowest importance are dropped, which is counted.
class FleetQueue {
 public:
  static constexpr std::int64_t kRowBytes = 40;
  /// A message that was acknowledged on so many connections is not kept any longer.
  static constexpr int kMaxAcknowledgements = 5;
  /// @return  or the reason: no such folder, in use by another process, not a queue, newer version
  static Result<FleetQueue> Open(const std::string& path, std::int64_t bound_bytes);

  /// Appends all messages or none.
  /// @param memory  replaces the stored memory
  /// @param anyway  write even if nothing is new, to test whether the queue works
  Result<void> Append(const std::vector<Message>& messages, const std::string& memory,
                      bool anyway = false);
  const std::string& memory() const { return memory_; }

  enum class Rows { kUnacknowledged, kAll };
  /// The oldest messages after `after_seq`, at most `most`.
  Result<std::vector<QueuedMessage>> Next(std::int64_t after_seq, std::size_t most,
                                          Rows rows = Rows::kAll);
  /// Records that the broker acknowledged these messages on a connection, and keeps them. Numbers
  /// that are not in the queue are ignored, also by Remove().
  Result<void> Acknowledge(std::span<const std::int64_t> seqs);
  Result<void> Remove(std::span<const std::int64_t> seqs);

  /// When the acknowledged messages were last published again, UTC [ms]; 0: never.
  std::int64_t repeated_ms() const { return repeated_ms_; }
  Result<void> RecordRepetition(std::int64_t utc_ms);

  /// Number of messages dropped since the file was created, by importance.
  using Dropped = std::array<std::int64_t, kImportances>;
  const Dropped& dropped() const { return counts_.dropped; }
  std::int64_t size() const { return counts_.messages - counts_.kept; }  ///< not acknowledged
  std::int64_t kept() const { return counts_.kept; }                     ///< acknowledged
  std::int64_t bytes() const { return counts_.bytes; }                   ///< of both

  /// Identifier of this file, eight hexadecimal digits. Each stream has its own count of `seq`.
  const std::string& stream() const { return stream_; }

 private:
  struct Counts {
    std::int64_t messages = 0, bytes = 0;
    std::int64_t kept = 0;  ///< of `messages`: acknowledged
    Dropped dropped{};
  };
  FleetQueue(sqlite::Database database, std::int64_t bound_bytes)
      : database_(std::move(database)), bound_bytes_(bound_bytes) {}
  Result<void> Prepare();
  Result<void> LoadCounts();
  bool DropOldest(Counts& counts);
  bool RunDeletion(sqlite::Statement& deletion, Counts& counts);
  bool RemoveInside(std::span<const std::int64_t> seqs, Counts& counts);
  Error Failed(const char* what) const;

  sqlite::Database database_;
  std::int64_t bound_bytes_;
  Counts counts_;
  std::string stream_, memory_;
  std::int64_t repeated_ms_ = 0;
};

}  // namespace plumbline::plant
