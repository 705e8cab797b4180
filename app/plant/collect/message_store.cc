#include "app/plant/collect/message_store.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "app/plant/collect/cell_summary.h"

namespace plumbline::plant {
namespace {

constexpr std::int64_t kMinute_ms = 60'000;
constexpr std::size_t kLetter_bytes = 4096;
constexpr int kMostStreams = 100;  ///< of a cell: queues that were created anew

std::int64_t MonthOf(std::int64_t utc_ms) {
  const std::chrono::sys_days day{std::chrono::days{utc_ms / kDay_ms}};
  const std::chrono::year_month_day date{day};
  return 12 * static_cast<int>(date.year()) + static_cast<int>(static_cast<unsigned>(date.month()));
}

/// bytea in hexadecimal.
std::string HexOf(std::string_view bytes) {
  std::string text = "\\x";
  for (const char c : bytes) {
    fmt::format_to(std::back_inserter(text), "{:02x}", static_cast<unsigned char>(c));
  }
  return text;
}

/// Whether a failure has nothing to do with the messages: connection, resources, the set-up of the
/// database, a conflict with another session.
bool IsOperational(const std::string& state) {
  static constexpr std::string_view kClasses[] = {"08", "25", "28", "40", "42", "53",
                                                  "55", "57", "58", "F0", "XX"};
  return state.size() < 2 || std::ranges::find(kClasses, state.substr(0, 2)) != std::end(kClasses);
}

std::string Shortened(std::string_view text) {
  constexpr std::size_t kMost = 300;
  if (text.size() <= kMost) return std::string(text);
  std::size_t end = kMost;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80)
    --end;  // whole characters
  return std::string(text.substr(0, end));
}

}  // namespace

MessageStore::MessageStore(Connection connection, Admission& admission, int retention_months)
    : connection_(std::move(connection)),
      admission_(&admission),
      retention_months_(retention_months) {}

Result<MessageStore> MessageStore::On(Connection connection, Admission& admission) {
  const auto months = connection.Run("SELECT retention_months FROM setting");
  if (!months) return months.failure();
  return MessageStore(std::move(connection), admission, static_cast<int>(months->Integer(0, 0)));
}

Result<int> MessageStore::CellOf(const TopicParts& topic) {
  std::string name(topic.line);
  name.append("/").append(topic.node);
  if (const auto known = cells_.find(name); known != cells_.end()) return known->second;
  const auto added = connection_.RunPrepared(
      "INSERT INTO cell (line, node) VALUES ($1, $2) ON CONFLICT DO NOTHING",
      {topic.line, topic.node});
  if (!added) return added.failure();
  const auto found = connection_.RunPrepared("SELECT cell FROM cell WHERE line = $1 AND node = $2",
                                             {topic.line, topic.node});
  if (!found) return found.failure();
  return cells_[name] = static_cast<int>(found->Integer(0, 0));
}

bool MessageStore::forbidden() const {
  return connection_.last_state() == "42501" || connection_.last_state() == "25006";
}

void MessageStore::Refuse(int cell, const char* why, double now_s) {
  ++refused_[{cell, static_cast<std::int64_t>(1e3 * now_s) / kMinute_ms, why}];
}

DecodedMessage MessageStore::DecodedFrom(const Received& received, double now_s) {
  DecodedMessage one{&received, 0, {}, {}};
  const auto topic = TopicPartsOf(received.topic);
  const auto cell = topic ? CellOf(*topic) : Result<int>(0);
  if (cell) one.cell = *cell;
  const auto key = KeyAtBeginningOf(received.payload);
  // A cell's file is large.
  const double cost = topic && topic->type == "NCELL" ? 100 : 1;
  const auto utc_ms = key ? std::optional(key->utc_ms) : std::nullopt;
  if (const char* const why = admission_->Refused(one.cell, utc_ms, now_s, cost)) {
    one.refused = true;
    if (one.cell != 0) Refuse(one.cell, why, now_s);
    return one;
  }
  if (!topic || !cell) {
    one.reason = "the topic is not plumblineV1/LINE/TYPE/NODE";
    return one;
  }
  auto message = DecodeMessage(topic->type, received.payload);
  if (!message) {
    one.reason = message.error();
    one.message.key = key;
    return one;
  }
  one.message = std::move(message).value();
  if (!one.message.key) return one;
  const auto now_ms = static_cast<std::int64_t>(1e3 * now_s);
  const std::int64_t oldest_ms =
      retention_months_ == 0 ? 0 : now_ms - retention_months_ * 31 * kDay_ms;
  if (one.message.key->utc_ms < oldest_ms || one.message.key->utc_ms > now_ms + kDay_ms) {
    one.reason = "its time is older than the retention, or in the future; check the cell's clock";
  }
  return one;
}

