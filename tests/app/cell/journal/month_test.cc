// A month of probes: size of the journal, its limit, and no false alarms of the drift monitor.
#include <catch2/catch.hpp>
#include <filesystem>
#include <random>

#include "app/cell/journal/journal.h"
#include "firmware-like/monitor/drift_monitor.h"
#include "firmware-like/monitor/run_length.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::month_test {

using namespace plumbline::cell;
using namespace plumbline::test;

namespace {

constexpr int kPerDay = 1440, kDays = 30;  // one a minute: sixty times the usual

JournalRow ProbeAt(int number, std::mt19937& random) {
  std::normal_distribution<double> noise(0, 5e-5);
  JournalRow row;
  row.unix_ms = 1'795'260'000'000 + 60'000LL * number;
  row.t_s = 60.0 * number;
  row.session = "1";
  row.command = static_cast<std::uint16_t>(number);  // wraps around within the month
  row.q = model::JointVector::LinSpaced(6, -1, 1) * (1 + 1e-3 * (number % 16));
  row.tau = 100 * row.q;
  row.payload_kg = 60.25;
  row.temp_C = 21.5;
  row.predicted_W = Vec3(1.2, -0.4, 0.9);
  row.measured_W = *row.predicted_W + Vec3(noise(random), noise(random), noise(random));
  row.model_version = 3;
  row.q_step_rad = 1e-3;
  return row;
}

std::uintmax_t BytesIn(const std::string& folder) {
  std::uintmax_t bytes = 0;
  for (const auto& file : std::filesystem::directory_iterator(folder)) bytes += file.file_size();
  return bytes;
}

}  // namespace

TEST_CASE(
    "a month of probes, one a minute: every one is there, in some megabytes, without an alarm") {
  const TemporaryFolder folder;
  const std::vector<model::Joint> joints(6);
  std::mt19937 random(7);
  monitor::DriftMonitor monitor(
      monitor::MonitorDesignFor({.probes_per_day = kPerDay, .false_alarms_per_year = 1}));
  auto journal = Journal::Open(folder.path() + "/journal.sqlite", 1'000'000'000);
  REQUIRE(journal);
  for (int day = 0; day < kDays; ++day) {
    std::vector<JournalRow> rows;
    for (int k = 0; k < kPerDay; ++k) {
      rows.push_back(ProbeAt(day * kPerDay + k, random));
      monitor.Update(*rows.back().measured_W - *rows.back().predicted_W);
    }
    REQUIRE(*journal.value().Append(rows, joints) == (day + 1) * kPerDay);
  }
  CHECK_FALSE(monitor.alarm());
  CHECK(*journal.value().Count() == kDays * kPerDay);
  const auto bytes = BytesIn(folder.path());
  CHECK(bytes <
        500 * kDays * kPerDay + 5'000'000);  // 500 bytes per probe, plus the write-ahead log
  const auto newest = journal.value().Read({.last = 10}, joints);
  REQUIRE(newest);
  CHECK((*newest)[9].id == kDays * kPerDay);
  CHECK(*(*newest)[9].t_s == 60.0 * (kDays * kPerDay - 1));
}

TEST_CASE("a journal grows to its limit; then probes are refused, and nothing is lost") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/journal.sqlite";
  constexpr std::int64_t kBound = 1'000'000;
  const std::vector<model::Joint> joints(6);
  std::mt19937 random(7);
  std::int64_t kept = 0;
  {
    auto journal = Journal::Open(path, kBound);
    REQUIRE(journal);
    std::string why;
    for (int day = 0; why.empty() && day < 100; ++day) {
      std::vector<JournalRow> rows;
      for (int k = 0; k < 100; ++k) rows.push_back(ProbeAt(100 * day + k, random));
      const auto last = journal.value().Append(rows, joints);
      if (last) {
        kept = *last;
      } else {
        why = last.error();
      }
    }
    CHECK_THAT(why, Catch::Contains("the journal has reached the 1 MB that journal_mb allows") &&
                        Catch::Contains("plumbline journal export"));
    CHECK(kept > 1000);
    CHECK(*journal.value().Count() == kept);
  }
  CHECK(BytesIn(folder.path()) <= static_cast<std::uintmax_t>(kBound));
  auto smaller = Journal::Open(path, kBound / 10);  // larger already: it stays readable
  REQUIRE(smaller);
  CHECK(*smaller.value().Count() == kept);
  CHECK_FALSE(smaller.value().Append(std::vector(100, ProbeAt(0, random)), joints));
  auto larger = Journal::Open(path, 2 * kBound);
  CHECK(*larger.value().Append({ProbeAt(0, random)}, joints) == kept + 1);
}

}  // namespace plumbline::month_test
