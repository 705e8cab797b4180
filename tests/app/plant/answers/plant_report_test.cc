// What `plumbline plant report` says of cells with known drifts.
#include "app/plant/answers/plant_report.h"

#include <catch2/catch.hpp>
#include <iostream>
#include <random>
#include <sstream>

#include "app/base/terminal/terminal_output.h"
#include "app/base/text/json_text.h"
#include "app/plant/answers/report_text.h"
#include "firmware-like/geometry/pose.h"
#include "tests/app/plant/answers/plant_rows.h"
#include "tests/app/plant/database/postgres_process.h"

namespace plumbline::plant_report_test {

using namespace plumbline::plant;
using namespace plumbline::test;
using Catch::Contains;

namespace {

constexpr int kToday = 20000;

DaySums DayOf(int day, int model, double mean_mm, const Vec3& direction) {
  const Vec3 sum = 40 * mean_mm * direction;
  return {day, model, 40, 0, 40 * mean_mm, 2 * mean_mm, sum.x(), sum.y(), sum.z()};
}

/// Cells of one arm model with a residual of 0.2 mm, 0.01 mm between days.
ReportData SteadyPlant(int cells, int days, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 0.01);
  ReportData data;
  data.period = {kToday - days + 1, kToday, 0};
  for (int k = 1; k <= cells; ++k) {
    ReportedCell cell;
    cell.line = "line 1";
    cell.name = "cell " + std::to_string(k);
    cell.arm_model = "KR 210";
    cell.arm_series = k % 2 == 0 ? "R2700" : "R3100";
    for (int day = data.period.first_day; day <= kToday; ++day) {
      cell.days.push_back(DayOf(day, 1, 0.2 + noise(random), Vec3(0.6, 0, 0.8)));
    }
    data.cells.push_back(cell);
  }
  return data;
}

/// The same with sizes and components that are autoregressive, each by itself.
ReportData AutoregressivePlant(int cells, int days, double r, std::mt19937& random) {
  std::normal_distribution<double> normal;
  ReportData data = SteadyPlant(cells, days, 1);
  for (ReportedCell& cell : data.cells) {
    double x[4];
    for (double& value : x) value = normal(random);
    for (DaySums& day : cell.days) {
      for (double& value : x) value = r * value + std::sqrt(1 - r * r) * normal(random);
      day.sum_mm = 40 * (0.2 + 0.01 * x[0]);
      day.sum_dx_mm = 40 * (0.1 + 0.01 * x[1]);
      day.sum_dy_mm = 40 * (0.1 + 0.01 * x[2]);
      day.sum_dz_mm = 40 * (0.1 + 0.01 * x[3]);
    }
  }
  return data;
}

std::vector<std::string> Drifting(const PlantReport& report) {
  std::vector<std::string> names;
  for (const CellDrift& drift : report.drifts) {
    if (drift.p_adjusted <= kSignificance) names.push_back(drift.cell->name);
  }
  return names;
}

}  // namespace

TEST_CASE("a plant without drift has none in nineteen of twenty reports") {
  int reports_with = 0, grouped = 0, maintained = 0;
  for (unsigned seed = 0; seed < 60; ++seed) {
    const ReportData data = SteadyPlant(100, 30, seed);
    const PlantReport report = ReportOf(data);
    CHECK(report.drifts.size() == 100);
    reports_with += !Drifting(report).empty();
    grouped +=
        std::any_of(report.drift_groups.begin(), report.drift_groups.end(),
                    [](const GroupAnswer& group) { return group.p_adjusted <= kSignificance; });
    maintained += !report.maintenance.empty();
  }
  CAPTURE(reports_with, grouped, maintained);
  CHECK(reports_with <= 8);  // 3 are expected; more than 8 once in 150 times
  CHECK(grouped <= 8);
  CHECK(maintained <= 8);
}

