#include "app/plant/collect/message_store.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

namespace plumbline::plant {
namespace {

using StreamKey = std::pair<int, std::int64_t>;  ///< cell and stream

constexpr std::int64_t kDay_ms = 86'400'000, kMinute_ms = 60'000;
constexpr std::size_t kLetter_bytes = 4096;

/// `2026-11-30 09:41:42.123+00`. The date of consecutive messages is mostly the same.
std::string UtcText(std::int64_t utc_ms) {
  thread_local std::int64_t known_day = -1;
  thread_local std::string date;
  const std::int64_t day = utc_ms / kDay_ms, rest_ms = utc_ms % kDay_ms;
  if (day != known_day) {
    date = fmt::format("{:%Y-%m-%d}", fmt::gmtime(static_cast<std::time_t>(day * kDay_ms / 1000)));
    known_day = day;
  }
  return fmt::format("{} {:02}:{:02}:{:02}.{:03}+00", date, rest_ms / 3'600'000,
                     rest_ms / 60'000 % 60, rest_ms / 1000 % 60, rest_ms % 1000);
}

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

/// Whether a message itself is the reason for a failure: data exceptions and violated constraints.
bool IsDataFault(const std::string& state) {
  return state.starts_with("22") || state.starts_with("23");
}

struct DaySums {
  std::int64_t probes = 0, wild = 0, quarantined = 0, alarms = 0, states = 0;
  double sum = 0, sum_squares = 0, max = 0, dx = 0, dy = 0, dz = 0;
  int worst_health = 0;
};

/// What a batch changes in the row of a cell.
struct CellChange {
  const NewestState* state = nullptr;
  std::int64_t state_ms = 0;
  int model = -1;
  std::int64_t model_ms = 0;
  const Birth* birth = nullptr;
  const Death* death = nullptr;
  std::vector<const PlantMessage*> files;
};

}  // namespace

/// Messages of a batch, sorted by what they change.
struct MessageStore::Batch {
  std::span<Decoded*> messages;
  std::vector<const Decoded*> fresh;  ///< with a key, that had not arrived before
  std::map<StreamKey, StreamLedger> before, after;
  std::set<std::int64_t> months;  ///< whose partitions this transaction creates
  std::int64_t repeated = 0, letters = 0;
};

MessageStore::MessageStore(Connection connection, const CollectSettings& settings)
    : connection_(std::move(connection)),
      settings_(settings),
      admission_(settings.messages_per_second, settings.messages_per_day) {}

Result<int> MessageStore::CellOf(const TopicParts& topic) {
  const std::string name = fmt::format("{}/{}", topic.line, topic.node);
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

Result<void> MessageStore::Write(std::span<const Received> messages, double now_s) {
  std::vector<Decoded> decoded;
  decoded.reserve(messages.size());
  const auto now_ms = static_cast<std::int64_t>(1e3 * now_s);
  const std::int64_t oldest_ms =
      settings_.retention_months == 0 ? 0 : now_ms - settings_.retention_months * 31 * kDay_ms;
  for (const Received& received : messages) {
    Decoded one{&received, 0, {}, {}};
    const auto topic = TopicPartsOf(received.topic);
    if (!topic) {
      one.reason = "the topic is not plumblineV1/LINE/TYPE/NODE";
      decoded.push_back(std::move(one));
      continue;
    }
    const auto cell = CellOf(*topic);
    if (!cell && IsDataFault(connection_.last_state())) {
      one.reason = "the topic: " + cell.error();
      decoded.push_back(std::move(one));
      continue;
    }
    if (!cell) return cell.failure();
    one.cell = *cell;
    const auto key = KeyAtBeginningOf(received.payload);
    if (const char* const why = admission_.Refused(*cell, key ? key->utc_ms : now_ms, now_s)) {
      ++refused_[{*cell, now_ms / kMinute_ms, why}];
      if (!key) continue;
      one.message.key = key;  // it has arrived: its number is not missing
      decoded.push_back(std::move(one));
      continue;
    }
    auto message = DecodeMessage(topic->type, received.payload);
    if (message) {
      one.message = std::move(message).value();
    } else {
      one.reason = message.error();
      one.message.key = key;
    }
    if (one.message.key && one.reason.empty() &&
        (one.message.key->utc_ms < oldest_ms || one.message.key->utc_ms > now_ms + kDay_ms)) {
      one.reason = fmt::format(
          "its time {} is older than the retention or in the future; check the "
          "cell's clock",
          UtcText(one.message.key->utc_ms));
    }
    decoded.push_back(std::move(one));
  }
  std::vector<Decoded*> pointers;
  pointers.reserve(decoded.size());
  for (Decoded& one : decoded) pointers.push_back(&one);
  return WriteDecoded(pointers, now_s);
}

Result<void> MessageStore::WriteDecoded(std::span<Decoded*> messages, double now_s) {
  if (messages.empty()) return {};
  Result<void> done = WriteOnce(messages, now_s);
  if (done || !connection_.alive() || !IsDataFault(connection_.last_state())) return done;
  if (messages.size() > 1) {
    const std::size_t half = messages.size() / 2;
    if (Result<void> first = WriteDecoded(messages.first(half), now_s); !first) return first;
    return WriteDecoded(messages.subspan(half), now_s);
  }
  Decoded& only = *messages.front();
  const auto key = only.message.key;
  only.message = {};
  only.message.key = key;
  only.reason = "the database does not accept it: " + done.error();
  done = WriteOnce(messages, now_s);
  if (done || !connection_.alive() || !IsDataFault(connection_.last_state())) return done;
  only.received = nullptr;  // nor its letter
  only.reason = "the database accepts neither it nor its topic";
  return WriteOnce(messages, now_s);
}

Result<void> MessageStore::LockCells(const Batch& batch) {
  std::set<int> numbers;
  for (const Decoded* one : batch.messages) {
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

Result<std::map<StreamKey, StreamLedger>> MessageStore::ReadLedgers(const Batch& batch) {
  std::map<StreamKey, std::int64_t> lowest;
  for (const Decoded* one : batch.messages) {
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
      "INSERT INTO stream (cell, stream, first_seq, next_seq) "
      "SELECT c, s, f, f FROM (SELECT n.c, n.s, CASE WHEN EXISTS (SELECT FROM stream o WHERE "
      "o.cell "
      "= n.c AND o.stream <> n.s) THEN 1 ELSE n.f END AS f FROM unnest($1::int[], $2::bigint[], "
      "$3::bigint[]) AS n(c, s, f)) AS given ON CONFLICT DO NOTHING",
      {cells.Text(), streams.Text(), firsts.Text()});
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

Result<void> MessageStore::WriteOnce(std::span<Decoded*> messages, double now_s) {
  DatabaseTransaction transaction(connection_);
  if (!transaction.begun()) return transaction.begun().failure();
  Batch batch;
  batch.messages = messages;
  if (Result<void> locked = LockCells(batch); !locked) return locked;
  auto ledgers = ReadLedgers(batch);
  if (!ledgers) return ledgers.failure();
  batch.before = std::move(ledgers).value();
  batch.after = batch.before;
  for (Decoded* one : messages) {
    if (!one->message.key) continue;
    const StreamKey key{one->cell, one->message.key->stream};
    one->repeated = !batch.after.at(key).Take(one->message.key->seq);
    if (!one->repeated) batch.fresh.push_back(one);
    batch.repeated += one->repeated;
  }
  if (Result<void> done = EnsureMonths(batch); !done) return done;
  for (const auto& step :
       {&MessageStore::CopyRows, &MessageStore::WriteLedgers, &MessageStore::WriteSums}) {
    if (Result<void> done = (this->*step)(batch); !done) return done;
  }
  if (Result<void> done = WriteDeadLetters(batch); !done) return done;
  if (Result<void> done = WriteCells(batch, now_s); !done) return done;
  if (Result<void> done = WriteRefused(); !done) return done;
  if (Result<void> done = transaction.Commit(); !done) return done;
  for (const auto& [what, count] : refused_) counts_.refused += count;
  refused_.clear();
  months_.merge(batch.months);
  counts_.dead_letters += batch.letters;
  counts_.repeated += batch.repeated;
  counts_.stored += static_cast<std::int64_t>(batch.fresh.size());
  return {};
}

Result<void> MessageStore::EnsureMonths(Batch& batch) {
  for (const Decoded* one : batch.fresh) {
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

Result<void> MessageStore::CopyRows(const Batch& batch) {
  std::array<std::string, kMessageTables> lines;
  for (const Decoded* one : batch.fresh) {
    if (!one->message.table || !one->reason.empty()) continue;
    const MessageKey& key = *one->message.key;
    std::string& text = lines[static_cast<std::size_t>(*one->message.table)];
    fmt::format_to(std::back_inserter(text), "{}\t{}\t{}\t", one->cell, key.stream, key.seq);
    text += UtcText(key.utc_ms);
    text += '\t';
    text += one->message.row;
    text += '\n';
  }
  for (std::size_t i = 0; i < kMessageTables; ++i) {
    if (lines[i].empty()) continue;
    const std::string& statement = CopyStatementOf(static_cast<MessageTable>(i));
    if (Result<void> done = connection_.Copy(statement.c_str(), lines[i]); !done) return done;
  }
  return {};
}

Result<void> MessageStore::WriteLedgers(const Batch& batch) {
  ArrayText cells, streams, firsts, nexts, repeated;
  ArrayText gone_cells, gone_streams, gone_firsts;
  ArrayText new_cells, new_streams, new_firsts, new_lasts;
  for (const auto& [key, ledger] : batch.after) {
    const StreamLedger& before = batch.before.at(key);
    cells.Add(key.first);
    streams.Add(key.second);
    firsts.Add(ledger.first());
    nexts.Add(ledger.next());
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
      "UPDATE stream SET first_seq = f, next_seq = n FROM unnest($1::int[], $2::bigint[], "
      "$3::bigint[], $4::bigint[]) AS u(c, s, f, n) WHERE cell = c AND stream = s",
      {cells.Text(), streams.Text(), firsts.Text(), nexts.Text()});
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

Result<void> MessageStore::WriteSums(const Batch& batch) {
  std::map<std::tuple<int, std::int64_t, int>, DaySums> days;
  for (const Decoded* one : batch.fresh) {
    const PlantMessage& message = one->message;
    if (!one->reason.empty()) continue;
    if (!message.probe && !message.alarm_begins && !message.state) continue;
    DaySums& day = days[{one->cell, message.key->utc_ms / kDay_ms, message.model}];
    day.alarms += message.alarm_begins;
    if (message.state) {
      ++day.states;
      day.worst_health = std::max(day.worst_health, message.state->health);
    }
    if (!message.probe) continue;
    const ProbeSums& probe = *message.probe;
    day.wild += probe.wild;
    day.quarantined += probe.quarantined;
    if (probe.wild || probe.quarantined || !probe.compared) continue;
    ++day.probes;
    day.sum += probe.size_mm;
    day.sum_squares += probe.size_mm * probe.size_mm;
    day.max = std::max(day.max, probe.size_mm);
    day.dx += probe.dx_mm;
    day.dy += probe.dy_mm;
    day.dz += probe.dz_mm;
  }
  if (days.empty()) return {};
  std::array<ArrayText, 15> columns;
  for (const auto& [key, day] : days) {
    const auto& [cell, number, model] = key;
    const Parameter values[] = {cell,
                                UtcText(number * kDay_ms).substr(0, 10),
                                model,
                                day.probes,
                                day.wild,
                                day.quarantined,
                                day.sum,
                                day.sum_squares,
                                day.max,
                                day.dx,
                                day.dy,
                                day.dz,
                                day.alarms,
                                day.states,
                                day.worst_health};
    for (std::size_t i = 0; i < columns.size(); ++i) columns[i].Add(values[i]);
  }
  const auto done = connection_.RunPrepared(
      "INSERT INTO cell_day AS d (cell, day, model, probes, wild, quarantined, sum_mm, sum_mm2, "
      "max_mm, sum_dx_mm, sum_dy_mm, sum_dz_mm, alarms, states, worst_health) SELECT * FROM "
      "unnest($1::int[], $2::date[], $3::int[], $4::bigint[], $5::bigint[], $6::bigint[], "
      "$7::float8[], $8::float8[], $9::real[], $10::float8[], $11::float8[], $12::float8[], "
      "$13::bigint[], $14::bigint[], $15::smallint[]) ON CONFLICT (cell, day, model) DO UPDATE SET "
      "probes = d.probes + excluded.probes, wild = d.wild + excluded.wild, quarantined = "
      "d.quarantined + excluded.quarantined, sum_mm = d.sum_mm + excluded.sum_mm, sum_mm2 = "
      "d.sum_mm2 + excluded.sum_mm2, max_mm = greatest(d.max_mm, excluded.max_mm), sum_dx_mm = "
      "d.sum_dx_mm + excluded.sum_dx_mm, sum_dy_mm = d.sum_dy_mm + excluded.sum_dy_mm, sum_dz_mm = "
      "d.sum_dz_mm + excluded.sum_dz_mm, alarms = d.alarms + excluded.alarms, states = d.states + "
      "excluded.states, worst_health = greatest(d.worst_health, excluded.worst_health)",
      {columns[0].Text(), columns[1].Text(), columns[2].Text(), columns[3].Text(),
       columns[4].Text(), columns[5].Text(), columns[6].Text(), columns[7].Text(),
       columns[8].Text(), columns[9].Text(), columns[10].Text(), columns[11].Text(),
       columns[12].Text(), columns[13].Text(), columns[14].Text()});
  return done ? Result<void>() : Result<void>(done.failure());
}

Result<void> MessageStore::WriteCells(const Batch& batch, double now_s) {
  std::map<int, CellChange> changes;
  const std::string now = UtcText(static_cast<std::int64_t>(1e3 * now_s));
  for (const Decoded* one : batch.messages) {
    const PlantMessage& message = one->message;
    if (one->cell == 0) continue;
    CellChange& change = changes[one->cell];
    if (!one->reason.empty()) continue;
    if (message.birth && (change.birth == nullptr || change.birth->bdSeq < message.birth->bdSeq)) {
      change.birth = &*message.birth;
    }
    if (message.death && (change.death == nullptr || change.death->bdSeq < message.death->bdSeq)) {
      change.death = &*message.death;
    }
  }
  for (const Decoded* one : batch.fresh) {
    const PlantMessage& message = one->message;
    if (!one->reason.empty()) continue;
    CellChange& change = changes[one->cell];
    if (message.state && message.key->utc_ms >= change.state_ms) {
      change.state = &*message.state;
      change.state_ms = message.key->utc_ms;
      change.model = message.model;
    }
    if (message.cell) change.files.push_back(&message);
  }
  ArrayText cells, states, state_times, healths, models;
  for (const auto& [cell, change] : changes) {
    cells.Add(cell);
    states.Add(change.state != nullptr ? Parameter(change.state->json) : Parameter(std::nullopt));
    state_times.Add(change.state != nullptr ? Parameter(UtcText(change.state_ms))
                                            : Parameter(std::nullopt));
    healths.Add(change.state != nullptr ? Parameter(change.state->health)
                                        : Parameter(std::nullopt));
    models.Add(change.state != nullptr ? Parameter(change.model) : Parameter(std::nullopt));
  }
  if (changes.empty()) return {};
  const auto updated = connection_.RunPrepared(
      "UPDATE cell SET last_received = greatest(last_received, $1::timestamptz), "
      "state = CASE WHEN newer THEN s ELSE state END, "
      "health = CASE WHEN newer THEN h ELSE health END, "
      "model = CASE WHEN newer THEN m ELSE model END, "
      "state_utc = CASE WHEN newer THEN t ELSE state_utc END FROM (SELECT u.*, t IS NOT NULL AND "
      "(k.state_utc IS NULL OR t >= k.state_utc) AS newer FROM unnest($2::int[], $3::jsonb[], "
      "$4::timestamptz[], $5::smallint[], $6::int[]) AS u(c, s, t, h, m) JOIN cell k ON k.cell = "
      "c) AS v WHERE cell.cell = c",
      {now, cells.Text(), states.Text(), state_times.Text(), healths.Text(), models.Text()});
  if (!updated) return updated.failure();
  for (const auto& [cell, change] : changes) {
    if (change.birth != nullptr) {
      const auto done = connection_.RunPrepared(
          "UPDATE cell SET birth = $2, waiting = $3, version = $4, name = $5 WHERE cell = $1 AND "
          "(birth IS NULL OR birth <= $2)",
          {cell, change.birth->bdSeq, change.birth->waiting, change.birth->version,
           change.birth->name});
      if (!done) return done.failure();
    }
    if (change.death != nullptr) {
      const auto done = connection_.RunPrepared(
          "UPDATE cell SET death = $2, clean_shutdown = $3 WHERE cell = $1 AND (death IS NULL OR "
          "death <= $2)",
          {cell, change.death->bdSeq, change.death->clean_shutdown});
      if (!done) return done.failure();
    }
    for (const PlantMessage* message : change.files) {
      const CellFile& file = *message->cell;
      const std::string utc = UtcText(message->key->utc_ms);
      const auto stored = connection_.RunPrepared(
          "INSERT INTO cell_file (cell, utc, fingerprint, model, toml) VALUES ($1, $2, $3, $4, $5) "
          "ON CONFLICT DO NOTHING",
          {cell, utc, file.fingerprint, message->model, file.toml});
      if (!stored) return stored.failure();
      const auto done = connection_.RunPrepared(
          "UPDATE cell SET arm_model = nullif($2, ''), arm_series = nullif($3, ''), installed = "
          "nullif($4, '')::date, page = nullif($5, '') WHERE cell = $1 AND NOT EXISTS (SELECT FROM "
          "cell_file f WHERE f.cell = $1 AND f.utc > $6::timestamptz)",
          {cell, file.arm_model, file.arm_series, file.installed, file.page, utc});
      if (!done) return done.failure();
    }
  }
  for (const Decoded* one : batch.messages) {
    if (!one->message.dropped || !one->reason.empty()) continue;
    const auto done = connection_.RunPrepared(
        "UPDATE stream SET dropped = greatest(dropped, $3) WHERE cell = $1 AND stream = $2",
        {one->cell, one->message.dropped->stream, one->message.dropped->messages});
    if (!done) return done.failure();
  }
  for (const Decoded* one : batch.fresh) {
    if (!one->message.lens || !one->reason.empty()) continue;
    const NewestLens& lens = *one->message.lens;
    const auto done = connection_.RunPrepared(
        "INSERT INTO camera_now AS n (cell, camera, utc, lens, reason) VALUES ($1, $2, $3, $4, $5) "
        "ON CONFLICT (cell, camera) DO UPDATE SET utc = excluded.utc, lens = excluded.lens, reason "
        "= excluded.reason WHERE n.utc <= excluded.utc",
        {one->cell, lens.camera, UtcText(one->message.key->utc_ms), lens.lens, lens.reason});
    if (!done) return done.failure();
  }
  return {};
}

Result<void> MessageStore::WriteDeadLetters(Batch& batch) {
  for (const Decoded* one : batch.messages) {
    if (one->reason.empty() || one->repeated) continue;  // its letter is there
    const std::string_view payload = one->received == nullptr ? "" : one->received->payload;
    const std::string topic = one->received == nullptr ? "" : one->received->topic;
    const auto done = connection_.RunPrepared(
        "INSERT INTO dead_letter (topic, reason, bytes, payload) VALUES ($1, $2, $3, $4)",
        {topic, one->reason, static_cast<std::int64_t>(payload.size()),
         HexOf(payload.substr(0, kLetter_bytes))});
    if (!done) return done.failure();
    ++batch.letters;
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

Result<void> MessageStore::DropOld() {
  if (settings_.retention_months == 0) return {};
  const auto done =
      connection_.RunPrepared("SELECT drop_months_before(now() - make_interval(months => $1))",
                              {settings_.retention_months});
  if (!done) return done.failure();
  months_.clear();
  return {};
}

}  // namespace plumbline::plant
