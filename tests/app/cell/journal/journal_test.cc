#include "app/cell/journal/journal.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include "app/cell/journal/journal_csv.h"
#include "tests/app/temporary_folder.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::journal_test {

using namespace plumbline::cell;
using plumbline::test::TemporaryFolder;

namespace {

const std::vector<model::Joint>& Joints() {
  static const model::CellModel cell = test::HeavyArm();
  return cell.robot.joints;
}

JournalRow FullRow(int number) {
  JournalRow row;
  row.unix_ms = 1800000000000 + number;
  row.t_s = 86400.125 + number;
  row.session = "day 1";
  row.command = static_cast<std::uint16_t>(number);
  row.q = model::JointVector::LinSpaced(6, -1, 1) * (number + 1) / 7.0;
  row.qd = row.q / 3;
  row.qdd = row.q / 9;
  row.tau = row.q * 100;
  row.payload_kg = 60.25;
  row.temp_C = 21.5;
  row.predicted_W = Vec3(1.1, 2.2, 3.3);
  row.measured_W = Vec3(1.1001, 2.2002, number);
  row.orientation_W = Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Vec3::UnitX()));
  row.model_version = 3;
  return row;
}

void CheckSame(const JournalRow& a, const JournalRow& b) {
  CHECK(a.source == b.source);
  CHECK(a.unix_ms == b.unix_ms);
  CHECK(a.t_s == b.t_s);
  CHECK(a.session == b.session);
  CHECK(a.command == b.command);
  CHECK((a.q - b.q).norm() < 1e-15);
  CHECK(a.qd.size() == b.qd.size());
  CHECK(a.tau.size() == b.tau.size());
  CHECK(a.payload_kg == b.payload_kg);
  CHECK(a.temp_C == b.temp_C);
  CHECK(a.predicted_W.has_value() == b.predicted_W.has_value());
  REQUIRE(a.measured_W.has_value() == b.measured_W.has_value());
  if (a.measured_W) CHECK((*a.measured_W - *b.measured_W).norm() < 1e-14);
  CHECK(a.orientation_W.has_value() == b.orientation_W.has_value());
  CHECK(a.model_version == b.model_version);
}

/// A table, and the same after import into a journal and export.
struct RoundTrip {
  measure::MeasuredTable table, back;
};

RoundTrip ThroughJournal(const std::string& csv) {
  const TemporaryFolder folder;
  config::FaultList faults;
  const auto table = measure::TableFromCsv(csv, "measured.csv", Joints(), faults);
  REQUIRE(table);
  auto journal = Journal::Open(folder.path() + "/journal.sqlite");
  REQUIRE(journal.value().Append(JournalRowsFrom(*table), Joints()).ok());
  const ExportedCsv exported = CsvFromJournal(*journal.value().Read({}, Joints()), Joints());
  CHECK(exported.notes.empty());
  const auto back = measure::TableFromCsv(exported.text, "back.csv", Joints(), faults);
  CHECK_FALSE(faults.HasFaults());
  REQUIRE(back);
  return {*table, *back};
}

}  // namespace

TEST_CASE("rows come back as they were written, absent values absent") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/journal.sqlite";
  JournalRow bare;
  bare.source = JournalRow::Source::kImport;
  bare.q = model::JointVector::Constant(6, 0.5);
  bare.range_m = 2.5;
  bare.t_s = 12.5;
  {
    auto journal = Journal::Open(path);
    REQUIRE(journal.ok());
    CHECK(*journal.value().Append({FullRow(1), bare}, Joints()) == 2);
    REQUIRE(journal.value().Mark(1, true, true).ok());
  }
  auto journal = Journal::OpenForReading(path);
  REQUIRE(journal.ok());
  const auto rows = journal.value().Read({}, Joints());
  REQUIRE(rows.ok());
  REQUIRE(rows->size() == 2);
  CheckSame((*rows)[0], FullRow(1));
  CHECK((*rows)[0].wild);
  CHECK((*rows)[0].alarm);
  CheckSame((*rows)[1], bare);
  CHECK((*rows)[1].range_m == 2.5);
  CHECK((*rows)[1].id == 2);
  CHECK(*journal.value().JointCount() == 6);
}

