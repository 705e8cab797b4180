// The journal's thread, between what the cycle hands over and a journal that another program holds.
#include "app/daemon/loop_worker.h"

#include <sys/resource.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <future>
#include <mutex>

#include "app/config/text_file.h"
#include "app/sqlite/database.h"
#include "tests/app/temporary_folder.h"
#include "tests/firmware-like/test_cell.h"

using namespace plumbline;
using namespace std::chrono_literals;
using plumbline::test::TemporaryFolder;

namespace {

enum class Storage { kUnwatched, kWatched };

/// A worker with its folder, and what it told.
struct Working {
  TemporaryFolder folder;
  LoopLink link;
  std::mutex mutex;
  std::string told;
  LogSink sink = [this](const LogEntry& entry) {
    const std::lock_guard lock(mutex);
    told += entry.text + "\n";
  };
  StateStorage storage{folder.path(), sink};
  LoopWorker worker;

  DaemonConfig config;
  ModelState models;

  explicit Working(const LoopConfig& loop = {}, Storage watched = Storage::kUnwatched)
      : worker(
            link, sink, [] {}, watched == Storage::kWatched ? &storage : nullptr) {
    if (watched == Storage::kWatched) REQUIRE_FALSE(storage.Take());
    config.loop = loop;
    config.machine.cell = test::HeavyArm();
    config.state_directory = folder.path();
    config.loop.enabled = true;
    models.applied = models.declared = 1;
    models.history = {1};
    worker.Configure(config, models);
    worker.Start();
    REQUIRE(Comes([this] { return Recording(); }));
  }

  void Probe(const Vec3& residual_m = Vec3::Zero(), bool quarantined = false) {
    LoopEvent event;
    event.probe.measured_W = residual_m;
    event.probe.quarantined = quarantined;
    event.probe.q = JointVector::Zero(test::HeavyArm().robot.size());
    event.model_version = 1;
    link.queue.Push(event);
  }
  std::string File() const { return folder.path() + "/journal.sqlite"; }
  MonitoringStatus Status() const { return *link.monitoring.Read(); }
  std::uint32_t Quarantined() const { return link.monitoring.Read()->quarantined; }
  bool Recording() const { return link.monitoring.Read()->recording; }
  std::uint32_t Recorded() const { return link.monitoring.Read()->probes; }
  bool Told(const std::string& words) {
    const std::lock_guard lock(mutex);
    return told.find(words) != std::string::npos;
  }
  int Times(const std::string& words) {
    const std::lock_guard lock(mutex);
    int times = 0;
    for (auto at = told.find(words); at != std::string::npos; at = told.find(words, at + 1)) {
      ++times;
    }
    return times;
  }

  static bool Comes(const std::function<bool()>& what) {
    for (const auto end = std::chrono::steady_clock::now() + 60s; !what();) {
      if (std::chrono::steady_clock::now() > end) return false;
      std::this_thread::sleep_for(10ms);
    }
    return true;
  }
};

/// The journal as another program holds it.
Database Held(const Working& working) {
  auto held = Database::Open(working.folder.path() + "/journal.sqlite", Database::Mode::kWrite);
  REQUIRE(held);
  REQUIRE(held.value().Run("BEGIN EXCLUSIVE"));
  return std::move(held).value();
}

}  // namespace

TEST_CASE("a wait for the cycle ends when something is handed over, or was before") {
  LoopQueue queue;
  queue.Wake();
  queue.Wait(1h);  // at once
  auto waiting = std::async(std::launch::async, [&queue] { queue.Wait(1h); });
  CHECK(waiting.wait_for(50ms) == std::future_status::timeout);
  queue.Push({});
  CHECK(waiting.wait_for(60s) == std::future_status::ready);
  CHECK(queue.Front() != nullptr);
  queue.Wait(1ms);  // ends without anything, too
}