Result<void> MessageStore::Flush() {
  DatabaseTransaction transaction(connection_);
  if (!transaction.begun()) return transaction.begun().failure();
  // Only a commit that itself has written to the log waits for it, and with it for all before.
  const auto logged = connection_.Run(
      "SELECT set_config('synchronous_commit', 'on', true), "
      "pg_logical_emit_message(true, 'plumbline', '')");
  return logged ? transaction.Commit() : Result<void>(logged.failure());
}

Result<void> MessageStore::Write(std::span<const Received> messages, double now_s) {
  std::vector<DecodedMessage> decoded;
  decoded.reserve(messages.size());
  for (const Received& received : messages) {
    decoded.push_back(DecodedFrom(received, now_s));
    if (!connection_.alive()) return Error{"the connection was lost"};
  }
  std::vector<DecodedMessage*> pointers;
  pointers.reserve(decoded.size());
  for (DecodedMessage& one : decoded) {
    if (!one.refused) pointers.push_back(&one);
  }
  rejected_ = 0;
  if (Result<void> done = WriteDecoded(pointers, now_s); !done) return done;
  return refused_.empty() ? Result<void>() : WriteDecoded({}, now_s);
}

Result<void> MessageStore::WriteDecoded(std::span<DecodedMessage*> messages, double now_s) {
  Result<void> done = WriteOnce(messages, now_s);
  if (done || !connection_.alive() || IsOperational(connection_.last_state())) return done;
  if (messages.size() > 1) {
    // The messages of the other cells first: they are most probably sound.
    const auto cell_of = [](const DecodedMessage* one) { return one->cell; };
    std::ranges::stable_sort(messages, {}, cell_of);
    const int first_cell = messages.front()->cell;
    std::size_t part = 0;
    while (part < messages.size() && messages[part]->cell == first_cell) ++part;
    if (part == messages.size() || part > messages.size() / 2) part = messages.size() / 2;
    if (rejected_ >= kMostRejected && messages.back()->cell == first_cell) {
      for (DecodedMessage* one : messages)
        Refuse(one->cell, "messages that the database does not accept", now_s);
      return {};
    }
    if (Result<void> first = WriteDecoded(messages.first(part), now_s); !first) return first;
    return WriteDecoded(messages.subspan(part), now_s);
  }
  if (messages.empty()) return done;
  ++rejected_;
  DecodedMessage& only = *messages.front();
  const auto key = only.message.key;
  only.message = {};
  only.message.key = key;
  only.reason = "the database does not accept it: " + done.error();
  done = WriteOnce(messages, now_s);
  if (done || !connection_.alive() || IsOperational(connection_.last_state())) return done;
  only.received = nullptr;  // nor its letter
  only.message = {};
  only.reason = "the database accepts neither it nor its topic";
  return WriteOnce(messages, now_s);
}

Result<void> MessageStore::LockCells(const MessageBatch& batch) {
  std::set<int> numbers;
  for (const DecodedMessage* one : batch.messages) {
    if (one->cell != 0) numbers.insert(one->cell);
  }
  ArrayText cells;
  for (const int cell : numbers) cells.Add(cell);
  // In one order, so that two collectors do not wait for each other.
  const auto locked = connection_.RunPrepared(
      "SELECT FROM cell WHERE cell = ANY($1::int[]) ORDER BY cell FOR NO KEY UPDATE",
      {cells.Text()});
  return locked ? Result<void>() : Result<void>(locked.failure());
}

