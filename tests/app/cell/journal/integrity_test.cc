// Damaged journals: what is lost is found, told by row, and salvaged.
#include "app/cell/journal/integrity.h"

#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "app/cell/journal/journal.h"
#include "app/cell/journal/salvage.h"
#include "tests/app/temporary_folder.h"
#include "tests/file_text.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::integrity_test {

using namespace plumbline::cell;
using namespace plumbline::test;

namespace {

constexpr int kRows = 201;
constexpr std::size_t kSector = 512;

const std::vector<model::Joint>& Joints() {
  static const model::CellModel cell = test::HeavyArm();
  return cell.robot.joints;
}

JournalRow Probe(int number) {
  JournalRow row;
  row.unix_ms = 1800000000000 + 1000 * number;
  row.t_s = number;
  row.session = "shift 1";
  row.command = static_cast<std::uint16_t>(number);
  row.q = model::JointVector::LinSpaced(static_cast<Eigen::Index>(Joints().size()), -1, 1) *
          (number + 1) / 300.0;
  row.tau = row.q * 100;
  row.payload_kg = 60;
  row.predicted_W = Vec3(1.1, 2.2, 3.3);
  row.measured_W = Vec3(1.1001, 2.2002, 3.3 + 1e-6 * number);
  row.predicted_radius_m = 2e-3;
  row.model_version = 1;
  if (number % 50 == 0) row.quarantine = JournalRow::Quarantine::kWaiting;
  return row;
}

/// A journal as a cell leaves it: marked, decided and restarted.
void WriteJournal(const std::string& path) {
  auto opened = Journal::Open(path);
  REQUIRE(opened);
  Journal& journal = opened.value();
  for (int k = 1; k <= kRows; ++k) REQUIRE(journal.Append({Probe(k)}, Joints()));
  REQUIRE(journal.Mark(7, true, false));
  REQUIRE(journal.Decide({50, 100}, true, 1800000000000));
  REQUIRE(journal.RecordMonitorRestart(1, "model"));
  REQUIRE(journal.RecordMonitorRestart(1, "person"));
  JournalRow imported = Probe(kRows + 1);
  imported.source = JournalRow::Source::kImport;
  REQUIRE(journal.AppendImport({imported}, Joints(), "measured.csv", 99, false));
}

void WriteBytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

/// Every value of every table, as any program that knows no checksums reads it.
std::string AllValues(const std::string& path) {
  std::string text;
  auto opened = sqlite::Database::Open(path, sqlite::Database::Mode::kRead);
  if (!opened) return "cannot be opened";
  for (const char* table :
       {"measurement", "epoch", "import", "monitor_restart", "quarantine_decision", "lost_rows"}) {
    sqlite::Statement rows(opened.value().get(), fmt::format("SELECT * FROM {}", table));
    int code = SQLITE_ROW;
    while ((code = rows.Step()) == SQLITE_ROW) {
      for (int column = 0; column < 40; ++column) text += rows.Text(column) + "|";
      text += "\n";
    }
    text += fmt::format("{}: {}\n", table, code);
  }
  return text;
}

/// Overwrites the value of one row without a new checksum, as a failing disk would.
void ChangeBehindItsBack(const std::string& path, const char* sql) {
  auto database = sqlite::Database::Open(path, sqlite::Database::Mode::kWrite);
  REQUIRE(database);
  REQUIRE(database.value().Run(sql));
}

}  // namespace

TEST_CASE("a sector of zeros anywhere in a journal: no change goes unnoticed") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/journal.sqlite";
  WriteJournal(path);
  const std::string whole = FileText(path), damaged = folder.path() + "/damaged.sqlite";
  const std::string values = AllValues(path);
  REQUIRE(whole.size() > 100 * kSector);
  int changed = 0, unnoticed = 0, accepted = 0;
  // Whole sectors, and places where a write was torn.
  for (std::size_t offset = 0; offset + kSector <= whole.size(); offset += kSector / 2 + 3) {
    std::string bytes = whole;
    std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(offset), kSector, '\0');
    std::filesystem::remove(damaged + "-wal");
    std::filesystem::remove(damaged + "-shm");
    WriteBytes(damaged, bytes);
    if (AllValues(damaged) == values) continue;
    ++changed;
    WriteBytes(damaged, bytes);
    auto journal = Journal::Open(damaged);
    if (!journal) continue;
    INFO("offset " << offset);
    ++unnoticed;
    accepted += journal.value().Append({Probe(999)}, Joints()) ? 1 : 0;
    CHECK(journal.value().Check().intact() == false);
  }
  CHECK(changed > 100);
  CHECK(unnoticed == 0);
  CHECK(accepted == 0);
}

TEST_CASE(
    "a changed, a lost and a foreign row are reported by number; the last row is not forgotten") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/journal.sqlite";
  WriteJournal(path);
  CHECK(Journal::OpenForReading(path).value().Check().intact());
  CHECK(Journal::OpenForReading(path).value().Check().rows == kRows + 1);

  ChangeBehindItsBack(path, "UPDATE measurement SET z_mm = z_mm + 1 WHERE id IN (4, 17)");
  ChangeBehindItsBack(path, "DELETE FROM measurement WHERE id BETWEEN 60 AND 62 OR id > 200");
  ChangeBehindItsBack(path, "UPDATE monitor_restart SET after_row = 3 WHERE id = 2");
  ChangeBehindItsBack(path, "UPDATE measurement SET checksum = NULL WHERE id = 90");
  const auto refused = Journal::Open(path);
  REQUIRE_FALSE(refused);
  CHECK_THAT(refused.error(),
             Catch::Contains("rows 4, 17, 90 changed since written, or unreadable") &&
                 Catch::Contains("rows 60 to 62, 201 to 202 missing") &&
                 Catch::Contains("row 2 of the table monitor_restart") &&
                 Catch::Contains("plumbline journal salvage"));
  const auto read = Journal::OpenForReading(path).value().Read({}, Joints());
  REQUIRE_FALSE(read);
  CHECK_THAT(read.error(), Catch::Contains("row 4 was changed since it was written"));
}