TEST_CASE("while a probe waits for a journal that cannot be written, no more are taken") {
  Working working;
  {
    const Database held = Held(working);
    working.Probe();
    CHECK(Working::Comes([&] { return !working.Recording(); }));
    CHECK(working.Told("journal: "));
    CHECK(working.Recorded() == 0);
  }
  CHECK(Working::Comes([&] { return working.Recording(); }));
  CHECK(working.Recorded() == 1);
  CHECK(working.Told("journal works again"));
}

TEST_CASE("a journal that is moved away keeps what it had, and a new one is begun") {
  Working working;
  working.Probe();
  REQUIRE(Working::Comes([&] { return working.Recorded() == 1; }));
  const std::string file = working.folder.path() + "/journal.sqlite";
  const std::string moved = working.folder.path() + "/moved.sqlite";
  std::filesystem::rename(file, moved);
  working.Probe();  // into the new one
  CHECK(Working::Comes([&] { return working.Recorded() == 2; }));
  CHECK(working.Told("journal.sqlite: was moved or deleted while it was open"));
  CHECK(working.Told("journal works again"));
  working.worker.Stop();
  for (const std::string& one : {file, moved}) {
    auto journal = Journal::OpenForReading(one);
    INFO(one << ": " << (journal ? "" : journal.error()));
    REQUIRE(journal);
    CHECK(*journal.value().Count() == 1);
  }
}

namespace {

/// No file of this process grows beyond a few bytes: as with a quota, a write fails, while the file
/// system shows room.
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
    CHECK(Working::Comes([&] { return working.Status().storage_unavailable; }));
    CHECK(working.Recorded() == 0);
  }
  CHECK(Working::Comes([&] { return !working.Status().storage_unavailable; }));
  CHECK(Working::Comes([&] { return working.Recorded() == 1; }));
  CHECK(working.Told("state directory cannot be written: "));
  CHECK(working.Told("File too large; make room on its disk"));
  CHECK(Working::Comes([&] { return working.Told("state directory can be written again"); }));
}

TEST_CASE("probes that could not be written until the end are told as lost") {
  Working working;
  const Database held = Held(working);
  working.Probe();
  working.Probe();
  REQUIRE(Working::Comes([&] { return !working.Recording(); }));
  working.worker.Stop();
  CHECK(working.Told("2 of the last probes that the PLC was told as taken could not be written"));
}

TEST_CASE("a journal that cannot be read to its end leaves no monitor that has seen half of it") {
  LoopConfig loop;
  loop.reference_probes = 0;
  loop.diagnose = false;
  loop.probes_before_diagnosis = 1;
  Working working(loop);
  for (int k = 0; k < 12; ++k) working.Probe(Vec3(0, 0, 0.02));
  REQUIRE(Working::Comes([&] { return working.Recorded() == 12 && working.Status().drift_alarm; }));
  auto other = Database::Open(working.File(), Database::Mode::kWrite);
  REQUIRE(other);
  REQUIRE(other.value().Run("UPDATE measurement SET q = '[]' WHERE id = 12"));
  working.config.loop.diagnose = true;  // of an alarm that the rows before it would raise
  working.worker.Configure(working.config, working.models);
  CHECK(Working::Comes([&] { return working.Status().fault; }));
  CHECK_FALSE(working.Status().drift_alarm);
  CHECK_FALSE(working.Status().recording);
  CHECK_FALSE(working.Told("diagnosis"));
  REQUIRE(other.value().Run("UPDATE measurement SET q = (SELECT q FROM measurement LIMIT 1)"));
  CHECK(Working::Comes([&] { return working.Status().drift_alarm; }));
  CHECK(working.Told("journal works again"));
}

