#include "app/plant/publish/queue.h"

#include <numeric>

#include "app/base/sqlite/database.h"

namespace plumbline::plant {
namespace {

constexpr sqlite::StoreIdentity kQueueIdentity{0x504C4651, 2,  // "PLFQ"
                                               "a queue of plumbline-fleet", 1};
/// Messages removed at a time when the queue is full.
constexpr int kDropBatch = 16;

constexpr const char* kQueueTables = R"(
CREATE TABLE message (
  seq INTEGER PRIMARY KEY AUTOINCREMENT,
  kind INTEGER NOT NULL, importance INTEGER NOT NULL, utc_ms INTEGER NOT NULL, body TEXT NOT NULL
);
CREATE INDEX by_importance ON message (importance, seq);
CREATE TABLE stream (
  id TEXT NOT NULL, memory TEXT NOT NULL,
  dropped_0 INTEGER NOT NULL, dropped_1 INTEGER NOT NULL, dropped_2 INTEGER NOT NULL
);
INSERT INTO stream VALUES (lower(hex(randomblob(4))), '', 0, 0, 0);
)";

/// From schema 1 to 2: acknowledged messages are kept.
constexpr const char* kAddAcknowledgements = R"(
ALTER TABLE message ADD COLUMN acknowledgements INTEGER NOT NULL DEFAULT 0;
CREATE INDEX acknowledged ON message (seq) WHERE acknowledgements > 0;
ALTER TABLE stream ADD COLUMN repeated_ms INTEGER NOT NULL DEFAULT 0;
)";

constexpr const char* kRemoveAcknowledged =
    "DELETE FROM message WHERE seq IN (SELECT seq FROM message WHERE acknowledgements > 0"
    " ORDER BY seq LIMIT ?) RETURNING importance, acknowledgements, length(CAST(body AS BLOB))";
constexpr const char* kDropLeastImportant =
    "DELETE FROM message WHERE seq IN (SELECT seq FROM message WHERE importance ="
    " (SELECT min(importance) FROM message) ORDER BY seq LIMIT ?)"
    " RETURNING importance, acknowledgements, length(CAST(body AS BLOB))";
constexpr const char* kRemoveOne =
    "DELETE FROM message WHERE seq = ?"
    " RETURNING importance, acknowledgements, length(CAST(body AS BLOB))";

}  // namespace

const char* TopicTypeOf(MessageKind kind) {
  switch (kind) {
    case MessageKind::kState:
      return "NDATA";
    case MessageKind::kPoint:
      return "NPOINT";
    case MessageKind::kLens:
      return "NLENS";
    case MessageKind::kModel:
      return "NMODEL";
    case MessageKind::kAlarm:
      return "NALARM";
    case MessageKind::kProbe:
      return "NPROBE";
    case MessageKind::kLost:
      return "NLOST";
    case MessageKind::kCell:
      return "NCELL";
  }
  return "NDATA";
}

int ImportanceOf(MessageKind kind) {
  switch (kind) {
    case MessageKind::kState:
      return 0;
    case MessageKind::kPoint:
    case MessageKind::kLens:
    case MessageKind::kModel:
    case MessageKind::kCell:
      return 1;
    case MessageKind::kAlarm:
    case MessageKind::kProbe:
    case MessageKind::kLost:
      break;
  }
  return 2;
}

Error FleetQueue::Failed(const char* what) const {
  return sqlite::Failure(database_, what);
}

Result<FleetQueue> FleetQueue::Open(const std::string& path, std::int64_t bound_bytes) {
  Result<sqlite::Database> opened = sqlite::Database::Open(path, sqlite::Database::Mode::kWrite);
  if (!opened) return opened.failure();
  FleetQueue queue(std::move(opened).value(), bound_bytes);
  const Result<void> prepared = queue.Prepare();
  if (!prepared) return prepared.failure();
  const Result<void> loaded = queue.LoadCounts();
  if (!loaded) return loaded.failure();
  return queue;
}

