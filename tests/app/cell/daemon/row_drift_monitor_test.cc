// Which rows of the journal the drift monitor compares, and what it logs about them.
#include "app/cell/daemon/row_drift_monitor.h"

#include <catch2/catch.hpp>
#include <string>

#include "tests/app/temporary_folder.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::row_drift_monitor_test {

using namespace plumbline::cell;
using plumbline::test::TemporaryFolder;
using Source = cell::JournalRow::Source;

namespace {

/// A monitor with the model as reference, and what it logged.
struct Monitored {
  std::vector<std::string> log;
  RowDriftMonitor monitor;

  explicit Monitored(int reference_probes = 0)
      : monitor(
            ConfigWith(reference_probes),
            [this](const log::LogEntry& entry) { log.push_back(entry.text); }, [] {}) {}

  static config::MonitoringConfig ConfigWith(int reference_probes) {
    config::MonitoringConfig config;
    config.reference_probes = reference_probes;
    return config;
  }
};

cell::JournalRow Row(std::int64_t id, const Vec3& residual_m, const std::string& camera = "") {
  cell::JournalRow row;
  row.id = id;
  row.source = camera.empty() ? Source::kPlc : Source::kCamera;
  row.camera = camera;
  row.measured_W = residual_m;
  row.predicted_W = Vec3::Zero();
  row.q = model::JointVector::Zero(test::HeavyArm().robot.size());
  row.model_version = 1;
  return row;
}

}  // namespace

TEST_CASE("probes of one camera are monitored, and each other camera is logged once") {
  Monitored m;
  CHECK(m.monitor.Update(Row(1, Vec3::Zero()), false));  // by the PLC
  CHECK(m.monitor.Update(Row(2, Vec3::Zero(), "side"), false));
  CHECK_FALSE(m.monitor.Update(Row(3, Vec3::Zero(), "rear"), true));
  CHECK(m.log.empty());  // replayed
  CHECK_FALSE(m.monitor.Update(Row(4, Vec3::Zero(), "rear"), false));
  CHECK_FALSE(m.monitor.Update(Row(5, Vec3::Zero(), "rear"), false));
  CHECK(m.log == std::vector<std::string>{
                     "probes by camera rear are recorded, but not monitored for drift: the "
                     "reference was taken by camera side"});
  CHECK(m.monitor.drift().probes() == 2);
  m.monitor.Restart();
  CHECK(m.monitor.Update(Row(6, Vec3::Zero(), "rear"), false));
}

TEST_CASE("a row without a measurement or a prediction is not monitored") {
  Monitored m;
  cell::JournalRow row = Row(1, Vec3::Zero());
  row.predicted_W.reset();
  CHECK_FALSE(m.monitor.Update(row, false));
  row = Row(2, Vec3::Zero());
  row.measured_W.reset();
  CHECK_FALSE(m.monitor.Update(row, false));
  CHECK(m.monitor.drift().probes() == 0);
}

TEST_CASE("the alarm names its row and the median shift of the rows that contributed") {
  const TemporaryFolder folder;
  const std::vector<model::Joint> joints = test::HeavyArm().robot.joints;
  auto opened = cell::Journal::Open(folder.path() + "/journal.sqlite");
  REQUIRE(opened);
  cell::Journal journal = std::move(opened).value();
  Monitored m;
  CHECK(m.monitor.alarm_row() == 0);
  for (int k = 0; k < 30 && !m.monitor.drift().alarm(); ++k) {
    cell::JournalRow row = Row(0, Vec3(0, 0, 0.02));
    const Result<std::int64_t> id = journal.Append({row}, joints);
    REQUIRE(id);
    row.id = *id;
    const auto verdict = m.monitor.Update(row, false);
    REQUIRE(verdict);
    CHECK(verdict->raised == m.monitor.drift().alarm().has_value());
    if (verdict->raised) CHECK(m.monitor.alarm_row() == *id);
  }
  REQUIRE(m.monitor.drift().alarm());
  const log::LogEntry entry = m.monitor.AlarmEntry(journal, joints, 1);
  CHECK(entry.event == log::Event::kDriftAlarm);
  CHECK_THAT(
      entry.text,
      Catch::StartsWith("drift alarm: the residual of probes changed by (0.000, 0.000, "
                        "20.000) mm within the last ") &&
          Catch::EndsWith("; row " + std::to_string(m.monitor.alarm_row()) + " of the journal"));
  m.monitor.Restart();
  CHECK(m.monitor.alarm_row() == 0);
}

TEST_CASE("the reference is logged when it is learned, with its rows when it is refused") {
  Monitored good(5);
  for (int k = 1; k <= 5; ++k) {
    const auto verdict = good.monitor.Update(Row(k, Vec3(1e-3, 0, 0)), false);
    REQUIRE(verdict);
    CHECK(verdict->reference_complete == (k == 5));
  }
  const log::LogEntry learned = good.monitor.ReferenceEntry();
  CHECK(learned.event == log::Event::kReferenceLearned);
  CHECK_THAT(learned.text, Catch::StartsWith("drift monitor has its reference: residual (1.000, "
                                             "0.000, 0.000) mm, scatter "));

  Monitored bad(5);
  for (int k = 1; k <= 5; ++k) {
    const bool far = k > 2;  // three of five: more outliers than a sound reference has
    const auto verdict = bad.monitor.Update(Row(10 + k, Vec3(far ? 1e-2 * k : 0, 0, 0)), false);
    REQUIRE(verdict);
    CHECK(verdict->reference_complete == (k == 5));
  }
  REQUIRE(bad.monitor.drift().reference_refused());
  const log::LogEntry refused = bad.monitor.ReferenceEntry();
  CHECK(refused.event == log::Event::kReferenceRefused);
  CHECK_THAT(refused.text,
             Catch::StartsWith("drift monitor's reference refused: its 5 probes, rows 11 to 15, "
                               "disagree; "));
  CHECK_FALSE(bad.monitor.Update(Row(16, Vec3::Zero()), false));
}

TEST_CASE("a contradiction from before, now that the model is the reference: no rows to name") {
  Monitored m(0);
  m.monitor.SetRadiusContradicted(true);
  CHECK(m.monitor.radius_contradicted());
  CHECK_FALSE(m.monitor.contradicted_by_reference());
  CHECK(m.monitor.ReferenceRows() == "no journal rows");
}

}  // namespace plumbline::row_drift_monitor_test