TEST_CASE("a quarantined probe is kept, and neither watched nor a residual, until it is accepted") {
  LoopConfig loop;
  loop.reference_probes = 0;
  loop.diagnose = false;
  Working working(loop);
  const Vec3 off_m(0, 0, 0.4);
  for (int k = 0; k < 12; ++k) working.Probe(off_m, true);
  REQUIRE(Working::Comes([&] { return working.Recorded() == 12 && working.Quarantined() == 12; }));
  CHECK(working.Status().quarantined > 0);
  CHECK_FALSE(working.Status().drift_alarm);
  CHECK(working.link.monitoring.Read()->residual_m.isZero());
  CHECK(working.link.monitoring.Read()->drift_statistic == 0);
  CHECK(working.Told("probe quarantined: row 1 of the journal is (0.0, 0.0, 400.0) mm"));
  CHECK_FALSE(working.Told("row 2 of the journal"));  // once

  auto person = Journal::Open(working.File());
  REQUIRE(person);
  REQUIRE(person.value().Decide({1, 2}, false, 0));
  REQUIRE(Working::Comes([&] { return working.Quarantined() == 10; }));
  CHECK_FALSE(working.Status().drift_alarm);
  REQUIRE(person.value().Decide({3, 4, 5, 6, 7, 8, 9, 10, 11, 12}, true, 0));
  REQUIRE(Working::Comes([&] { return working.Status().drift_alarm; }));
  CHECK(working.Quarantined() == 0);
  CHECK(working.Status().quarantined == 0);
  CHECK(Working::Comes([&] { return working.Told("probes were accepted or rejected"); }));
  CHECK(working.Told("drift alarm: the residual of probes changed"));
}

TEST_CASE("once [loop] is switched off, nothing of its journal is reported") {
  LoopConfig loop;
  loop.diagnose = false;
  Working working(loop);
  working.Probe(Vec3(0, 0, 0.4), true);
  REQUIRE(Working::Comes([&] { return working.Quarantined() == 1; }));
  const Database held = Held(working);
  working.Probe();
  REQUIRE(Working::Comes([&] { return working.Status().fault; }));
  working.config.loop.enabled = false;
  working.worker.Configure(working.config, working.models);
  CHECK(
      Working::Comes([&] { return !working.Status().fault && working.Status().quarantined == 0; }));
  CHECK(working.Quarantined() == 0);
}

TEST_CASE("a decision over probes ends the diagnosis that runs without them, and it starts again") {
  const TemporaryFolder programs;
  const std::string program = programs.path() + "/plumbline";
  std::ofstream(program) << "#!/bin/sh\nexec sleep 600\n";
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  REQUIRE(setenv("PLUMBLINE_PROGRAM", program.c_str(), 1) == 0);
  LoopConfig loop;
  loop.reference_probes = 0;
  loop.probes_before_diagnosis = 1;
  Working working(loop);
  {
    auto store = ModelStore::Open(working.folder.path());
    REQUIRE(store);
    const auto cell = ReadTextFile("tests/virtual_cell/demo/cockpit-cell.toml");
    REQUIRE(cell);
    REQUIRE(store.value().Declare(*cell, "cell.toml"));
  }
  working.Probe(Vec3(0, 0, 0.4), true);
  for (int k = 0; k < 12; ++k) working.Probe(Vec3(0, 0, 0.02));
  REQUIRE(Working::Comes([&] { return working.Told("diagnosis started over"); }));
  REQUIRE(Working::Comes([&] { return working.Recorded() == 13; }));
  auto person = Journal::Open(working.File());
  REQUIRE(person);
  REQUIRE(person.value().Decide({1}, false, 0));
  CHECK(Working::Comes([&] { return working.Told("diagnosis ended: probes were accepted or"); }));
  CHECK(Working::Comes([&] { return working.Told("probes were accepted or rejected, 0 wait"); }));
  CHECK(Working::Comes([&] { return working.Times("diagnosis started over") == 2; }));
  working.worker.Stop();
  unsetenv("PLUMBLINE_PROGRAM");
}