Result<void> FleetQueue::Prepare() {
  // Two publishers of one queue would publish everything twice; the second is refused.
  if (!database_.Run("PRAGMA locking_mode=EXCLUSIVE")) return Failed("cannot be prepared");
  if (!database_.Run("SELECT count(*) FROM sqlite_master")) {
    return Failed("cannot be read (is another plumbline-fleet using it?)");
  }
  const Result<std::int64_t> schema = sqlite::SchemaOf(database_, kQueueIdentity);
  if (!schema) return schema.failure();
  if (!database_.Run("PRAGMA journal_mode=WAL") || !database_.Run("PRAGMA synchronous=FULL") ||
      !database_.Run("PRAGMA wal_autocheckpoint=200") ||
      !database_.Run("PRAGMA journal_size_limit=4000000")) {
    return Failed("cannot be prepared (is another plumbline-fleet using it?)");
  }
  sqlite::Transaction transaction(database_);
  if (!transaction.begun()) return Failed("cannot be written");
  const auto version = database_.IntegerOf("PRAGMA user_version");
  if (!version) return version.failure();
  if (*version < kQueueIdentity.schema) {
    const bool created = *version > 0 || database_.Run(kQueueTables);
    if (!created || !database_.Run(kAddAcknowledgements) ||
        !database_.Run(kQueueIdentity.Mark().c_str())) {
      return Failed(created ? "cannot be brought up to date" : "cannot be created");
    }
  }
  if (!transaction.Commit()) return Failed("cannot be written");
  return {};
}

Result<void> FleetQueue::LoadCounts() {
  sqlite::Statement stream(database_.get(),
                           "SELECT id, memory, dropped_0, dropped_1, dropped_2, repeated_ms"
                           " FROM stream");
  if (stream.Step() != SQLITE_ROW) return Failed("cannot be read");
  stream_ = stream.Text(0);
  memory_ = stream.Text(1);
  for (int k = 0; k < kImportances; ++k) {
    counts_.dropped[static_cast<std::size_t>(k)] = stream.Integer(2 + k);
  }
  repeated_ms_ = stream.Integer(2 + kImportances);
  const auto messages = database_.IntegerOf("SELECT count(*) FROM message");
  const auto kept = database_.IntegerOf("SELECT count(*) FROM message WHERE acknowledgements > 0");
  const auto bytes =
      database_.IntegerOf("SELECT coalesce(sum(length(CAST(body AS BLOB))), 0) FROM message");
  if (!messages) return messages.failure();
  if (!kept) return kept.failure();
  if (!bytes) return bytes.failure();
  counts_.messages = *messages;
  counts_.kept = *kept;
  counts_.bytes = *bytes + kRowBytes * *messages;
  return {};
}

/// Runs a deletion that returns importance, acknowledgements and length of each removed message.
bool FleetQueue::RunDeletion(sqlite::Statement& deletion, Counts& counts) {
  int code = SQLITE_ROW;
  while ((code = deletion.Step()) == SQLITE_ROW) {
    const bool acknowledged = deletion.Integer(1) > 0;
    if (acknowledged) --counts.kept;
    if (!acknowledged) ++counts.dropped[static_cast<std::size_t>(deletion.Integer(0))];
    --counts.messages;
    counts.bytes -= kRowBytes + deletion.Integer(2);
  }
  return code == SQLITE_DONE;
}

bool FleetQueue::DropOldest(Counts& counts) {
  while (counts.bytes > bound_bytes_ && counts.messages > 0) {
    sqlite::Statement drop(database_.get(),
                           counts.kept > 0 ? kRemoveAcknowledged : kDropLeastImportant);
    drop.Bind(1, std::int64_t{kDropBatch});
    if (!RunDeletion(drop, counts)) return false;
  }
  return true;
}

