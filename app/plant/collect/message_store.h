// Writer of received messages into the plant's tables, a batch in one transaction.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "app/plant/collect/admission.h"
#include "app/plant/collect/message_batch.h"
#include "app/plant/database/connection.h"
#include "app/plant/database/plant_config.h"

namespace plumbline::plant {

/// Counts since the start, for the status line.
struct StoreCounts {
  std::int64_t stored = 0;        ///< messages
  std::int64_t repeated = 0;      ///< discarded, because they had arrived before
  std::int64_t dead_letters = 0;  ///< unreadable
  std::int64_t refused = 0;       ///< more than a cell may send
};

/// Decodes messages and writes them. Every message ends in a table: its own, `dead_letter` with the
/// reason, or counted in `refused`; or it is a repetition. Several stores may write at once.
class MessageStore {
 public:
  /// @param admission  outlives it: a new connection must not renew what a cell may send
  /// @param connection  with the rights of plumbline_collector
  static Result<MessageStore> On(Connection connection, Admission& admission);

  /// Writes all messages; on error those are missing that are to be delivered again. Messages that
  /// the database does not accept are found by taking the cells apart and halving, and become dead
  /// letters; a cell with many of them is refused the rest of the batch.
  /// @param now_s  UTC
  /// @return       an error of the connection or of the database's set-up: open another later
  Result<void> Write(std::span<const Received> messages, double now_s);
  /// Waits until all that was written is on disk, and on the standby if the database waits for one.
  /// Only then may the messages be acknowledged: a crash may lose what Write() wrote until then.
  Result<void> Flush();
  /// Drops what is older than the retention.
  Result<void> DropOld(double now_s);

  const StoreCounts& counts() const { return counts_; }
  bool alive() const { return connection_.alive(); }
  /// Whether the last failure was that of rights or of a read-only database, which time alone does
  /// not cure.
  bool forbidden() const;

 private:
  static constexpr int kMostRejected = 20;  ///< of a batch, found one by one

  MessageStore(Connection connection, Admission& admission, int retention_months);
  DecodedMessage DecodedFrom(const Received& received, double now_s);
  void Refuse(int cell, const char* why, double now_s);
  Result<void> WriteDecoded(std::span<DecodedMessage*> messages, double now_s);
  Result<void> WriteOnce(std::span<DecodedMessage*> messages, double now_s);
  Result<int> CellOf(const TopicParts& topic);
  Result<void> LockCells(const MessageBatch& batch);
  Result<std::map<StreamKey, StreamLedger>> ReadLedgers(const MessageBatch& batch);
  Result<void> EnsureMonths(MessageBatch& batch);
  Result<void> WriteRows(const MessageBatch& batch);
  Result<void> WriteLedgers(const MessageBatch& batch);
  Result<void> WriteDeadLetters(MessageBatch& batch);
  Result<void> WriteRefused();

  Connection connection_;
  Admission* admission_;
  int retention_months_;
  int rejected_ = 0;                            ///< by the database, of this batch
  std::unordered_map<std::string, int> cells_;  ///< by LINE/NODE
  std::set<std::int64_t> months_;               ///< whose partitions exist: years * 12 + month
  std::map<std::tuple<int, std::int64_t, std::string>, std::int64_t> refused_;  ///< by cell, minute
  StoreCounts counts_;
};

}  // namespace plumbline::plant
