// Queries of `plumbline plant status`, `report` and the page with many probes stored, and bytes a
// probe beside a plain table of the same columns. The server makes the probes, in order of time, of
// 300 cells over a year: --probes N, up to 10^8 (about 30 GB in $TMPDIR).
#define CATCH_CONFIG_RUNNER
#include <algorithm>
#include <functional>

#include "app/plant/answers/plant_report.h"
#include "app/plant/answers/report_text.h"
#include "app/plant/answers/status_text.h"
#include "drivers/clock.h"
#include "tests/app/plant/answers/plant_rows.h"
#include "tests/app/plant/database/postgres_process.h"
#include "tests/bench/catch_bench.h"

using namespace plumbline;
using namespace plumbline::bench;
using namespace plumbline::test;

namespace {

constexpr int kCells = 300, kMonths = 12;
constexpr double kBytesOfProbe = 400;  ///< disk to have free, roughly
constexpr std::int64_t kPlainRows = 1'000'000;

double wanted_probes = 0;

void Run(plant::Connection& connection, const std::string& statement,
         std::initializer_list<plant::Parameter> parameters = {}) {
  const auto done = connection.Run(statement.c_str(), parameters);
  INFO(statement << ": " << (done ? "" : done.error()));
  REQUIRE(done.ok());
}

double NumberOf(plant::Connection& connection, const char* query) {
  const auto rows = connection.Run(query);
  INFO((rows ? "" : rows.error()));
  REQUIRE(rows.ok());
  return rows->Number(0, 0);
}

/// Month by month, as a collector writes: all cells interleaved.
void MakeProbes(plant::Connection& owner, std::int64_t probes) {
  const double begun_s = MonotonicSeconds();
  const std::int64_t rounds = probes / kCells / kMonths;
  for (int month = kMonths; month >= 1; --month) {
    Run(owner, fmt::format("SELECT ensure_month(now() - interval '{} days'), "
                           "ensure_month(now() - interval '{} days')",
                           30 * month, 30 * month - 30));
    Run(owner, R"sql(
INSERT INTO probe
SELECT 1 + k % 300, 1, 1 + (12 - $2::int) * $1::bigint + k / 300,
       now() - make_interval(days => 30 * $2::int)
         + (k / 300) * (interval '30 days' / $1::bigint) + (k % 300) * interval '1 ms',
       1790000000, k / 300, 3,
       1200 + 0.1 * (k % 97), -400 + 0.1 * (k % 89), 900 + 0.1 * (k % 83),
       0.01 * (k % 7), 0.01 * (k % 11), 0.2, 0.2 + 0.01 * (k % 5), 60, 21.5,
       k % 997 = 0, false, k % 1013 = 0, 'plc', '1',
       ARRAY[10.5 + k % 5, -90.25, 95.125, 0.5 + k % 3, 45.75, 12.0625]
FROM generate_series(0, 300 * $1::bigint - 1) k)sql",
        {rounds, month});
    fmt::print("{} of {} months, {:.0f} s\n", kMonths - month + 1, kMonths,
               MonotonicSeconds() - begun_s);
  }
  fmt::print("{:.0f} probes a second made by the server\n",
             static_cast<double>(kCells * kMonths * rounds) / (MonotonicSeconds() - begun_s));
  Run(owner, R"sql(
INSERT INTO cell_day (cell, day, model, probes, wild, sum_mm, sum_mm2, max_mm,
                      sum_dx_mm, sum_dy_mm, sum_dz_mm)
SELECT cell, (utc AT TIME ZONE 'UTC')::date, model,
       count(*) FILTER (WHERE NOT wild AND NOT quarantined), count(*) FILTER (WHERE wild),
       sum(size_mm), sum(size_mm * size_mm), max(size_mm), sum(dx_mm), sum(dy_mm), sum(dz_mm)
FROM probe GROUP BY 1, 2, 3)sql");
  Run(owner,
      "INSERT INTO stream (cell, stream, first_seq, next_seq, dropped) SELECT cell, 1, 1, 1000000, "
      "5 "
      "FROM cell");
  Run(owner,
      "INSERT INTO gap SELECT cell, 1, 100 * k, 100 * k + 4, now() - interval '1 hour' "
      "FROM cell, generate_series(1, 10) k");
  Run(owner,
      "INSERT INTO dead_letter (topic, reason, bytes, payload) "
      "SELECT 'plumblineV1/' || k, 'reason ' || k % 20, 100, 'x' FROM generate_series(1, 20000) k");
  for (const char* const table : {"cell", "cell_day", "gap", "stream", "dead_letter"}) {
    Run(owner, fmt::format("ANALYZE {}", table));
  }
}