TEST_CASE("days that resemble their neighbours make no false entries, and do not hide a drift") {
  std::mt19937 random(43);
  constexpr int kReports = 15;
  for (const double r : {0.3, 0.5, 0.7}) {
    int with_drift = 0, with_shift = 0, with_maintenance = 0, found = 0;
    for (int run = 0; run < kReports; ++run) {
      ReportData data = AutoregressivePlant(80, 30, r, random);
      data.period = {kToday - 14, kToday, 15};
      const PlantReport since = ReportOf(data);
      with_shift += since.shifts.front().p_adjusted <= kSignificance;
      data.period = {kToday - 29, kToday, 0};
      const PlantReport report = ReportOf(data);
      with_drift += !Drifting(report).empty();
      with_maintenance += !report.maintenance.empty();
      for (DaySums& day : data.cells[7].days) {
        day.sum_mm += 40 * 0.01 * (day.day - data.period.first_day);
      }
      const auto drifting = Drifting(ReportOf(data));
      found += std::count(drifting.begin(), drifting.end(), "cell 8") == 1;
    }
    CAPTURE(r, with_drift, with_shift, with_maintenance, found);
    CHECK(with_drift <= 3);  // more than 3 of 15 once in 180 times at 5 %
    CHECK(with_shift <= 3);
    CHECK(with_maintenance <= 3);
    CHECK(found >= (r < 0.6 ? 13 : 7));
  }
}

// Not run by default: the table in docs/plant.md. plant_answers_test "[evaluation]"
TEST_CASE("rates of false entries", "[.][evaluation]") {
  std::mt19937 random(2026);
  constexpr int kReports = 100, kCells = 300;
  std::uniform_real_distribution<double> any(0, 0.7);
  for (const double r : {0.0, 0.3, 0.5, 0.7, -1.0}) {  // -1: each cell another
    int with_drift = 0, with_shift = 0, with_maintenance = 0, found[3] = {};
    for (int run = 0; run < kReports; ++run) {
      ReportData data = AutoregressivePlant(r < 0 ? 0 : kCells, 30, r, random);
      while (data.cells.size() < kCells) {
        data.cells.push_back(AutoregressivePlant(1, 30, any(random), random).cells.front());
      }
      data.period = {kToday - 14, kToday, 15};
      with_shift += ReportOf(data).shifts.front().p_adjusted <= kSignificance;
      data.period = {kToday - 29, kToday, 0};
      const PlantReport report = ReportOf(data);
      with_drift += !Drifting(report).empty();
      with_maintenance += !report.maintenance.empty();
      const double slopes_mm[] = {*report.detectable_mm, 0.05 / 30, 0.1 / 30};
      for (std::size_t k = 0; k < 3; ++k) {
        for (DaySums& day : data.cells[k].days) {
          day.sum_mm += 40 * slopes_mm[k] * (day.day - data.period.first_day);
        }
      }
      for (const CellDrift& drift : ReportOf(data).drifts) {
        const auto k = drift.cell - data.cells.data();
        if (k < 3 && drift.p_adjusted <= kSignificance) ++found[k];
      }
    }
    std::cout << "r " << r << ": of " << kReports << " reports on " << kCells
              << " cells with false drift " << with_drift << ", shift " << with_shift
              << ", maintenance " << with_maintenance << "; found at the stated slope " << found[0]
              << ", 0.05 mm in 30 days " << found[1] << ", 0.1 mm " << found[2] << std::endl;
  }
}

TEST_CASE("a model that made a cell worse is no maintenance; a bound is never the value itself") {
  ReportData data = SteadyPlant(20, 60, 8);
  const auto after = [&](std::size_t k, int from, double mean_mm, int model) {
    for (DaySums& day : data.cells[k].days) {
      const int at = day.day - data.period.first_day;
      if (at >= from) {
        day = DayOf(day.day, model, mean_mm + day.sum_mm / 40 - 0.2, Vec3(0.6, 0, 0.8));
      }
    }
  };
  after(3, 30, 0.6, 2);
  after(5, 0, 0.1, 1);   // better than its siblings at first, then worse
  after(5, 30, 0.4, 1);  // another 0.2 more
  const PlantReport report = ReportOf(data);
  REQUIRE(report.maintenance.size() == 1);
  CHECK(report.maintenance[0].cell->name == "cell 6");
  CHECK_THAT(report.maintenance[0].basis, Contains("siblings' level only"));
  const Interval& reduction = report.maintenance[0].reduction_mm;
  CHECK(reduction.value == Approx(0.1).margin(0.02));
  CHECK(reduction.low > 0);
  CHECK(reduction.low < reduction.value);
  CHECK(reduction.high > reduction.value);
}

