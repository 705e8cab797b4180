// Store and forward: messages wait on the disk until the broker has acknowledged them.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "app/fleet/message.h"
#include "app/sqlite/database.h"

namespace plumbline {

/// One SQLite file (write-ahead log, synchronous=FULL), written by one process. A message is in it
/// when Append() has returned, whatever is killed or switched off afterwards; with it, in the same
/// transaction, what whoever noticed it remembers, so that nothing is noticed twice or not at all.
///
/// The bound counts bytes of the messages with kRowBytes each; the file itself is a little larger.
/// Beyond it messages are dropped: of the least importance the oldest first.
class FleetQueue {
 public:
  static constexpr std::int64_t kRowBytes = 40;
  /// @return why not: no such folder, another process has it, no queue or of a newer version
  static Result<FleetQueue> Open(const std::string& path, std::int64_t bound_bytes);

  /// All of it or nothing. @param memory  replaces the former one
  /// @param anyway  writes even where nothing is new: whether the queue works is seen by it
  Result<void> Append(const std::vector<Message>& messages, const std::string& memory,
                      bool anyway = false);
  const std::string& memory() const { return memory_; }

  /// The oldest behind `after_seq`.
  Result<std::vector<QueuedMessage>> Next(std::int64_t after_seq, std::size_t most);
  /// They have arrived. What is not there any more is passed over.
  Result<void> Remove(std::span<const std::int64_t> seqs);

  /// How many were dropped since the file was made, by importance.
  using Dropped = std::array<std::int64_t, kImportances>;
  const Dropped& dropped() const { return counts_.dropped; }
  std::int64_t size() const { return counts_.messages; }
  std::int64_t bytes() const { return counts_.bytes; }

  /// Of this file: eight hexadecimal digits. Another stream counts its seq anew.
  const std::string& stream() const { return stream_; }

 private:
  struct Counts {
    std::int64_t messages = 0, bytes = 0;
    Dropped dropped{};
  };
  FleetQueue(Database database, std::int64_t bound_bytes)
      : database_(std::move(database)), bound_bytes_(bound_bytes) {}
  Result<void> IsOurs();
  Result<void> Prepare();
  Result<void> Load();
  bool MakeRoom(Counts& counts);
  Error Failed(const char* what) const;

  Database database_;
  std::int64_t bound_bytes_;
  Counts counts_;
  std::string stream_, memory_;
};

}  // namespace plumbline