TEST_CASE("filters select rows") {
  const TemporaryFolder folder;
  auto journal = Journal::Open(folder.path() + "/journal.sqlite");
  REQUIRE(journal.ok());
  for (int i = 1; i <= 20; ++i) {
    JournalRow row = FullRow(i);
    row.session = i <= 10 ? "a" : "b";
    row.model_version = i % 2;
    REQUIRE(journal.value().Append({row}, Joints()).ok());
  }
  const auto ids = [&](const JournalFilter& filter) {
    std::vector<std::int64_t> found;
    const auto rows = journal.value().Read(filter, Joints());
    for (const JournalRow& row : *rows) found.push_back(row.id);
    return found;
  };
  CHECK(ids({.last = 2}) == std::vector<std::int64_t>{19, 20});
  CHECK(ids({.after_id = 18}) == std::vector<std::int64_t>{19, 20});
  CHECK(ids({.last = 1, .session = "a"}) == std::vector<std::int64_t>{10});
  CHECK(ids({.after_id = 16, .model_version = 1}) == std::vector<std::int64_t>{17, 19});
}

TEST_CASE("a file that is not a journal is refused and left unchanged") {
  const TemporaryFolder folder;
  const auto content = [](const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  struct Case {
    const char* name;
    std::function<void(const std::string&)> make;
    const char* told;
  };
  const auto run = [](const std::string& path, const char* sql) {
    auto database = sqlite::Database::Open(path, sqlite::Database::Mode::kWrite);
    REQUIRE(database.value().Run(sql));
  };
  const Case cases[] = {
      {"text", [](const std::string& path) { std::ofstream(path) << std::string(5000, 'x'); },
       "not a database; restore it from the backup, or move it away to start a new one"},
      {"newer", [&](const std::string& path) { run(path, "PRAGMA user_version = 99"); }, "newer"},
      {"other", [&](const std::string& path) { run(path, "CREATE TABLE t (a)"); },
       "not a plumbline journal"},
  };
  for (const Case& c : cases) {
    CAPTURE(c.name);
    const std::string path = folder.path() + "/" + c.name;
    c.make(path);
    const std::string before = content(path);
    const auto journal = Journal::Open(path);
    REQUIRE_FALSE(journal.ok());
    CHECK_THAT(journal.error(), Catch::Contains(c.told));
    CHECK(content(path) == before);
  }
  CHECK_FALSE(Journal::OpenForReading(folder.path() + "/none").ok());
  CHECK_FALSE(std::filesystem::exists(folder.path() + "/none"));
  CHECK_FALSE(Journal::Open(folder.path() + "/no/folder").ok());
}

TEST_CASE("the error for a locked journal does not suggest moving it away") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/journal.sqlite";
  auto other = sqlite::Database::Open(path, sqlite::Database::Mode::kWrite);
  REQUIRE(other);
  REQUIRE(other.value().Run("CREATE TABLE t (a); BEGIN EXCLUSIVE"));
  const auto journal = Journal::OpenForReading(path);
  REQUIRE_FALSE(journal.ok());
  CHECK_THAT(journal.error(), Catch::Contains("another program is writing to it: wait"));
  CHECK_THAT(journal.error(), !Catch::Contains("move it away"));
}

TEST_CASE("rows of another arm are reported, not misread") {
  const TemporaryFolder folder;
  auto journal = Journal::Open(folder.path() + "/journal.sqlite");
  REQUIRE(journal.value().Append({FullRow(1)}, Joints()).ok());
  const auto rows = journal.value().Read({}, std::vector<model::Joint>(7));
  REQUIRE_FALSE(rows.ok());
  CHECK_THAT(rows.error(), Catch::Contains("row 1") && Catch::Contains("7 joints"));
}

TEST_CASE("two writers do not lose rows") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/journal.sqlite";
  const auto write = [&path] {
    auto journal = Journal::Open(path);
    for (int i = 0; i < 100; ++i) {
      if (!journal || !journal.value().Append({FullRow(i)}, Joints())) return;
    }
  };
  std::thread first(write), second(write);
  first.join();
  second.join();
  CHECK(*Journal::Open(path).value().Count() == 200);
}