Result<std::map<StreamKey, StreamLedger>> MessageStore::ReadLedgers(const MessageBatch& batch) {
  std::map<StreamKey, std::int64_t> lowest;
  for (const DecodedMessage* one : batch.messages) {
    if (!one->message.key) continue;
    const MessageKey& key = *one->message.key;
    const auto [entry, added] = lowest.try_emplace({one->cell, key.stream}, key.seq);
    if (!added) entry->second = std::min(entry->second, key.seq);
  }
  std::map<StreamKey, StreamLedger> ledgers;
  if (lowest.empty()) return ledgers;
  ArrayText cells, streams, firsts;
  for (const auto& [key, first] : lowest) {
    cells.Add(key.first);
    streams.Add(key.second);
    firsts.Add(first);
  }
  // A cell's first stream counts from where it was first seen; a later one began with a new queue,
  // from 1.
  const auto added = connection_.RunPrepared(
      "INSERT INTO stream (cell, stream, first_seq, next_seq) SELECT c, s, CASE WHEN known > 0 "
      "THEN 1 "
      "ELSE f END, CASE WHEN known > 0 THEN 1 ELSE f END FROM (SELECT c, s, f, row_number() OVER "
      "(PARTITION BY c) AS place, (SELECT count(*) FROM stream o WHERE o.cell = c) AS known FROM "
      "unnest($1::int[], $2::bigint[], $3::bigint[]) AS n(c, s, f) WHERE NOT EXISTS (SELECT FROM "
      "stream o WHERE o.cell = c AND o.stream = s)) AS new WHERE known + place <= $4",
      {cells.Text(), streams.Text(), firsts.Text(), kMostStreams});
  if (!added) return added.failure();
  const auto rows = connection_.RunPrepared(
      "SELECT cell, stream, first_seq, next_seq FROM stream JOIN unnest($1::int[], $2::bigint[]) "
      "AS n(c, s) ON cell = c AND stream = s",
      {cells.Text(), streams.Text()});
  if (!rows) return rows.failure();
  const auto gaps = connection_.RunPrepared(
      "SELECT cell, stream, first_seq, last_seq FROM gap JOIN unnest($1::int[], $2::bigint[]) AS "
      "n(c, s) ON cell = c AND stream = s",
      {cells.Text(), streams.Text()});
  if (!gaps) return gaps.failure();
  std::map<StreamKey, StreamLedger::Gaps> missing;
  for (int i = 0; i < gaps->size(); ++i) {
    missing[{static_cast<int>(gaps->Integer(i, 0)), gaps->Integer(i, 1)}][gaps->Integer(i, 2)] =
        gaps->Integer(i, 3);
  }
  for (int i = 0; i < rows->size(); ++i) {
    const StreamKey key{static_cast<int>(rows->Integer(i, 0)), rows->Integer(i, 1)};
    ledgers.emplace(
        key, StreamLedger(rows->Integer(i, 2), rows->Integer(i, 3), std::move(missing[key])));
  }
  return ledgers;
}