TEST_CASE("the report says what it could not have shown") {
  const ReportData few = SteadyPlant(300, 10, 3);
  const PlantReport report = ReportOf(few);
  CHECK(report.never_significant == 300);
  CHECK_FALSE(report.detectable_mm);
  CHECK_THAT(TablesOf(few, report)[1].note, Contains("300 of the tested cells have too few days"));
  const ReportData enough = SteadyPlant(300, 40, 3);
  const PlantReport more = ReportOf(enough);
  CHECK(more.never_significant == 0);
  REQUIRE(more.detectable_mm);
  CHECK_THAT(TablesOf(enough, more)[1].note, Contains("mm in 30 days would be listed"));
  ReportData since = SteadyPlant(10, 400, 3);
  since.period = {kToday - 379, kToday, 20};
  CHECK_THAT(TablesOf(since, ReportOf(since))[3].note, Contains("give --days 25 or more"));
}

TEST_CASE("drifting, stepped and turning cells among steady ones") {
  ReportData data = SteadyPlant(100, 30, 4);
  const auto change = [&](std::size_t k, auto&& mean, const Vec3& direction = Vec3(0.6, 0, 0.8)) {
    for (DaySums& day : data.cells[k].days) {
      const int at = day.day - data.period.first_day;
      const double noise = day.sum_mm / 40 - 0.2;
      day = DayOf(day.day, day.model, mean(at) + noise, direction);
    }
  };
  change(16, [](int day) { return 0.2 + 0.004 * day; });
  // The residual turns from +x to -x: its size stays, its vector moves.
  for (DaySums& day : data.cells[20].days) {
    const double share = (day.day - data.period.first_day) / 29.0;
    day.sum_dx_mm = day.sum_mm * std::cos(3 * share);
    day.sum_dz_mm = day.sum_mm * std::sin(3 * share);
  }
  change(39, [](int day) { return day < 15 ? 0.2 : 0.3; });
  change(60, [](int) { return 0.6; });
  // A model came into force half way: its step is not drift.
  change(70, [](int day) { return day < 15 ? 0.5 : 0.1; });
  for (DaySums& day : data.cells[70].days) day.model = day.day - data.period.first_day < 15 ? 1 : 2;
  for (DaySums& day : data.cells[80].days) day.probes = 2;  // too few to be compared
  const PlantReport report = ReportOf(data);
  const auto drifting = Drifting(report);
  CHECK(std::count(drifting.begin(), drifting.end(), "cell 17") == 1);
  CHECK(std::count(drifting.begin(), drifting.end(), "cell 21") == 1);
  CHECK(std::count(drifting.begin(), drifting.end(), "cell 71") == 0);
  CHECK(drifting.size() <= 3);  // the step may count as drift
  CHECK(report.too_few_days == 1);
  CHECK(report.levels.front().cell->name == "cell 61");
  std::vector<std::string> maintained;
  for (const Maintenance& one : report.maintenance) maintained.push_back(one.cell->name);
  CHECK(maintained == std::vector<std::string>{"cell 61", "cell 40", "cell 17"});
  const Interval& reduction = report.maintenance[1].reduction_mm;
  CHECK(reduction.low > 0.05);
  CHECK(reduction.value == Approx(0.1).margin(0.02));
}

TEST_CASE("a long period is taken by several days, with the same slope") {
  ReportData data = SteadyPlant(20, 360, 2);
  CHECK(data.period.bin_days() == 4);
  for (DaySums& day : data.cells[3].days) {
    day = DayOf(day.day, 1, day.sum_mm / 40 + 0.001 * (day.day - data.period.first_day),
                Vec3(1, 0, 0));
  }
  const PlantReport report = ReportOf(data);
  REQUIRE(Drifting(report) == std::vector<std::string>{"cell 4"});
  CHECK(report.drifts.front().size_mm.days == 90);
  CHECK(report.drifts.front().size_mm.slope.value == Approx(0.001).margin(0.0001));
}

