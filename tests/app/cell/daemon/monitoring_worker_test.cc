// The monitoring worker, between events from the control cycle and a journal that others lock.
#include "app/cell/daemon/monitoring_worker.h"

#include <sys/resource.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <future>
#include <mutex>

#include "app/base/sqlite/database.h"
#include "app/cell/journal/salvage.h"
#include "drivers/files/text_file.h"
#include "tests/app/temporary_folder.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::monitoring_worker_test {

using namespace plumbline::cell;
using namespace std::chrono_literals;
using plumbline::test::TemporaryFolder;

namespace {

enum class Storage { kUnwatched, kWatched };

/// A worker with its folder and its log.
struct Working {
  TemporaryFolder folder;
  CycleMailboxes mailboxes;
  std::mutex mutex;
  std::string log;
  log::LogSink sink = [this](const log::LogEntry& entry) {
    const std::lock_guard lock(mutex);
    log += entry.text + "\n";
  };
  StateStorage storage{folder.path(), sink};
  MonitoringWorker worker;

  config::DaemonConfig config;
  cell::ModelState models;

  explicit Working(const config::MonitoringConfig& monitoring = {},
                   Storage watched = Storage::kUnwatched)
      : worker(
            mailboxes, sink, [] {}, watched == Storage::kWatched ? &storage : nullptr) {
    if (watched == Storage::kWatched) REQUIRE_FALSE(storage.Acquire());
    config.monitoring = monitoring;
    config.machine.cell = test::HeavyArm();
    config.state_directory = folder.path();
    config.monitoring.enabled = true;
    models.applied = models.declared = 1;
    models.history = {1};
    worker.Configure(config, models);
    worker.Start();
    REQUIRE(Eventually([this] { return Recording(); }));
  }

  void Press(std::uint32_t number, int joints = test::HeavyArm().robot.size()) {
    CycleEvent event;
    event.probe.by_gauge = true;
    event.probe.gauge_m = 1e-4;
    event.probe.q = model::JointVector::Zero(joints);
    event.model_version = 1;
    event.gauge_press = number;
    mailboxes.queue.Push(event);
  }
  void Probe(const Vec3& residual_m = Vec3::Zero(), bool quarantined = false, double radius_m = 0) {
    CycleEvent event;
    event.probe.measured_W = residual_m;
    event.probe.quarantined = quarantined;
    event.probe.radius_m = radius_m;
    event.probe.q = model::JointVector::Zero(test::HeavyArm().robot.size());
    event.model_version = 1;
    mailboxes.queue.Push(event);
  }
  std::string File() const { return folder.path() + "/journal.sqlite"; }
  status::MonitoringStatus Status() const { return *mailboxes.monitoring.Read(); }
  std::uint32_t Quarantined() const { return mailboxes.monitoring.Read()->quarantined; }
  bool Recording() const { return mailboxes.monitoring.Read()->recording; }
  std::uint32_t Recorded() const { return mailboxes.monitoring.Read()->probes; }
  bool Logged(const std::string& words) {
    const std::lock_guard lock(mutex);
    return log.find(words) != std::string::npos;
  }
  int Times(const std::string& words) {
    const std::lock_guard lock(mutex);
    int times = 0;
    for (auto at = log.find(words); at != std::string::npos; at = log.find(words, at + 1)) {
      ++times;
    }
    return times;
  }

  static bool Eventually(const std::function<bool()>& what) {
    for (const auto end = std::chrono::steady_clock::now() + 60s; !what();) {
      if (std::chrono::steady_clock::now() > end) return false;
      std::this_thread::sleep_for(10ms);
    }
    return true;
  }
};

/// The journal, locked by another program.
sqlite::Database LockedJournal(const Working& working) {
  auto held = sqlite::Database::Open(working.folder.path() + "/journal.sqlite",
                                     sqlite::Database::Mode::kWrite);
  REQUIRE(held);
  REQUIRE(held.value().Run("BEGIN EXCLUSIVE"));
  return std::move(held).value();
}

}  // namespace

TEST_CASE("a wait for the cycle ends when an event is pushed, or was pushed before") {
  CycleEventQueue queue;
  queue.Wake();
  queue.Wait(1h);  // at once
  auto waiting = std::async(std::launch::async, [&queue] { queue.Wait(1h); });
  CHECK(waiting.wait_for(50ms) == std::future_status::timeout);
  queue.Push({});
  CHECK(waiting.wait_for(60s) == std::future_status::ready);
  CHECK(queue.Front() != nullptr);
  queue.Wait(1ms);  // times out
}