TEST_CASE("a process killed while it writes loses nothing that it had acknowledged") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/journal.sqlite";
  std::mt19937 random(5);
  std::int64_t reported = 0;
  // As long as several writes take on this disk.
  const auto began = std::chrono::steady_clock::now();
  {
    auto journal = Journal::Open(path);
    REQUIRE(journal.ok());
    for (int i = 0; i < 5; ++i) {
      REQUIRE(journal.value().Append({FullRow(i), FullRow(i)}, Joints()).ok());
    }
    reported = *journal.value().Count();
  }
  const auto longest_us = std::clamp<std::int64_t>(
      2 * ((std::chrono::steady_clock::now() - began) / std::chrono::microseconds(1)), 30'000,
      500'000);
  // Forty times, or more often on a slow disk.
  for (int round = 0; round < 40 || (reported <= 100 && round < 400); ++round) {
    int ends[2];
    REQUIRE(pipe(ends) == 0);
    const pid_t writer = fork();
    if (writer == 0) {
      close(ends[0]);
      auto journal = Journal::Open(path);
      if (!journal) _exit(1);
      for (int i = 0;; ++i) {
        // Pairs, so that half a transaction would be detected.
        const auto last = journal.value().Append({FullRow(i), FullRow(i)}, Joints());
        if (!last) _exit(2);
        const std::int64_t id = *last;
        if (write(ends[1], &id, sizeof id) != sizeof id) _exit(3);
      }
    }
    close(ends[1]);
    std::this_thread::sleep_for(std::chrono::microseconds(
        std::uniform_int_distribution<std::int64_t>(0, longest_us)(random)));
    kill(writer, SIGKILL);
    int status = 0;
    waitpid(writer, &status, 0);
    CHECK(WIFSIGNALED(status));  // it was killed, and did not fail
    std::int64_t id = 0;
    while (read(ends[0], &id, sizeof id) == sizeof id) reported = id;
    close(ends[0]);

    auto journal = Journal::Open(path);
    REQUIRE(journal.ok());
    const std::int64_t count = *journal.value().Count();
    CHECK(count >= reported);
    CHECK(count <= reported + 2);
    CHECK(count % 2 == 0);
    reported = count;
  }
  CHECK(reported > 100);
  auto database = sqlite::Database::Open(path, sqlite::Database::Mode::kRead);
  sqlite::Statement check(database.value().get(), "PRAGMA integrity_check");
  REQUIRE(check.Step() == SQLITE_ROW);
  CHECK(check.Text(0) == "ok");
  const auto rows = Journal::OpenForReading(path).value().Read({}, Joints());
  REQUIRE(rows.ok());
  CHECK(static_cast<std::int64_t>(rows->size()) == reported);
  CHECK(rows->back().id == reported);
}

TEST_CASE("exported rows read as the measured.csv they came from") {
  const std::string text =
      "session,t_s,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,tau1_Nm,tau2_Nm,tau3_Nm,tau4_Nm,"
      "tau5_Nm,tau6_Nm,payload_kg,temp_C,x_mm,y_mm,z_mm\n"
      "1,0.5,1.00001,-20,30,40,50,60,1,2,3,4,5,6,60,21.5,1000.00001,-2.5,3.25\n"
      "1,1.5,2.00001,-21,31,41,51,61,1,2,3,4,5,6,60,21.6,1001.00001,-2.5,3.25\n";
  const auto [table, back] = ThroughJournal(text);
  CHECK(back.recorded == table.recorded);
  REQUIRE(back.rows.size() == 2);
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK((back.rows[i].q - table.rows[i].q).norm() < 1e-9);
    CHECK((*back.rows[i].measured_W - *table.rows[i].measured_W).norm() < 1e-9);
    CHECK(back.rows[i].t_s == table.rows[i].t_s);
    CHECK(back.rows[i].temp_C == table.rows[i].temp_C);
  }
}