/// Reports the longest of five readings, the first of which finds what the cache left.
void Time(const std::string& what, const std::function<bool()>& query) {
  double longest_s = 0;
  for (int run = 0; run < 5; ++run) {
    const double begun_s = MonotonicSeconds();
    REQUIRE(query());
    longest_s = std::max(longest_s, MonotonicSeconds() - begun_s);
  }
  Report({.what = what, .ours = longest_s, .unit = "s", .goal = AtMost(1)});
}

void TimeQueries(plant::Connection& reader, const std::string& stored) {
  Time("plant page's query, " + stored, [&] {
    double now_utc = 0;
    const auto cells = plant::ReadCells(reader, now_utc);
    return cells.ok() && cells->size() == kCells;
  });
  Time("plant status, " + stored, [&] {
    const auto plant = plant::ReadPlantState(reader);
    return plant.ok() && !plant::StatusText(*plant).empty();
  });
  const auto today = static_cast<int>(NumberOf(reader, "SELECT current_date - date '1970-01-01'"));
  const std::pair<const char*, std::pair<int, std::optional<int>>> questions[] = {
      {"plant report of 30 days, ", {30, std::nullopt}},
      {"plant report of 360 days, ", {360, std::nullopt}},
      {"plant report since a date, 60 days each side, ", {60, today - 60}}};
  for (const auto& [name, question] : questions) {
    Time(name + stored, [&, asked = question] {
      const auto data = plant::ReadReportData(reader, asked.first, asked.second);
      return data.ok() && !plant::ReportText(*data, plant::ReportOf(*data)).empty();
    });
  }
}

/// Table and index of all partitions, beside the same columns without a key.
void CompareSize(plant::Connection& owner, double probes) {
  const double ours = NumberOf(owner, R"sql(
SELECT sum(pg_total_relation_size(inhrelid)) FROM pg_inherits
WHERE inhparent = 'plumbline.probe'::regclass)sql");
  const double table = NumberOf(owner, R"sql(
SELECT sum(pg_table_size(inhrelid)) FROM pg_inherits
WHERE inhparent = 'plumbline.probe'::regclass)sql");
  Run(owner, "CREATE UNLOGGED TABLE plain (LIKE probe)");
  Run(owner, "INSERT INTO plain SELECT * FROM probe LIMIT $1", {kPlainRows});
  const double plain = NumberOf(owner, "SELECT pg_total_relation_size('plain')") /
                       NumberOf(owner, "SELECT count(*) FROM plain");
  fmt::print("{:.1f} bytes a probe in the table, {:.1f} in its index\n", table / probes,
             (ours - table) / probes);
  Report({.what = "bytes a probe, table and index",
          .ours = ours / probes,
          .unit = "bytes",
          .peer = "plain table, no key",
          .peers = plain,
          .timed = false});
}

}  // namespace

TEST_CASE("plant report") {
  if (PostgresPrograms().empty()) {
    ReportSkipped("the plant's report", "PostgreSQL 15 is not installed");
    return;
  }
  const double probes =
      wanted_probes > 0 ? wanted_probes : Choose(effort, 36'000.0, 1'000'000.0, 4'000'000.0);
  const double free_bytes =
      static_cast<double>(std::filesystem::space(std::filesystem::temp_directory_path()).available);
  if (free_bytes < kBytesOfProbe * probes) {
    ReportSkipped(fmt::format("the plant's report with {:g} probes", probes),
                  fmt::format("only {:.0f} GB are free", free_bytes / 1e9));
    return;
  }
  const PostgresProcess server(
      "wal_level = minimal\nmax_wal_senders = 0\nmax_wal_size = '4GB'\nshared_buffers = '256MB'\n"
      "synchronous_commit = off\nautovacuum = off\nmax_parallel_workers_per_gather = 1");
  plant::Connection owner = server.ConnectToNewPlant();
  FillPlant(owner, kCells, 0);
  MakeProbes(owner, static_cast<std::int64_t>(probes));
  const double stored = NumberOf(owner, "SELECT count(*) FROM probe");
  fmt::print("{:.4g} probes, {:.0f} rows of cell_day\n", stored,
             NumberOf(owner, "SELECT count(*) FROM cell_day"));
  REQUIRE(owner.RunScript("CREATE ROLE reader LOGIN IN ROLE plumbline_reader").ok());
  plant::Connection reader = server.Connect("reader");
  TimeQueries(reader, fmt::format("{:.2g} probes", stored));
  CompareSize(owner, stored);
}

int main(int argc, char** argv) {
  wanted_probes = ArgumentOf(argc, argv, "probes");
  return RunBenchmark(argc, argv);
}