Result<void> MessageStore::WriteOnce(std::span<DecodedMessage*> messages, double now_s) {
  DatabaseTransaction transaction(connection_);
  if (!transaction.begun()) return transaction.begun().failure();
  if (const auto set = connection_.Run("SET LOCAL synchronous_commit = off"); !set)
    return set.failure();
  MessageBatch batch;
  batch.messages = messages;
  if (Result<void> locked = LockCells(batch); !locked) return locked;
  auto ledgers = ReadLedgers(batch);
  if (!ledgers) return ledgers.failure();
  batch.before = std::move(ledgers).value();
  batch.after = batch.before;
  for (DecodedMessage* one : messages) {
    if (!one->message.key) continue;
    const auto ledger = batch.after.find({one->cell, one->message.key->stream});
    if (ledger == batch.after.end()) {
      one->refused = true;
      Refuse(one->cell, "more streams than a cell has", now_s);
      continue;
    }
    one->repeated = !ledger->second.Take(one->message.key->seq);
    if (!one->repeated) batch.fresh.push_back(one);
    batch.repeated += one->repeated;
  }
  if (Result<void> done = EnsureMonths(batch); !done) return done;
  if (Result<void> done = WriteRows(batch); !done) return done;
  if (Result<void> done = WriteLedgers(batch); !done) return done;
  if (Result<void> done = WriteCellDays(connection_, batch); !done) return done;
  if (Result<void> done = WriteDeadLetters(batch); !done) return done;
  if (Result<void> done = WriteCells(connection_, batch, now_s); !done) return done;
  if (Result<void> done = WriteRefused(); !done) return done;
  if (Result<void> done = transaction.Commit(); !done) return done;
  for (const auto& [what, count] : refused_) counts_.refused += count;
  refused_.clear();
  months_.merge(batch.months);
  counts_.dead_letters += batch.letters;
  counts_.repeated += batch.repeated;
  counts_.stored += std::ranges::count_if(
      batch.fresh, [](const DecodedMessage* one) { return one->reason.empty(); });
  return {};
}

Result<void> MessageStore::EnsureMonths(MessageBatch& batch) {
  for (const DecodedMessage* one : batch.fresh) {
    if (!one->message.table || !one->reason.empty()) continue;
    const std::int64_t month = MonthOf(one->message.key->utc_ms);
    if (months_.contains(month) || batch.months.contains(month)) continue;
    const auto made =
        connection_.RunPrepared("SELECT ensure_month($1)", {UtcText(one->message.key->utc_ms)});
    if (!made) return made.failure();
    batch.months.insert(month);
  }
  return {};
}

Result<void> MessageStore::WriteRows(const MessageBatch& batch) {
  std::array<CopyRows, kMessageTables> rows;
  for (const DecodedMessage* one : batch.fresh) {
    if (!one->message.table || !one->reason.empty()) continue;
    const MessageKey& key = *one->message.key;
    CopyRow begin;
    begin.Integer(one->cell).Big(key.stream).Big(key.seq).Utc(key.utc_ms);
    rows[static_cast<std::size_t>(*one->message.table)].Add(begin, one->message.row);
  }
  for (std::size_t i = 0; i < kMessageTables; ++i) {
    if (rows[i].empty()) continue;
    const std::string& statement = CopyStatementOf(static_cast<MessageTable>(i));
    if (Result<void> done = connection_.Copy(statement.c_str(), rows[i].Finish()); !done)
      return done;
  }
  return {};
}

Result<void> MessageStore::WriteLedgers(const MessageBatch& batch) {
  ArrayText cells, streams, firsts, nexts, given_up;
  ArrayText gone_cells, gone_streams, gone_firsts;
  ArrayText new_cells, new_streams, new_firsts, new_lasts;
  for (const auto& [key, ledger] : batch.after) {
    const StreamLedger& before = batch.before.at(key);
    cells.Add(key.first);
    streams.Add(key.second);
    firsts.Add(ledger.first());
    nexts.Add(ledger.next());
    given_up.Add(ledger.given_up());
    for (const auto& [first, last] : before.gaps()) {
      const auto kept = ledger.gaps().find(first);
      if (kept != ledger.gaps().end() && kept->second == last) continue;
      gone_cells.Add(key.first);
      gone_streams.Add(key.second);
      gone_firsts.Add(first);
    }
    for (const auto& [first, last] : ledger.gaps()) {
      const auto known = before.gaps().find(first);
      if (known != before.gaps().end() && known->second == last) continue;
      new_cells.Add(key.first);
      new_streams.Add(key.second);
      new_firsts.Add(first);
      new_lasts.Add(last);
    }
  }
  if (cells.size() == 0) return {};
  const auto updated = connection_.RunPrepared(
      "UPDATE stream SET first_seq = f, next_seq = n, given_up = least(given_up + g, 1e15) FROM "
      "unnest($1::int[], $2::bigint[], $3::bigint[], $4::bigint[], $5::bigint[]) AS u(c, s, f, n, "
      "g) "
      "WHERE cell = c AND stream = s",
      {cells.Text(), streams.Text(), firsts.Text(), nexts.Text(), given_up.Text()});
  if (!updated) return updated.failure();
  if (gone_cells.size() > 0) {
    const auto done = connection_.RunPrepared(
        "DELETE FROM gap USING unnest($1::int[], $2::bigint[], $3::bigint[]) AS g(c, s, f) WHERE "
        "cell = c AND stream = s AND first_seq = f",
        {gone_cells.Text(), gone_streams.Text(), gone_firsts.Text()});
    if (!done) return done.failure();
  }
  if (new_cells.size() > 0) {
    const auto done = connection_.RunPrepared(
        "INSERT INTO gap (cell, stream, first_seq, last_seq) SELECT * FROM unnest($1::int[], "
        "$2::bigint[], $3::bigint[], $4::bigint[])",
        {new_cells.Text(), new_streams.Text(), new_firsts.Text(), new_lasts.Text()});
    if (!done) return done.failure();
  }
  return {};
}