TEST_CASE("the camera of a row is imported and exported") {
  const std::string text =
      "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm,camera\n"
      "1,-20,30,40,50,60,1000,-2.5,3.25,side\n"
      "2,-20,30,40,50,60,1001,-2.5,3.25,\n"
      "3,-20,30,40,50,60,1002,-2.5,3.25,side+rear\n";
  const auto [table, back] = ThroughJournal(text);
  REQUIRE(back.rows.size() == 3);
  for (std::size_t k = 0; k < 3; ++k) CHECK(back.rows[k].camera == table.rows[k].camera);
}

TEST_CASE(
    "rows on artefacts and of several kinds come back from the journal as they were imported") {
  const std::string text =
      "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm,artefact,range_mm,gauge_mm,sigma_"
      "mm\n"
      "1,-20,30,40,50,60,1000,-2.5,3.25,,,,0.05\n"
      "2,-20,30,40,50,60,,,,front_0,,,\n"
      "3,-20,30,40,50,60,,,,post,812.5,,0.2\n"
      "4,-20,30,40,50,60,,,,dial,,-0.125,\n";
  const auto [table, back] = ThroughJournal(text);
  REQUIRE(back.rows.size() == 4);
  for (std::size_t i = 0; i < 4; ++i) {
    const measure::MeasuredRow &a = back.rows[i], &b = table.rows[i];
    CHECK(a.artefact == b.artefact);
    CHECK(a.measured_W.has_value() == b.measured_W.has_value());
    for (const auto value : {&model::MeasuredPoint::range_m, &model::MeasuredPoint::gauge_m,
                             &model::MeasuredPoint::sigma_m}) {
      REQUIRE((a.*value).has_value() == (b.*value).has_value());
      if (a.*value) CHECK(*(a.*value) == Approx(*(b.*value)));
    }
  }
}

TEST_CASE("t_s is exported as it is in the journal, whatever the wall clock did") {
  std::vector<JournalRow> rows = {FullRow(1), FullRow(2), FullRow(3)};
  rows[1].unix_ms = 0;
  config::FaultList faults;
  const auto back =
      measure::TableFromCsv(CsvFromJournal(rows, Joints()).text, "m.csv", Joints(), faults);
  REQUIRE(back);
  for (std::size_t i = 0; i < 3; ++i) CHECK(back->rows[i].t_s == rows[i].t_s);
  rows[1].t_s.reset();  // never derived from another clock
  CHECK_FALSE(measure::TableFromCsv(CsvFromJournal(rows, Joints()).text, "m.csv", Joints(), faults)
                  ->recorded.time);
}

TEST_CASE("probes and imported rows count time from different origins: together t_s is left out") {
  std::vector<JournalRow> rows = {FullRow(1), FullRow(2)};
  rows[1].source = JournalRow::Source::kImport;
  const ExportedCsv mixed = CsvFromJournal(rows, Joints());
  CHECK(mixed.text.substr(0, mixed.text.find('\n')).find("t_s") == std::string::npos);
  CHECK_THAT(mixed.notes.front(), Catch::Contains("t_s: left out"));
  rows[0].source = JournalRow::Source::kImport;
  CHECK(CsvFromJournal(rows, Joints()).text.find("t_s") != std::string::npos);
}

TEST_CASE("the resolution of the joint registers is stored with a row if it matters") {
  std::vector<JournalRow> rows = {FullRow(1), FullRow(2)};
  CHECK(CsvFromJournal(rows, Joints()).text.find("q_step_deg") == std::string::npos);
  rows[1].q_step_rad = 1e-3;
  config::FaultList faults;
  const auto back =
      measure::TableFromCsv(CsvFromJournal(rows, Joints()).text, "m.csv", Joints(), faults);
  REQUIRE(back);
  CHECK(back->recorded.q_step);
  CHECK(back->rows[0].q_step_rad == 0);
  CHECK(back->rows[1].q_step_rad == Approx(1e-3).epsilon(1e-6));
}