TEST_CASE("while a probe waits for a journal that cannot be written, no more are taken") {
  Working working;
  {
    const sqlite::Database locked = LockedJournal(working);
    working.Probe();
    CHECK(Working::Eventually([&] { return !working.Recording(); }));
    CHECK(working.Logged("journal: "));
    CHECK(working.Recorded() == 0);
  }
  CHECK(Working::Eventually([&] { return working.Recording(); }));
  CHECK(working.Recorded() == 1);
  CHECK(working.Logged("journal works again"));
}

TEST_CASE("a press counts as recorded only when the journal has its row") {
  Working working;
  GaugeMailbox& gauges = working.mailboxes.gauges;
  {
    const sqlite::Database locked = LockedJournal(working);
    working.Press(7);
    CHECK(Working::Eventually([&] { return !working.Recording(); }));
    CHECK(gauges.taken == 0);
  }
  CHECK(Working::Eventually([&] { return gauges.taken == 7; }));
  CHECK(gauges.dropped == 0);
  CHECK(Working::Eventually([&] { return working.Recorded() == 1; }));
  working.Press(8, 3);  // of another arm
  CHECK(Working::Eventually([&] { return gauges.taken == 8; }));
  CHECK(gauges.dropped == 8);
}

TEST_CASE("a journal that is moved away keeps its rows, and a new one is created") {
  Working working;
  working.Probe();
  REQUIRE(Working::Eventually([&] { return working.Recorded() == 1; }));
  const std::string file = working.folder.path() + "/journal.sqlite";
  const std::string moved = working.folder.path() + "/moved.sqlite";
  std::filesystem::rename(file, moved);
  working.Probe();  // into the new one
  CHECK(Working::Eventually([&] { return working.Recorded() == 2; }));
  CHECK(working.Logged("journal.sqlite: was moved or deleted while it was open"));
  CHECK(working.Logged("journal works again"));
  working.worker.Stop();
  for (const std::string& one : {file, moved}) {
    auto journal = cell::Journal::OpenForReading(one);
    INFO(one << ": " << (journal ? "" : journal.error()));
    REQUIRE(journal);
    CHECK(*journal.value().Count() == 1);
  }
}

namespace {

/// Limits the size of every file of this process to a few bytes: as with a quota, writes fail while
/// the file system reports free space.
class NoFileGrows {
 public:
  NoFileGrows() : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    rlimit small = before_;
    small.rlim_cur = 512;
    setrlimit(RLIMIT_FSIZE, &small);
  }
  ~NoFileGrows() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  NoFileGrows(const NoFileGrows&) = delete;
  NoFileGrows& operator=(const NoFileGrows&) = delete;

 private:
  void (*handler_)(int);
  rlimit before_{};
};

}  // namespace

TEST_CASE("a write that fails while the file system shows room: storage is reported as lost") {
  Working working({}, Storage::kWatched);
  {
    const NoFileGrows no_file_grows;
    working.Probe();
    CHECK(Working::Eventually([&] { return working.Status().storage_unavailable; }));
    CHECK(working.Recorded() == 0);
  }
  CHECK(Working::Eventually([&] { return !working.Status().storage_unavailable; }));
  CHECK(Working::Eventually([&] { return working.Recorded() == 1; }));
  CHECK(working.Logged("state directory cannot be written: "));
  CHECK(working.Logged("File too large; make room on its disk"));
  CHECK(
      Working::Eventually([&] { return working.Logged("state directory can be written again"); }));
}

TEST_CASE("probes that could not be written before the shutdown are logged as lost") {
  Working working;
  const sqlite::Database locked = LockedJournal(working);
  working.Probe();
  working.Probe();
  REQUIRE(Working::Eventually([&] { return !working.Recording(); }));
  working.worker.Stop();
  CHECK(working.Logged(
      "2 of the last probes that were acknowledged to the PLC could not be written"));
}

TEST_CASE("a journal that cannot be read completely leaves no half-initialised monitor") {
  config::MonitoringConfig monitoring;
  monitoring.reference_probes = 0;
  monitoring.diagnose = false;
  monitoring.probes_before_diagnosis = 1;
  Working working(monitoring);
  for (int k = 0; k < 12; ++k) working.Probe(Vec3(0, 0, 0.02));
  REQUIRE(Working::Eventually(
      [&] { return working.Recorded() == 12 && working.Status().drift_alarm; }));
  auto other = sqlite::Database::Open(working.File(), sqlite::Database::Mode::kWrite);
  REQUIRE(other);
  REQUIRE(other.value().Run("UPDATE measurement SET q = '[]' WHERE id = 12"));
  working.config.monitoring.diagnose = true;  // of an alarm that the rows before it would raise
  working.worker.Configure(working.config, working.models);
  CHECK(Working::Eventually([&] { return working.Status().fault; }));
  CHECK_FALSE(working.Status().drift_alarm);
  CHECK_FALSE(working.Status().recording);
  CHECK_FALSE(working.Logged("diagnosis"));
  REQUIRE(other.value().Run("UPDATE measurement SET q = (SELECT q FROM measurement LIMIT 1)"));
  CHECK(Working::Eventually([&] { return working.Status().drift_alarm; }));
  CHECK(working.Logged("journal works again"));
}

