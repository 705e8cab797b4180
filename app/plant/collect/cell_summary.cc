#include "app/plant/collect/cell_summary.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <tuple>

namespace plumbline::plant {
namespace {

constexpr int kMostCameras = 16;

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
  std::pair<std::int64_t, std::int64_t> order;  ///< of `state`: stream and seq
  const Birth* birth = nullptr;
  const Death* death = nullptr;
  std::vector<const PlantMessage*> files;
};
using CellChanges = std::map<int, CellChange>;  ///< by cell

CellChanges ChangesOf(const MessageBatch& batch) {
  CellChanges changes;
  for (const DecodedMessage* one : batch.messages) {
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
  for (const DecodedMessage* one : batch.fresh) {
    const PlantMessage& message = one->message;
    if (!one->reason.empty()) continue;
    CellChange& change = changes[one->cell];
    // The cell's own count says which is newer: its clock may have been wrong, and been set.
    const std::pair order{message.key->stream, message.key->seq};
    if (message.state && (change.state == nullptr || order.first != change.order.first ||
                          order.second > change.order.second)) {
      change.state = &*message.state;
      change.state_ms = message.key->utc_ms;
      change.order = order;
      change.model = message.model;
    }
    if (message.cell) change.files.push_back(&message);
  }
  return changes;
}

Result<void> WriteStates(Connection& connection, const CellChanges& changes, double now_s) {
  ArrayText cells, states, state_times, healths, models, streams, seqs;
  for (const auto& [cell, change] : changes) {
    cells.Add(cell);
    states.Add(change.state != nullptr ? Parameter(change.state->json) : Parameter(std::nullopt));
    state_times.Add(change.state != nullptr ? Parameter(UtcText(change.state_ms))
                                            : Parameter(std::nullopt));
    healths.Add(change.state != nullptr ? Parameter(change.state->health)
                                        : Parameter(std::nullopt));
    models.Add(change.state != nullptr ? Parameter(change.model) : Parameter(std::nullopt));
    streams.Add(change.order.first);
    seqs.Add(change.order.second);
  }
  const auto updated = connection.RunPrepared(
      "UPDATE cell SET last_received = greatest(last_received, $1::timestamptz), "
      "state = CASE WHEN newer THEN s ELSE state END, "
      "health = CASE WHEN newer THEN h ELSE health END, "
      "model = CASE WHEN newer THEN m ELSE model END, "
      "state_utc = CASE WHEN newer THEN t ELSE state_utc END, "
      "state_stream = CASE WHEN newer THEN k ELSE state_stream END, "
      "state_seq = CASE WHEN newer THEN q ELSE state_seq END FROM (SELECT u.*, t IS NOT NULL AND "
      "(o.state_stream IS DISTINCT FROM k OR q > o.state_seq) AS newer FROM unnest($2::int[], "
      "$3::jsonb[], $4::timestamptz[], $5::smallint[], $6::int[], $7::bigint[], $8::bigint[]) AS "
      "u(c, s, t, h, m, k, q) JOIN cell o ON o.cell = c) AS v WHERE cell.cell = c",
      {UtcText(static_cast<std::int64_t>(1e3 * now_s)), cells.Text(), states.Text(),
       state_times.Text(), healths.Text(), models.Text(), streams.Text(), seqs.Text()});
  return updated ? Result<void>() : Result<void>(updated.failure());
}

Result<void> WriteConnection(Connection& connection, int cell, const CellChange& change) {
  if (change.birth != nullptr) {
    const auto done = connection.RunPrepared(
        "UPDATE cell SET birth = $2, waiting = $3, version = $4, name = $5 WHERE cell = $1 AND "
        "(birth IS NULL OR birth <= $2)",
        {cell, change.birth->bdSeq, change.birth->waiting, change.birth->version,
         change.birth->name});
    if (!done) return done.failure();
  }
  if (change.death != nullptr) {
    const auto done = connection.RunPrepared(
        "UPDATE cell SET death = $2, clean_shutdown = $3 WHERE cell = $1 AND (death IS NULL OR "
        "death <= $2)",
        {cell, change.death->bdSeq, change.death->clean_shutdown});
    if (!done) return done.failure();
  }
  return {};
}

Result<void> WriteFiles(Connection& connection, int cell, const CellChange& change) {
  for (const PlantMessage* message : change.files) {
    const CellFile& file = *message->cell;
    const std::string utc = UtcText(message->key->utc_ms);
    const auto stored = connection.RunPrepared(
        "INSERT INTO cell_file (cell, utc, fingerprint, model, toml) VALUES ($1, $2, $3, $4, $5) "
        "ON CONFLICT DO NOTHING",
        {cell, utc, file.fingerprint, message->model, file.toml});
    if (!stored) return stored.failure();
    const auto done = connection.RunPrepared(
        "UPDATE cell SET arm_model = nullif($2, ''), arm_series = nullif($3, ''), installed = "
        "nullif($4, '')::date, page = nullif($5, '') WHERE cell = $1 AND NOT EXISTS (SELECT FROM "
        "cell_file f WHERE f.cell = $1 AND f.utc > $6::timestamptz)",
        {cell, file.arm_model, file.arm_series, file.installed, file.page, utc});
    if (!done) return done.failure();
  }
  return {};
}

Result<void> WriteDropped(Connection& connection, const MessageBatch& batch) {
  for (const DecodedMessage* one : batch.messages) {
    if (!one->message.dropped || !one->reason.empty()) continue;
    const auto done = connection.RunPrepared(
        "UPDATE stream SET dropped = greatest(dropped, $3) WHERE cell = $1 AND stream = $2",
        {one->cell, one->message.dropped->stream, one->message.dropped->messages});
    if (!done) return done.failure();
  }
  return {};
}

Result<void> WriteLenses(Connection& connection, const MessageBatch& batch) {
  for (const DecodedMessage* one : batch.fresh) {
    if (!one->message.lens || !one->reason.empty()) continue;
    const NewestLens& lens = *one->message.lens;
    const auto done = connection.RunPrepared(
        "INSERT INTO camera_now AS n (cell, camera, utc, lens, reason) SELECT $1::int, $2::text, "
        "$3::timestamptz, $4::text, $5::text WHERE (SELECT count(*) FROM camera_now k WHERE "
        "k.cell = $1::int AND k.camera <> $2::text) < $6 ON CONFLICT (cell, camera) DO UPDATE SET "
        "utc = excluded.utc, lens = excluded.lens, reason = excluded.reason WHERE n.utc <= "
        "excluded.utc",
        {one->cell, lens.camera, UtcText(one->message.key->utc_ms), lens.lens, lens.reason,
         kMostCameras});
    if (!done) return done.failure();
  }
  return {};
}

}  // namespace

std::string UtcText(std::int64_t utc_ms) {
  // The date of consecutive messages is mostly the same.
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

Result<void> WriteCellDays(Connection& connection, const MessageBatch& batch) {
  std::map<std::tuple<int, std::int64_t, int>, DaySums> days;
  for (const DecodedMessage* one : batch.fresh) {
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
    day.max = std::max(day.max, static_cast<double>(static_cast<float>(probe.size_mm)));  // a real
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
  const auto done = connection.RunPrepared(
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

Result<void> WriteCells(Connection& connection, const MessageBatch& batch, double now_s) {
  const CellChanges changes = ChangesOf(batch);
  if (changes.empty()) return {};
  if (Result<void> done = WriteStates(connection, changes, now_s); !done) return done;
  for (const auto& [cell, change] : changes) {
    if (Result<void> done = WriteConnection(connection, cell, change); !done) return done;
    if (Result<void> done = WriteFiles(connection, cell, change); !done) return done;
  }
  if (Result<void> done = WriteDropped(connection, batch); !done) return done;
  return WriteLenses(connection, batch);
}

}  // namespace plumbline::plant