TEST_CASE("a journal that cannot be read is an error, not zero") {
  const TemporaryFolder folder;
  const std::string file = folder.path() + "/journal.sqlite";
  auto journal = Journal::Open(file);
  REQUIRE(journal.ok());
  CHECK(*journal.value().LastRow() == 0);
  CHECK(*journal.value().JointCount() == 0);
  CHECK_FALSE(journal.value().LastProbeTime_s()->has_value());
  CHECK_FALSE(journal.value().LastRestart()->has_value());
  REQUIRE(journal.value().Append({FullRow(1)}, Joints()).ok());
  CHECK(*journal.value().LastRow() == 1);
  const double epoch_s = journal.value().EpochUtc_s();
  CHECK(epoch_s > 1.7e9);
  {
    auto raw = sqlite::Database::Open(file, sqlite::Database::Mode::kWrite);
    REQUIRE(raw.value().Run(
        "DROP TABLE measurement; DROP TABLE import; DROP TABLE monitor_restart; DROP TABLE epoch"));
  }
  CHECK(journal.value().EpochUtc_s() == epoch_s);  // as it was opened
  CHECK_FALSE(journal.value().LastRow().ok());
  CHECK_FALSE(journal.value().Count().ok());
  CHECK_FALSE(journal.value().JointCount().ok());
  CHECK_FALSE(journal.value().LastProbeTime_s().ok());
  CHECK_FALSE(journal.value().LastRestart().ok());
  CHECK_FALSE(journal.value().LastModel().ok());
  CHECK_FALSE(journal.value().ImportedAs(1).ok());
  CHECK_FALSE(journal.value().AppendImport({}, Joints(), "a.csv", 1, false).ok());
  // Without its epoch the times of probes would count from 1970.
  const auto opened = Journal::OpenForReading(file);
  REQUIRE_FALSE(opened.ok());
  CHECK_THAT(opened.error(), Catch::Contains("epoch"));
  CHECK_FALSE(Journal::Open(file).ok());
}

TEST_CASE("few rows that lack a column are left out; if many lack it, the column is") {
  std::vector<JournalRow> rows;
  for (int i = 1; i <= 97; ++i) {
    rows.push_back(FullRow(i));
    rows.back().id = i;
    rows.back().source = JournalRow::Source::kImport;
  }
  const auto lacks = [](JournalRow& row) {
    row.t_s.reset();
    row.temp_C.reset();
    row.qd.resize(0);
  };
  lacks(rows.back());
  const ExportedCsv few = CsvFromJournal(rows, Joints());
  config::FaultList faults;
  const auto back = measure::TableFromCsv(few.text, "m.csv", Joints(), faults);
  REQUIRE(back);
  CHECK(back->rows.size() == 96);
  CHECK((back->recorded.time && back->recorded.temperature && back->recorded.qd));
  CHECK(few.ids.size() == 96);
  CHECK(few.ids.back() == 96);
  REQUIRE(few.notes.size() == 1);
  CHECK(few.notes[0] == "row 97: left out, it has no t_s, qd1_deg_s.., temp_C, unlike the others");

  // A tenth of all, and a tenth of the newest fifty, which may have raised an alarm.
  struct Case {
    std::size_t first, last;
  };
  for (const Case& c : {Case{10, 19}, Case{92, 96}}) {
    CAPTURE(c.first, c.last);
    std::vector<JournalRow> more = rows;
    for (std::size_t k = c.first; k <= c.last; ++k) lacks(more[k]);
    const ExportedCsv many = CsvFromJournal(more, Joints());
    const auto table = measure::TableFromCsv(many.text, "m.csv", Joints(), faults);
    REQUIRE(table);
    CHECK(table->rows.size() == 97);
    CHECK_FALSE((table->recorded.time || table->recorded.temperature || table->recorded.qd));
    CHECK(table->recorded.payload);
    const std::string notes = fmt::format("{}", fmt::join(many.notes, "\n"));
    CHECK_THAT(notes, Catch::Contains(fmt::format("column temp_C: left out, only {} of 97",
                                                  c.last < 96 ? 86 : 92)));
  }
}

TEST_CASE("one probe among many imported rows is left out, not the time of all") {
  std::vector<JournalRow> rows;
  for (int i = 1; i <= 60; ++i) {
    rows.push_back(FullRow(i));
    rows.back().id = i;
    if (i != 30) rows.back().source = JournalRow::Source::kImport;
  }
  const ExportedCsv exported = CsvFromJournal(rows, Joints());
  CHECK(exported.ids.size() == 59);
  CHECK_THAT(exported.text.substr(0, 40), Catch::Contains("t_s"));
  REQUIRE(exported.notes.size() == 1);
  CHECK(exported.notes[0] ==
        "row 30: left out, it has no t_s of the same clock, unlike the others");
}