TEST_CASE("a quarantined probe is recorded, but excluded from monitoring until it is accepted") {
  config::MonitoringConfig monitoring;
  monitoring.reference_probes = 0;
  monitoring.diagnose = false;
  Working working(monitoring);
  const Vec3 off_m(0, 0, 0.4);
  for (int k = 0; k < 12; ++k) working.Probe(off_m, true);
  REQUIRE(
      Working::Eventually([&] { return working.Recorded() == 12 && working.Quarantined() == 12; }));
  CHECK(working.Status().quarantined > 0);
  CHECK_FALSE(working.Status().drift_alarm);
  CHECK(working.mailboxes.monitoring.Read()->residual_m.isZero());
  CHECK(working.mailboxes.monitoring.Read()->drift_statistic == 0);
  CHECK(working.Logged("probe quarantined: row 1 of the journal is (0.0, 0.0, 400.0) mm"));
  CHECK_FALSE(working.Logged("row 2 of the journal"));  // logged once

  auto person = cell::Journal::Open(working.File());
  REQUIRE(person);
  REQUIRE(person.value().Decide({1, 2}, false, 0));
  REQUIRE(Working::Eventually([&] { return working.Quarantined() == 10; }));
  CHECK_FALSE(working.Status().drift_alarm);
  REQUIRE(person.value().Decide({3, 4, 5, 6, 7, 8, 9, 10, 11, 12}, true, 0));
  REQUIRE(Working::Eventually([&] { return working.Status().drift_alarm; }));
  CHECK(working.Quarantined() == 0);
  CHECK(working.Status().quarantined == 0);
  CHECK(Working::Eventually([&] { return working.Logged("probes were accepted or rejected"); }));
  CHECK(working.Logged("drift alarm: the residual of probes changed"));
}

TEST_CASE("once [monitoring] is disabled, the journal's status is no longer reported") {
  config::MonitoringConfig monitoring;
  monitoring.diagnose = false;
  Working working(monitoring);
  working.Probe(Vec3(0, 0, 0.4), true);
  REQUIRE(Working::Eventually([&] { return working.Quarantined() == 1; }));
  const sqlite::Database locked = LockedJournal(working);
  working.Probe();
  REQUIRE(Working::Eventually([&] { return working.Status().fault; }));
  working.config.monitoring.enabled = false;
  working.worker.Configure(working.config, working.models);
  CHECK(Working::Eventually(
      [&] { return !working.Status().fault && working.Status().quarantined == 0; }));
  CHECK(working.Quarantined() == 0);
}

TEST_CASE("a decision on quarantined probes restarts a running diagnosis") {
  const TemporaryFolder programs;
  const std::string program = programs.path() + "/plumbline";
  std::ofstream(program) << "#!/bin/sh\nexec sleep 600\n";
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  REQUIRE(setenv("PLUMBLINE_PROGRAM", program.c_str(), 1) == 0);
  config::MonitoringConfig monitoring;
  monitoring.reference_probes = 0;
  monitoring.probes_before_diagnosis = 1;
  Working working(monitoring);
  {
    auto store = cell::ModelStore::Open(working.folder.path());
    REQUIRE(store);
    const auto cell = files::ReadTextFile("tests/virtual_cell/demo/cockpit-cell.toml");
    REQUIRE(cell);
    REQUIRE(store.value().Declare(*cell, "cell.toml"));
  }
  working.Probe(Vec3(0, 0, 0.4), true);
  for (int k = 0; k < 12; ++k) working.Probe(Vec3(0, 0, 0.02));
  REQUIRE(Working::Eventually([&] { return working.Logged("diagnosis started over"); }));
  REQUIRE(Working::Eventually([&] { return working.Recorded() == 13; }));
  auto person = cell::Journal::Open(working.File());
  REQUIRE(person);
  REQUIRE(person.value().Decide({1}, false, 0));
  CHECK(Working::Eventually(
      [&] { return working.Logged("diagnosis stopped: probes were accepted or"); }));
  CHECK(Working::Eventually(
      [&] { return working.Logged("probes were accepted or rejected, 0 wait"); }));
  CHECK(Working::Eventually([&] { return working.Times("diagnosis started over") == 2; }));
  working.worker.Stop();
  unsetenv("PLUMBLINE_PROGRAM");
}

