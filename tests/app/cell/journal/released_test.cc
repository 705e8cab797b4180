// The journal as version 0.1.0 writes it, read by the present code: nothing is lost.
#include "tests/app/released.h"

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "app/cell/journal/journal.h"
#include "app/cell/journal/journal_schema.h"
#include "firmware-like/geometry/units.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::released_test {

using namespace plumbline::cell;
using namespace plumbline::test;
using Source = JournalRow::Source;

namespace {

/// Joints of the arm in the dumps.
std::vector<model::Joint> TwoJoints() {
  std::vector<model::Joint> joints(2);
  joints[1].type = model::JointType::kPrismatic;
  return joints;
}

void CheckProbe(const JournalRow& row) {
  CHECK(row.id == 1);
  CHECK(row.source == Source::kPlc);
  CHECK(row.unix_ms == 1763710200123);
  CHECK(row.t_s == 12.125);
  CHECK(row.session == "left station");
  CHECK(row.command == 17);
  CHECK(row.q[0] == Approx(30.25 * kRadPerDeg));
  CHECK(row.q[1] == Approx(0.125));
  CHECK(row.qd.size() == 0);
  CHECK(row.tau[1] == -7.25);
  CHECK(row.payload_kg == 60);
  CHECK(row.temp_C == 23.5);
  CHECK(row.predicted_W->isApprox(Vec3(1.2, -0.4, 0.9)));
  CHECK(row.measured_W->isApprox(Vec3(1.2005, -0.40025, 0.901)));
  CHECK(row.model_version == 1);
  CHECK_FALSE(row.wild);
  CHECK_FALSE(row.alarm);
  CHECK(*row.q_step_rad == Approx(0.001));
}

void CheckMarkedProbe(const JournalRow& row) {
  CHECK(row.t_s == 72.625);
  CHECK(row.session.empty());
  CHECK(row.command == 18);
  CHECK(row.q[0] == Approx(-90.5 * kRadPerDeg));
  CHECK(row.tau.size() == 0);
  CHECK_FALSE(row.payload_kg);
  CHECK_FALSE(row.temp_C);
  CHECK(row.wild);
  CHECK(row.alarm);
}

void CheckImported(const JournalRow& row) {
  CHECK(row.source == Source::kImport);
  CHECK_FALSE(row.unix_ms);
  CHECK(row.t_s == 137.5);  // its own clock
  CHECK(row.session ==
        "calib boot 00000001");  // and its own name, even if it resembles a boot mark
  CHECK_FALSE(row.command);
  CHECK(row.qd[1] == Approx(0.0625));
  CHECK(row.qdd[0] == Approx(-22.625 * kRadPerDeg));
  CHECK(row.payload_kg == 0);
  CHECK(row.range_m == 2.5);
  CHECK_FALSE(row.predicted_W);
  CHECK(row.orientation_W->isApprox(Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5)));
  CHECK_FALSE(row.model_version);
}

void CheckCameraProbe(const JournalRow& row) {
  CHECK(row.source == Source::kCamera);
  CHECK(row.t_s == 132);
  REQUIRE(row.covariance_W);
  CHECK((*row.covariance_W)(0, 0) == Approx(1e-8));
  CHECK((*row.covariance_W)(1, 0) == Approx(2.5e-9));
  CHECK(row.camera == "side+rear");
}

void CheckTouch(const JournalRow& row) {
  CHECK(row.artefact == "dial");
  CHECK(*row.gauge_m == Approx(-1.25e-4));
  CHECK(*row.sigma_m == Approx(2e-5));
  CHECK_FALSE(row.measured_W);
}

void CheckGaugePress(const JournalRow& row) {
  CHECK(row.source == Source::kGauge);
  CHECK(row.artefact == "dial");
  CHECK(*row.gauge_m == Approx(2.5e-4));
  CHECK_FALSE(row.command);
}

void CheckNumbers(const JournalRow& row) {
  CHECK(row.tool_number == 2);
  CHECK(row.payload_item == 7);
  CHECK(row.payload_kg == 60);
}

void CheckQuarantined(Journal& journal) {
  JournalFilter filter;
  filter.rows = JournalFilter::Rows::kWaiting;
  const auto rows = journal.Read(filter, TwoJoints());
  REQUIRE(rows);
  REQUIRE(rows->size() == 1);
  CHECK(*journal.Waiting() == 1);
  CHECK(rows->front().id == 6);
}

}  // namespace

TEST_CASE("the journal of version 0.1.0 opens, loses nothing, and works") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/journal.sqlite";
  WriteReleased("cell/journal", kJournalSchema, path);
  constexpr std::int64_t kCount = kJournalSchema + 1;
  CHECK(Journal::OpenForReading(path).ok());
  for (int opening = 1; opening <= 2; ++opening) {
    auto journal = Journal::Open(path);
    INFO((journal ? "" : journal.error()));
    REQUIRE(journal);
    CHECK(*journal.value().Count() == kCount);
    const auto rows = journal.value().Read({}, TwoJoints());
    REQUIRE(rows);
    CheckProbe((*rows)[0]);
    CheckMarkedProbe((*rows)[1]);
    CheckImported((*rows)[2]);
    CheckImported((*rows)[3]);
    CheckCameraProbe((*rows)[4]);
    CheckQuarantined(journal.value());
    CheckTouch((*rows)[5]);
    CheckGaugePress((*rows)[6]);
    CheckNumbers((*rows)[7]);
    CHECK(*(*rows)[8].predicted_radius_m == Approx(2e-3));
    const auto imported = journal.value().ImportedAs(0xfedcba9876543210u);
    REQUIRE(imported);
    CHECK(*imported == "measured.csv");
    const auto restart = journal.value().LastRestart(), model = journal.value().LastModel();
    REQUIRE((restart && model && *restart && *model));
    CHECK((*restart)->after_row == kCount);
    CHECK((*model)->model_version == 3);
  }
  auto journal = Journal::Open(path);
  JournalRow next;
  next.q = model::JointVector::Zero(2);
  CHECK(*journal.value().Append({next}, TwoJoints()) == kCount + 1);
}

TEST_CASE("a journal of a development version is refused with a remedy, and left unchanged") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/journal.sqlite";
  WriteReleased("cell/journal", kJournalSchema, path);
  SetSchema(path, kJournalSchema - 1);
  const std::string before = FileText(path);
  for (const bool to_read : {false, true}) {
    const auto journal = to_read ? Journal::OpenForReading(path) : Journal::Open(path);
    REQUIRE_FALSE(journal);
    CHECK_THAT(journal.error(),
               Catch::Contains("before 0.1.0") && Catch::Contains("move the file away"));
  }
  CHECK(FileText(path) == before);
}

TEST_CASE("a journal of a newer version is refused with a remedy, and left unchanged") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/journal.sqlite";
  WriteReleased("cell/journal", kJournalSchema, path);
  SetSchema(path, kJournalSchema + 1);
  const std::string before = FileText(path);
  for (const bool to_read : {false, true}) {
    const auto journal = to_read ? Journal::OpenForReading(path) : Journal::Open(path);
    REQUIRE_FALSE(journal);
    CHECK_THAT(journal.error(), Catch::Contains("written by a newer plumbline") &&
                                    Catch::Contains("install that version again"));
  }
  CHECK(FileText(path) == before);
}

}  // namespace plumbline::released_test