TEST_CASE("values that only some rows have are left out with a note, never zero") {
  std::vector<JournalRow> rows = {FullRow(1), FullRow(2), FullRow(3), FullRow(4)};
  rows[1].temp_C.reset();
  rows[2].qd.resize(0);
  rows[3].measured_W.reset();
  rows[3].range_m = 1.0;
  const ExportedCsv exported = CsvFromJournal(rows, Joints());
  const std::string header = exported.text.substr(0, exported.text.find('\n'));
  CHECK_THAT(header, !Catch::Contains("temp_C") && !Catch::Contains("qd1_deg_s") &&
                         Catch::Contains("t_s") && Catch::Contains("payload_kg"));
  CHECK(exported.ids.size() == 3);
  const std::string notes = fmt::format("{}", fmt::join(exported.notes, "\n"));
  CHECK_THAT(notes, Catch::Contains("temp_C") && Catch::Contains("2 of 3") &&
                        Catch::Contains("no position"));
}

TEST_CASE("quarantined and rejected rows are not measurements; accepted ones are") {
  const TemporaryFolder folder;
  auto opened = Journal::Open(folder.path() + "/journal.sqlite");
  REQUIRE(opened);
  Journal& journal = opened.value();
  for (int k = 1; k <= 5; ++k) {
    JournalRow row = FullRow(k);
    if (k == 2 || k == 4) row.quarantine = JournalRow::Quarantine::kWaiting;
    REQUIRE(*journal.Append({row}, Joints()) == k);
  }
  const auto ids = [&](JournalFilter::Rows which) {
    JournalFilter filter;
    filter.rows = which;
    std::vector<std::int64_t> found;
    for (const JournalRow& row : journal.Read(filter, Joints()).value()) found.push_back(row.id);
    return found;
  };
  using Rows = JournalFilter::Rows;
  using Ids = std::vector<std::int64_t>;
  CHECK(ids(Rows::kMeasurements) == Ids{1, 3, 5});
  CHECK(ids(Rows::kAll) == Ids{1, 2, 3, 4, 5});
  CHECK(ids(Rows::kWaiting) == Ids{2, 4});
  CHECK(*journal.Waiting() == 2);
  const std::int64_t before = *journal.LastDecision();

  const auto refused = journal.Decide({2, 3}, true, 0);  // 3 is a measurement: none is decided
  REQUIRE_FALSE(refused);
  CHECK_THAT(refused.error(), Catch::Contains("row 3 is not in quarantine; nothing decided"));
  CHECK(*journal.Waiting() == 2);
  CHECK(*journal.LastDecision() == before);

  REQUIRE(journal.Decide({2}, true, 1800000000000));
  REQUIRE(journal.Decide({4}, false, 1800000000000));
  CHECK(ids(Rows::kMeasurements) == Ids{1, 2, 3, 5});  // in its place in time
  CHECK(ids(Rows::kWaiting).empty());
  CHECK(*journal.LastDecision() > before);
  REQUIRE(journal.Decide({2}, false, 1800000000001));  // the person has changed the decision
  CHECK(ids(Rows::kMeasurements) == Ids{1, 3, 5});
}

TEST_CASE("a symbolic link in place of the journal is not followed; a linked folder is") {
  const TemporaryFolder folder;
  const std::string real = folder.path() + "/real", linked = folder.path() + "/linked";
  std::filesystem::create_directory(real);
  std::filesystem::create_directory_symlink(real, linked);
  REQUIRE(Journal::Open(linked + "/journal.sqlite").ok());
  CHECK(std::filesystem::exists(real + "/journal.sqlite"));

  const std::string victim = folder.path() + "/victim", link = real + "/other.sqlite";
  std::filesystem::create_symlink(victim, link);
  const auto refused = Journal::Open(link);
  REQUIRE_FALSE(refused);
  CHECK_THAT(refused.error(), Catch::Contains("other.sqlite: is a symbolic link"));
  CHECK_FALSE(std::filesystem::exists(victim));
}

}  // namespace plumbline::journal_test