TEST_CASE("a decision is reported even if the journal cannot be reread at once") {
  config::MonitoringConfig monitoring;
  monitoring.diagnose = false;
  Working working(monitoring);
  working.Probe(Vec3(0, 0, 0.4), true);
  working.Probe();
  REQUIRE(Working::Eventually([&] { return working.Recorded() == 2; }));
  auto person = cell::Journal::Open(working.File());
  REQUIRE(person);
  auto other = sqlite::Database::Open(working.File(), sqlite::Database::Mode::kWrite);
  REQUIRE(other);
  REQUIRE(other.value().Run("UPDATE measurement SET q = '[]' WHERE id = 2"));
  REQUIRE(person.value().Decide({1}, false, 0));
  REQUIRE(Working::Eventually([&] { return working.Status().fault; }));
  CHECK_FALSE(working.Logged("probes were accepted or rejected"));
  REQUIRE(other.value().Run("UPDATE measurement SET q = (SELECT q FROM measurement LIMIT 1)"));
  CHECK(Working::Eventually(
      [&] { return working.Logged("probes were accepted or rejected, 0 wait"); }));
  CHECK(Working::Eventually([&] { return working.Recording(); }));
}

TEST_CASE("decisions that cannot be read are a journal fault, which clears by itself") {
  Working working;
  auto other = sqlite::Database::Open(working.File(), sqlite::Database::Mode::kWrite);
  REQUIRE(other);
  REQUIRE(other.value().Run("ALTER TABLE quarantine_decision RENAME TO elsewhere"));
  CHECK(Working::Eventually([&] { return working.Status().fault; }));
  REQUIRE(other.value().Run("ALTER TABLE elsewhere RENAME TO quarantine_decision"));
  CHECK(Working::Eventually([&] { return !working.Status().fault; }));
  CHECK(Working::Eventually([&] { return working.Logged("journal works again"); }));
}

TEST_CASE(
    "a reference whose probes disagree is refused: drift is not monitored, and rows are listed") {
  config::MonitoringConfig monitoring;
  monitoring.reference_probes = 10;
  monitoring.diagnose = false;
  Working working(monitoring);
  for (int k = 0; k < 10; ++k) working.Probe(k % 2 == 0 ? Vec3(0, 0, 0) : Vec3(0, 5e-3, 0));
  REQUIRE(Working::Eventually([&] { return working.Status().reference_refused; }));
  CHECK_FALSE(working.Status().learning);
  CHECK(
      working.Logged("reference refused: its 10 probes, rows 1 to 10, disagree; they scatter by"));
  CHECK(working.Logged("command 8"));
  CHECK_FALSE(working.Logged("drift monitor has its reference"));
  for (int k = 0; k < 30; ++k) working.Probe(Vec3(0, 0, 0.02));
  REQUIRE(Working::Eventually([&] { return working.Recorded() == 40; }));
  CHECK_FALSE(working.Status().drift_alarm);

  CycleEvent restart;
  restart.monitor_restart = true;
  working.mailboxes.queue.Push(restart);
  REQUIRE(Working::Eventually([&] { return working.Status().learning; }));
  CHECK_FALSE(working.Status().reference_refused);
  for (int k = 0; k < 10; ++k) working.Probe();
  REQUIRE(Working::Eventually([&] { return working.Logged("drift monitor has its reference"); }));
  CHECK_FALSE(working.Status().reference_refused);
}