Result<void> MessageStore::WriteDeadLetters(MessageBatch& batch) {
  struct Letter {
    std::int64_t messages = 0;
    const Received* example = nullptr;
  };
  std::map<std::pair<std::string, std::string>, Letter> letters;  ///< by topic and reason
  for (const DecodedMessage* one : batch.messages) {
    if (one->reason.empty() || one->repeated || one->refused) continue;  // its letter is there
    Letter& letter = letters[{one->received == nullptr ? "" : Shortened(one->received->topic),
                              Shortened(one->reason)}];
    letter.example = one->received;
    ++letter.messages;
    ++batch.letters;
  }
  for (const auto& [what, letter] : letters) {
    const std::string_view payload =
        letter.example == nullptr ? std::string_view() : std::string_view(letter.example->payload);
    const auto done = connection_.RunPrepared(
        "INSERT INTO dead_letter AS d (topic, reason, messages, bytes, payload) VALUES ($1, $2, "
        "$3, "
        "$4, $5) ON CONFLICT (hour, topic, reason) DO UPDATE SET messages = d.messages + "
        "excluded.messages",
        {what.first, what.second, letter.messages, static_cast<std::int64_t>(payload.size()),
         HexOf(payload.substr(0, kLetter_bytes))});
    if (!done) return done.failure();
  }
  return {};
}

Result<void> MessageStore::WriteRefused() {
  for (const auto& [what, count] : refused_) {
    const auto& [cell, minute, reason] = what;
    const auto added = connection_.RunPrepared(
        "INSERT INTO refused AS r (cell, minute, reason, messages) VALUES ($1, $2, $3, $4) ON "
        "CONFLICT (cell, minute, reason) DO UPDATE SET messages = r.messages + excluded.messages",
        {cell, UtcText(minute * kMinute_ms), reason, count});
    if (!added) return added.failure();
    const auto noted = connection_.RunPrepared(
        "UPDATE cell SET limited = limited + $2, limited_reason = $3, limited_last = now() WHERE "
        "cell = $1",
        {cell, count, reason});
    if (!noted) return noted.failure();
  }
  return {};
}

Result<void> MessageStore::DropOld(double now_s) {
  const auto done = connection_.RunPrepared("SELECT drop_old()", {});
  if (!done) return done.failure();
  months_.clear();
  // Ahead of time, so that no batch waits for it at the turn of a month.
  constexpr double kMonth_s = 28 * 86400;
  const auto made =
      connection_.RunPrepared("SELECT ensure_month($1), ensure_month($2)",
                              {UtcText(static_cast<std::int64_t>(1e3 * now_s)),
                               UtcText(static_cast<std::int64_t>(1e3 * (now_s + kMonth_s)))});
  return made ? Result<void>() : Result<void>(made.failure());
}

}  // namespace plumbline::plant