TEST_CASE("which arms changed at a date, and what of all arms of a series") {
  ReportData data = SteadyPlant(60, 60, 9);
  data.period = {kToday - 19, kToday, 40};
  for (ReportedCell& cell : data.cells) {
    for (DaySums& day : cell.days) {
      const double mean = day.sum_mm / 40;
      if (day.day < data.period.first_day) continue;
      if (cell.name == "cell 5") day = DayOf(day.day, 1, mean + 0.1, Vec3(1, 0, 0));
      if (cell.arm_series == "R2700") day = DayOf(day.day, 1, mean + 0.006, Vec3(1, 0, 0));
    }
  }
  const PlantReport report = ReportOf(data);
  REQUIRE(report.shifts.size() == 60);
  CHECK(report.shifts.front().cell->name == "cell 5");
  CHECK(report.shifts.front().size_mm.difference.value == Approx(0.1).margin(0.01));
  for (const GroupAnswer& group : report.shift_groups) {
    if (group.kind != "series") continue;
    CHECK((group.p_adjusted <= kSignificance) == (group.name == "KR 210 R2700"));
  }
}

TEST_CASE("the report of a database as text, JSON and HTML") {
  if (PostgresPrograms().empty()) {
    WARN("SKIPPED: no PostgreSQL 15 here");
    return;
  }
  const PostgresProcess server;
  Connection owner = server.ConnectToNewPlant();
  const auto empty = ReadReportData(owner, 30, std::nullopt);
  REQUIRE(empty);
  CHECK_THAT(ReportText(*empty, ReportOf(*empty)), Contains("No cell has six days"));
  FillPlant(owner, 40, 60);
  const auto run = [&](const char* statement) {
    const auto done = owner.Run(statement);
    INFO((done ? "" : done.error()));
    REQUIRE(done);
  };
  run("UPDATE cell SET name = '<script>x</script>', state = '{\"proposed_model\": 7}' "
      "WHERE cell = 9");
  run("UPDATE cell SET state = '{\"proposed_model\": \"9x\"}' WHERE cell = 10");
  run("INSERT INTO camera_now VALUES (9, 'left', '2026-11-01Z', 'stale', '<b>views</b> disagree')");
  run("UPDATE cell_day SET sum_mm = sum_mm + probes * 0.01 * (60 - (current_date - day)) "
      "WHERE cell = 9");
  run("INSERT INTO job (kind, cell, key, finished) VALUES ('diagnose', 9, 'k', now())");
  run("INSERT INTO result (job, worker, program, seconds, output) "
      "SELECT job, 'w', '1', 3, '{\"verdict\": \"explained\", \"effects\": [{\"id\": "
      "\"joint_compliance\"}, 7]}' FROM job");
  const auto today = owner.Run("SELECT current_date - date '1970-01-01'");
  const int since = static_cast<int>(today->Integer(0, 0)) - 20;
  for (const auto& from : {std::optional<int>(), std::optional(since)}) {
    const auto data = ReadReportData(owner, 30, from);
    REQUIRE(data);
    const PlantReport report = ReportOf(*data);
    CHECK(Drifting(report) == std::vector<std::string>{"<script>x</script>"});
    const std::string text = ReportText(*data, report);
    INFO(text);
    CHECK_THAT(text, Contains("Worst cells") && Contains("cell-9 (<scr") &&
                         Contains("1 of 40 cells tested drift since") &&
                         Contains("explained: joint_compliance") && Contains("1 of 40 cells."));
    CHECK((text.find("Changed at " + DateText(since)) != std::string::npos) == from.has_value());
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      INFO(line);
      CHECK(terminal::ColumnsOf(line) <= 80);
    }
    const std::string html = ReportHtml(*data, report);
    CHECK_THAT(html, !Contains("<script") && !Contains("<b>") &&
                         Contains("&lt;script&gt;x&lt;/script&gt;") &&
                         Contains("class=\"mark bar\""));
    const auto json = text::JsonOrNull(ReportJson(*data, report));
    CHECK(json.at("levels").size() == 40);
    CHECK(json.at("drifts").at(0).at("name") == "<script>x</script>");
    CHECK(json.at("maintenance").at(0).at("reduction_mm").at("low") > 0);
    CHECK(json.at("shifts").size() == (from ? 40 : 0));
  }
}

TEST_CASE("dates") {
  CHECK(DayFromText("1970-01-02") == 1);
  CHECK(DateText(20000) == "2024-10-04");
  for (const char* const none : {"", "2026-13-01", "2026-02-30", "01.02.2026", "2026-1-1", "x"}) {
    CHECK_FALSE(DayFromText(none));
  }
}

}  // namespace plumbline::plant_report_test