TEST_CASE(
    "a reference that contradicts the stated radius: a finding that survives reload and restart") {
  config::MonitoringConfig monitoring;
  monitoring.reference_probes = 20;
  Working working(monitoring);
  const Vec3 off(0, 42e-3, 0);
  for (int k = 0; k < 20; ++k) working.Probe(off, false, 3e-3);
  REQUIRE(Working::Eventually([&] { return working.Status().radius_contradicted; }));
  CHECK_FALSE(working.Status().drift_alarm);
  CHECK(
      working.Logged("probes contradict the stated 95 % radius: the mean residual of the "
                     "reference, journal rows 1 to 20, is (0.000, 42.000, 0.000) mm"));
  CHECK(working.Logged("the radius stated there is 3.000 mm"));
  CHECK(Working::Eventually(
      [&] { return working.Logged("diagnosis started over 20 measured points"); }));

  working.worker.Configure(working.config, working.models);
  CHECK(Working::Eventually(
      [&] { return working.Times("probes contradict the stated 95 % radius") == 2; }));
  CHECK(working.Status().radius_contradicted);

  // A new reference is being learned: nothing supports the radius yet, also after a restart.
  CycleEvent restart;
  restart.monitor_restart = true;
  working.mailboxes.queue.Push(restart);
  REQUIRE(Working::Eventually([&] { return working.Status().learning; }));
  CHECK(working.Status().radius_contradicted);
  working.worker.Configure(working.config, working.models);
  working.Probe(Vec3::Zero(), false, 3e-3);
  REQUIRE(Working::Eventually([&] { return working.Recorded() == 21; }));
  CHECK(working.Status().radius_contradicted);
  for (int k = 1; k < 20; ++k) working.Probe(Vec3(0, 2.9e-3, 0), false, 3e-3);
  REQUIRE(Working::Eventually([&] { return working.Recorded() == 40; }));
  CHECK(Working::Eventually([&] { return !working.Status().radius_contradicted; }));
}

TEST_CASE("a contradicted radius stays contradicted while the journal cannot be read") {
  config::MonitoringConfig monitoring;
  monitoring.reference_probes = 20;
  monitoring.diagnose = false;
  Working working(monitoring);
  for (int k = 0; k < 20; ++k) working.Probe(Vec3(0, 42e-3, 0), false, 3e-3);
  REQUIRE(Working::Eventually([&] { return working.Status().radius_contradicted; }));
  {
    auto other = sqlite::Database::Open(working.File(), sqlite::Database::Mode::kWrite);
    REQUIRE(other);
    REQUIRE(other.value().Run("UPDATE measurement SET x_mm = 7 WHERE id = 2"));
  }
  working.worker.Configure(working.config, working.models);
  REQUIRE(Working::Eventually([&] { return working.Status().fault; }));
  CHECK_FALSE(working.Recording());
  CHECK(working.Status().radius_contradicted);
}

TEST_CASE("no probe is recorded in a damaged journal, until it was salvaged") {
  Working working;
  for (int k = 0; k < 3; ++k) working.Probe();
  REQUIRE(Working::Eventually([&] { return working.Recorded() == 3; }));
  {
    auto other = sqlite::Database::Open(working.File(), sqlite::Database::Mode::kWrite);
    REQUIRE(other);
    REQUIRE(other.value().Run("UPDATE measurement SET x_mm = 7 WHERE id = 2"));
  }
  working.worker.Configure(working.config, working.models);  // a reload
  REQUIRE(Working::Eventually([&] { return working.Status().fault; }));
  CHECK(working.Logged("row 2 changed since written"));
  CHECK(working.Logged("plumbline journal salvage"));
  CHECK_FALSE(working.Recording());
  const auto salvaged = cell::SalvageJournal(working.File(), 1);
  INFO((salvaged ? "" : salvaged.error()));
  REQUIRE(salvaged);
  CHECK(salvaged->saved == 2);
  CHECK(Working::Eventually([&] { return working.Recording(); }));
  working.Probe();
  CHECK(Working::Eventually([&] { return working.Recorded() == 4; }));
  auto journal = cell::Journal::OpenForReading(working.File());
  REQUIRE(journal);
  CHECK(*journal.value().LastRow() == 4);
}

TEST_CASE("the recording status is settled only after the first attempt to open the journal") {
  const CycleMailboxes mailboxes;
  CHECK_FALSE(mailboxes.monitoring.Read()->settled);
  const Working working;
  CHECK(working.mailboxes.monitoring.Read()->settled);
}

TEST_CASE(
    "a model that moves a configured point too far needs approval, whatever the probes show") {
  cell::ModelFacts facts;
  facts.verdict = "explained";
  facts.rms_before_mm = 2;
  facts.rms_after_mm = 0.1;
  facts.change_mm = 0.3;  // at the probes, with nothing carried
  config::MonitoringConfig monitoring;
  monitoring.max_change_m = 1e-3;
  CHECK(AutomaticApplyObjection(facts, monitoring, false).empty());
  CHECK(AutomaticApplyObjection(facts, monitoring, true).find("configured points is not known") !=
        std::string::npos);
  facts.points_change_mm = 7.65;
  CHECK(AutomaticApplyObjection(facts, monitoring, true) ==
        "it moves a configured point by 7.650 mm, monitoring.max_change_mm is 1");
  facts.points_change_mm = 0.9;
  CHECK(AutomaticApplyObjection(facts, monitoring, true).empty());
}

}  // namespace plumbline::monitoring_worker_test
