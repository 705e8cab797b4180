#include "app/plant/publish/queue.h"

#include <numeric>

#include "app/base/sqlite/database.h"

namespace plumbline::plant {
namespace {

constexpr sqlite::StoreIdentity kQueueIdentity{0x504C4651, 1,
                                               "a queue of plumbline-fleet"};  // "PLFQ"
/// Messages dropped at a time when the queue is full.
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

constexpr const char* kDropOldest =
    "DELETE FROM message WHERE seq IN (SELECT seq FROM message WHERE importance ="
    " (SELECT min(importance) FROM message) ORDER BY seq LIMIT ?)"
    " RETURNING importance, length(CAST(body AS BLOB))";

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
  if (*version == 0) {
    if (!database_.Run(kQueueTables) || !database_.Run(kQueueIdentity.Mark().c_str())) {
      return Failed("cannot be created");
    }
  }
  if (!transaction.Commit()) return Failed("cannot be written");
  return {};
}

Result<void> FleetQueue::LoadCounts() {
  sqlite::Statement stream(database_.get(),
                           "SELECT id, memory, dropped_0, dropped_1, dropped_2 FROM stream");
  if (stream.Step() != SQLITE_ROW) return Failed("cannot be read");
  stream_ = stream.Text(0);
  memory_ = stream.Text(1);
  for (int k = 0; k < kImportances; ++k) {
    counts_.dropped[static_cast<std::size_t>(k)] = stream.Integer(2 + k);
  }
  const auto messages = database_.IntegerOf("SELECT count(*) FROM message");
  const auto bytes =
      database_.IntegerOf("SELECT coalesce(sum(length(CAST(body AS BLOB))), 0) FROM message");
  if (!messages) return messages.failure();
  if (!bytes) return bytes.failure();
  counts_.messages = *messages;
  counts_.bytes = *bytes + kRowBytes * *messages;
  return {};
}

bool FleetQueue::DropOldest(Counts& counts) {
  while (counts.bytes > bound_bytes_ && counts.messages > 0) {
    sqlite::Statement drop(database_.get(), kDropOldest);
    drop.Bind(1, std::int64_t{kDropBatch});
    int code = SQLITE_ROW;
    while ((code = drop.Step()) == SQLITE_ROW) {
      ++counts.dropped[static_cast<std::size_t>(drop.Integer(0))];
      --counts.messages;
      counts.bytes -= kRowBytes + drop.Integer(1);
    }
    if (code != SQLITE_DONE) return false;
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

Result<std::vector<QueuedMessage>> FleetQueue::Next(std::int64_t after_seq, std::size_t most) {
  std::vector<QueuedMessage> next;
  if (counts_.messages == 0 || most == 0) return next;
  sqlite::Statement rows(
      database_.get(),
      "SELECT seq, kind, utc_ms, body FROM message WHERE seq > ? ORDER BY seq LIMIT ?");
  rows.Bind(1, after_seq);
  rows.Bind(2, static_cast<std::int64_t>(most));
  int code = SQLITE_ROW;
  while ((code = rows.Step()) == SQLITE_ROW) {
    next.push_back({rows.Integer(0),
                    {static_cast<MessageKind>(rows.Integer(1)), rows.Integer(2), rows.Text(3)}});
  }
  if (code != SQLITE_DONE) return Failed("cannot be read");
  return next;
}

Result<void> FleetQueue::Remove(std::span<const std::int64_t> seqs) {
  if (seqs.empty()) return {};
  Counts counts = counts_;
  sqlite::Transaction transaction(database_);
  if (!transaction.begun()) return Failed("cannot be written");
  for (const std::int64_t seq : seqs) {
    sqlite::Statement remove(
        database_.get(), "DELETE FROM message WHERE seq = ? RETURNING length(CAST(body AS BLOB))");
    remove.Bind(1, seq);
    int code = SQLITE_ROW;
    while ((code = remove.Step()) == SQLITE_ROW) {
      --counts.messages;
      counts.bytes -= kRowBytes + remove.Integer(0);
    }
    if (code != SQLITE_DONE) return Failed("cannot be written");
  }
  if (!transaction.Commit()) return Failed("cannot be written");
  counts_ = counts;
  return {};
}

}  // namespace plumbline::plant