TEST_CASE("the drift monitor's mark and a decision do not give a damaged row a right checksum") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/journal.sqlite";
  WriteJournal(path);
  auto journal = Journal::Open(path);
  REQUIRE(journal);
  ChangeBehindItsBack(path, "UPDATE measurement SET x_mm = 0 WHERE id IN (5, 150)");
  CHECK_FALSE(journal.value().Mark(5, true, true));
  CHECK_FALSE(journal.value().Decide({150}, true, 1800000000000));
  CHECK(journal.value().Check().damaged == std::vector<RowRange>{{5, 5}, {150, 150}});
}

TEST_CASE("salvage keeps every intact row under its number, and records which are lost") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/journal.sqlite";
  WriteJournal(path);
  const auto untouched = SalvageJournal(path, 1800000000000);
  REQUIRE_FALSE(untouched);
  CHECK_THAT(untouched.error(), Catch::Contains("is intact; there is nothing to salvage"));

  std::string bytes = FileText(path);
  std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() / 2), 3 * 4096, '\0');
  WriteBytes(path, bytes);
  ChangeBehindItsBack(path, "UPDATE epoch SET utc_s = 17");
  const auto salvaged = SalvageJournal(path, 1800000000000);
  INFO((salvaged ? "" : salvaged.error()));
  REQUIRE(salvaged);
  CHECK(salvaged->saved > kRows / 2);
  CHECK(salvaged->saved < kRows + 1);
  CHECK(salvaged->damaged_file == folder.path() + "/journal.damaged-1800000000.sqlite");
  CHECK(std::filesystem::exists(salvaged->damaged_file));

  auto journal = Journal::Open(path);
  REQUIRE(journal);
  CHECK(journal->EpochUtc_s() == 1800000000);  // from the probes' times
  const auto rows = journal.value().Read({.rows = JournalFilter::Rows::kAll}, Joints());
  REQUIRE(rows);
  CHECK(static_cast<std::int64_t>(rows->size()) == salvaged->saved);
  for (const JournalRow& row : *rows) CHECK(*row.t_s == static_cast<double>(row.id));
  std::int64_t lost = 0;
  for (const RowRange& range : journal.value().Check().lost) lost += range.last - range.first + 1;
  CHECK(lost + salvaged->saved == kRows + 1);
  CHECK(*journal.value().Append({Probe(1)}, Joints()) == kRows + 2);
}

TEST_CASE("salvage without an epoch and without a row from which to compute it") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/journal.sqlite";
  {
    auto journal = Journal::Open(path);
    REQUIRE(journal);
    JournalRow row;
    row.source = JournalRow::Source::kImport;
    row.q = model::JointVector::Zero(2);
    REQUIRE(journal.value().Append({row}, std::vector<model::Joint>(2)));
  }
  ChangeBehindItsBack(path, "DELETE FROM epoch");
  const auto salvaged = SalvageJournal(path, 1800000000000);
  INFO((salvaged ? "" : salvaged.error()));
  REQUIRE(salvaged);
  CHECK(salvaged->saved == 1);
  CHECK(Journal::Open(path));
}

TEST_CASE("the salvaged journal has the mode of the damaged one, whose copy is not overwritten") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/journal.sqlite";
  WriteJournal(path);
  const auto mode = std::filesystem::perms{0660};
  std::filesystem::permissions(path, mode);
  ChangeBehindItsBack(path, "UPDATE measurement SET x_mm = 0 WHERE id = 5");
  const auto first = SalvageJournal(path, 1800000000000);
  INFO((first ? "" : first.error()));
  REQUIRE(first);
  CHECK(std::filesystem::status(path).permissions() == mode);
  const std::string kept = FileText(first->damaged_file);
  ChangeBehindItsBack(path, "UPDATE measurement SET x_mm = 0 WHERE id = 6");
  CHECK_FALSE(SalvageJournal(path, 1800000000000));  // in the same second
  CHECK(FileText(first->damaged_file) == kept);
  CHECK(std::filesystem::exists(path));
  CHECK_FALSE(std::filesystem::exists(path + ".salvaged"));
}

namespace {

/// Appends a row before each statement of another connection.
struct Intruder {
  Journal journal;
  int appended = 0;
};

int AppendBefore(unsigned /*kind*/, void* self, void* /*statement*/, void* /*sql*/) {
  auto* const intruder = static_cast<Intruder*>(self);
  intruder->appended += intruder->journal.Append({Probe(999)}, Joints()) ? 1 : 0;
  return 0;
}

}  // namespace

TEST_CASE("rows that are recorded during the check are no damage") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/journal.sqlite";
  WriteJournal(path);
  auto opened = Journal::Open(path);
  REQUIRE(opened);
  Intruder intruder{std::move(opened).value()};
  auto database = sqlite::Database::Open(path, sqlite::Database::Mode::kRead);
  REQUIRE(database);
  REQUIRE(AddChecksumFunction(database.value()));
  sqlite3_trace_v2(database.value().get(), SQLITE_TRACE_STMT, &AppendBefore, &intruder);
  const IntegrityReport report = CheckIntegrity(database.value(), {});
  INFO(DamageText(report));
  CHECK(report.intact());
  CHECK(intruder.appended > 3);
}

}  // namespace plumbline::integrity_test