Result<void> FleetQueue::Append(const std::vector<Message>& messages, const std::string& memory,
                                bool anyway) {
  if (messages.empty() && memory == memory_ && !anyway) return {};
  Counts counts = counts_;
  sqlite::Transaction transaction(database_);
  if (!transaction.begun()) return Failed("cannot be written");
  sqlite::Statement insert(database_.get(),
                           "INSERT INTO message (kind, importance, utc_ms, body) VALUES (?,?,?,?)");
  for (const Message& message : messages) {
    insert.Bind(1, static_cast<std::int64_t>(message.kind));
    insert.Bind(2, static_cast<std::int64_t>(ImportanceOf(message.kind)));
    insert.Bind(3, message.utc_ms);
    insert.Bind(4, message.body);
    if (!insert.Run()) return Failed("cannot be written");
    ++counts.messages;
    counts.bytes += kRowBytes + static_cast<std::int64_t>(message.body.size());
  }
  if (!DropOldest(counts)) return Failed("cannot be written");
  sqlite::Statement note(
      database_.get(), "UPDATE stream SET memory = ?, dropped_0 = ?, dropped_1 = ?, dropped_2 = ?");
  note.Bind(1, memory);
  for (int k = 0; k < kImportances; ++k) {
    note.Bind(2 + k, counts.dropped[static_cast<std::size_t>(k)]);
  }
  if (!note.Run() || !transaction.Commit()) return Failed("cannot be written");
  counts_ = counts;
  memory_ = memory;
  return {};
}

Result<std::vector<QueuedMessage>> FleetQueue::Next(std::int64_t after_seq, std::size_t most,
                                                    Rows rows_wanted) {
  std::vector<QueuedMessage> next;
  const bool all = rows_wanted == Rows::kAll;
  if ((all ? counts_.messages : size()) == 0 || most == 0) return next;
  sqlite::Statement rows(database_.get(),
                         "SELECT seq, kind, utc_ms, body FROM message WHERE seq > ?"
                         " AND (? OR acknowledgements = 0) ORDER BY seq LIMIT ?");
  rows.Bind(1, after_seq);
  rows.Bind(2, std::int64_t{all});
  rows.Bind(3, static_cast<std::int64_t>(most));
  int code = SQLITE_ROW;
  while ((code = rows.Step()) == SQLITE_ROW) {
    next.push_back({rows.Integer(0),
                    {static_cast<MessageKind>(rows.Integer(1)), rows.Integer(2), rows.Text(3)}});
  }
  if (code != SQLITE_DONE) return Failed("cannot be read");
  return next;
}

Result<void> FleetQueue::Acknowledge(std::span<const std::int64_t> seqs) {
  if (seqs.empty()) return {};
  Counts counts = counts_;
  sqlite::Transaction transaction(database_);
  if (!transaction.begun()) return Failed("cannot be written");
  sqlite::Statement note(database_.get(),
                         "UPDATE message SET acknowledgements = acknowledgements + 1 WHERE seq = ?"
                         " RETURNING acknowledgements");
  std::vector<std::int64_t> finished;
  for (const std::int64_t seq : seqs) {
    note.Bind(1, seq);
    int code = SQLITE_ROW;
    while ((code = note.Step()) == SQLITE_ROW) {
      if (note.Integer(0) == 1) ++counts.kept;
      if (note.Integer(0) >= kMaxAcknowledgements) finished.push_back(seq);
    }
    if (code != SQLITE_DONE) return Failed("cannot be written");
    note.Reset();
  }
  if (!RemoveInside(finished, counts) || !transaction.Commit()) return Failed("cannot be written");
  counts_ = counts;
  return {};
}

bool FleetQueue::RemoveInside(std::span<const std::int64_t> seqs, Counts& counts) {
  const Dropped dropped = counts.dropped;
  sqlite::Statement remove(database_.get(), kRemoveOne);
  for (const std::int64_t seq : seqs) {
    remove.Bind(1, seq);
    if (!RunDeletion(remove, counts)) return false;
    remove.Reset();
  }
  counts.dropped = dropped;  // they were delivered
  return true;
}

Result<void> FleetQueue::Remove(std::span<const std::int64_t> seqs) {
  if (seqs.empty()) return {};
  Counts counts = counts_;
  sqlite::Transaction transaction(database_);
  if (!transaction.begun()) return Failed("cannot be written");
  if (!RemoveInside(seqs, counts) || !transaction.Commit()) return Failed("cannot be written");
  counts_ = counts;
  return {};
}

Result<void> FleetQueue::RecordRepetition(std::int64_t utc_ms) {
  sqlite::Statement note(database_.get(), "UPDATE stream SET repeated_ms = ?");
  note.Bind(1, utc_ms);
  if (!note.Run()) return Failed("cannot be written");
  repeated_ms_ = utc_ms;
  return {};
}

}  // namespace plumbline::plant