TEST_CASE("a decision is reported also where the journal cannot be read at once") {
  LoopConfig loop;
  loop.diagnose = false;
  Working working(loop);
  working.Probe(Vec3(0, 0, 0.4), true);
  working.Probe();
  REQUIRE(Working::Comes([&] { return working.Recorded() == 2; }));
  auto person = Journal::Open(working.File());
  REQUIRE(person);
  auto other = Database::Open(working.File(), Database::Mode::kWrite);
  REQUIRE(other);
  REQUIRE(other.value().Run("UPDATE measurement SET q = '[]' WHERE id = 2"));
  REQUIRE(person.value().Decide({1}, false, 0));
  REQUIRE(Working::Comes([&] { return working.Status().fault; }));
  CHECK_FALSE(working.Told("probes were accepted or rejected"));
  REQUIRE(other.value().Run("UPDATE measurement SET q = (SELECT q FROM measurement LIMIT 1)"));
  CHECK(Working::Comes([&] { return working.Told("probes were accepted or rejected, 0 wait"); }));
  CHECK(Working::Comes([&] { return working.Recording(); }));
}

TEST_CASE("decisions that cannot be read are a fault of the journal, which ends by itself") {
  Working working;
  auto other = Database::Open(working.File(), Database::Mode::kWrite);
  REQUIRE(other);
  REQUIRE(other.value().Run("ALTER TABLE quarantine_decision RENAME TO elsewhere"));
  CHECK(Working::Comes([&] { return working.Status().fault; }));
  REQUIRE(other.value().Run("ALTER TABLE elsewhere RENAME TO quarantine_decision"));
  CHECK(Working::Comes([&] { return !working.Status().fault; }));
  CHECK(Working::Comes([&] { return working.Told("journal works again"); }));
}

TEST_CASE(
    "a reference of probes that disagree is refused: no drift is watched, and rows are named") {
  LoopConfig loop;
  loop.reference_probes = 10;
  loop.diagnose = false;
  Working working(loop);
  for (int k = 0; k < 10; ++k) working.Probe(k % 2 == 0 ? Vec3(0, 0, 0) : Vec3(0, 5e-3, 0));
  REQUIRE(Working::Comes([&] { return working.Status().reference_refused; }));
  CHECK_FALSE(working.Status().learning);
  CHECK(working.Told("reference refused: its 10 probes, rows 1 to 10, disagree; they scatter by"));
  CHECK(working.Told("command 8"));
  CHECK_FALSE(working.Told("drift monitor has its reference"));
  for (int k = 0; k < 30; ++k) working.Probe(Vec3(0, 0, 0.02));
  REQUIRE(Working::Comes([&] { return working.Recorded() == 40; }));
  CHECK_FALSE(working.Status().drift_alarm);

  LoopEvent restart;
  restart.monitor_restart = true;
  working.link.queue.Push(restart);
  REQUIRE(Working::Comes([&] { return working.Status().learning; }));
  CHECK_FALSE(working.Status().reference_refused);
  for (int k = 0; k < 10; ++k) working.Probe();
  REQUIRE(Working::Comes([&] { return working.Told("drift monitor has its reference"); }));
  CHECK_FALSE(working.Status().reference_refused);
}

TEST_CASE("whether probes are recorded is known only once the journal was opened, or not") {
  const LoopLink link;
  CHECK_FALSE(link.monitoring.Read()->settled);
  const Working working;
  CHECK(working.link.monitoring.Read()->settled);
}

TEST_CASE(
    "a model that moves a configured point too far waits for a person, whatever the probes say") {
  ModelFacts facts;
  facts.verdict = "explained";
  facts.rms_before_mm = 2;
  facts.rms_after_mm = 0.1;
  facts.change_mm = 0.3;  // at the probes, with nothing carried
  LoopConfig loop;
  loop.max_change_m = 1e-3;
  CHECK(WhyNotAutomatic(facts, loop, false).empty());
  CHECK(WhyNotAutomatic(facts, loop, true).find("configured points is not known") !=
        std::string::npos);
  facts.points_change_mm = 7.65;
  CHECK(WhyNotAutomatic(facts, loop, true) ==
        "it moves a configured point by 7.650 mm, loop.max_change_mm is 1");
  facts.points_change_mm = 0.9;
  CHECK(WhyNotAutomatic(facts, loop, true).empty());
}
