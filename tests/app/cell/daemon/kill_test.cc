// kill -9 at the worst moments: acknowledged probes are in the journal, and exactly one model is in
// force.
#include <sys/wait.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>

#include "app/cell/journal/journal.h"
#include "app/cell/model_store/model_store.h"
#include "tests/app/cell/daemon/daemon_process.h"
#include "tests/app/cell/daemon/demo_config.h"
#include "tests/virtual_cell/running_cell.h"

namespace plumbline::kill_test {

using namespace plumbline::test;
using virtual_cell::Eventually;
using virtual_cell::RegisterClient;
using virtual_cell::RunningCell;

namespace {

virtual_cell::VirtualCellOptions Idle() {
  return {.profile = virtual_cell::Profile::kUr, .idle = true};
}

std::string Config(const RunningCell& cell, const std::string& state) {
  return WithLine(DemoConfig(cell.robot(), "universal-robots-fine"), "", "state_directory",
                  "\"" + state + "\"") +
         "\n[monitoring]\nenabled = true\nreference_probes = 0\ndiagnose = false\n";
}

std::int64_t IntegerIn(const std::string& file, const char* sql) {
  auto database = sqlite::Database::Open(file, sqlite::Database::Mode::kRead);
  REQUIRE(database.ok());
  return *database.value().IntegerOf(sql);
}

/// `plumbline model apply N`, killed after a while; nullopt: not killed.
void Apply(int version, const std::string& state,
           std::optional<std::chrono::microseconds> killed_after) {
  const std::string number = std::to_string(version);
  const pid_t pid = fork();
  if (pid == 0) {
    if (freopen("/dev/null", "w", stdout) == nullptr) _exit(126);
    execl(PLUMBLINE, PLUMBLINE, "model", "apply", number.c_str(), "--state", state.c_str(),
          nullptr);
    _exit(127);
  }
  if (killed_after) {
    std::this_thread::sleep_for(*killed_after);
    kill(pid, SIGKILL);
  }
  int status = 0;
  waitpid(pid, &status, 0);
  if (!killed_after) CHECK(status == 0);
}

}  // namespace

TEST_CASE("a daemon killed while it writes probes has recorded each one that it acknowledged") {
  RunningCell cell(Idle());
  const TemporaryFolder state;
  const std::string journal_file = state.path() + "/journal.sqlite";
  const std::string config = Config(cell, state.path());
  RegisterClient tracker("tracker", cell.tracker(), 1, 10);
  REQUIRE(Eventually([&] { return tracker.Read(0, 16).Word(13) == 1; }));
  const auto seen = tracker.Read(0, 16);
  const std::vector<double> tip_mm = {seen.Float(0), seen.Float(2), seen.Float(4)};
  std::uint16_t sequence = 0;
  std::int64_t kept = 0;
  for (int round = 0; round < 6; ++round) {
    DaemonProcess daemon(config);
    RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
    INFO(daemon.Log());
    REQUIRE(Eventually([&] { return (plc.Read(400, 20).Word(0) & 1) != 0; }));
    REQUIRE(Eventually([&] { return plc.Read(2000, 20).Word(2) == 0; }));  // a point is valid
    const std::uint32_t before = static_cast<std::uint32_t>(plc.Read(404, 2).Long(0));
    std::uint32_t told = before;
    for (int probe = 0; probe < 5 + 7 * round; ++probe) {  // as fast as it answers
      std::vector<std::uint16_t> words = {6, 0};
      for (const std::uint16_t word : virtual_cell::WordsFromFloats(tip_mm)) words.push_back(word);
      words.resize(40);
      words[39] = ++sequence;
      plc.Write(1000, words);
      REQUIRE(Eventually([&] { return plc.Read(100, 40).Word(1) == sequence; }));
      told = static_cast<std::uint32_t>(plc.Read(404, 2).Long(0));
    }
    daemon.Signal(SIGKILL);  // the last probes may be on their way to the disk
    CHECK(daemon.Wait() == 128 + SIGKILL);

    auto journal = cell::Journal::Open(journal_file);
    REQUIRE(journal.ok());
    const auto rows = journal.value().Read({}, std::vector<model::Joint>(6));
    REQUIRE(rows.ok());
    CHECK(static_cast<std::int64_t>(rows->size()) >= kept + told - before);
    for (const cell::JournalRow& row : *rows) {
      CHECK(row.predicted_W);
      CHECK(row.measured_W);
      CHECK(row.model_version == 1);
    }
    CHECK(IntegerIn(journal_file,
                    "SELECT count(*) FROM pragma_integrity_check "
                    "WHERE integrity_check <> 'ok'") == 0);
    kept = static_cast<std::int64_t>(rows->size());
  }
  CHECK(kept > 50);
}

TEST_CASE("model apply, killed at any moment, leaves the old version in force or the new one") {
  const TemporaryFolder folder;
  const std::string state = folder.path() + "/state";
  const std::string text = FileText("tests/virtual_cell/demo/cockpit-cell.toml");
  auto store = cell::ModelStore::Open(state);
  REQUIRE(store.ok());
  REQUIRE(store.value().Declare(text, "cell.toml").value() == 1);
  REQUIRE(store.value().Propose(text + "\n# another\n", {}, "").value() == 2);
  int old_ones = 0, new_ones = 0;
  int in_force = 1;
  for (int round = 0; round < 80; ++round) {
    const int wanted = 3 - in_force;
    // From before the program runs to after its end.
    const bool left_alone = round % 20 == 19;
    Apply(wanted, state,
          left_alone ? std::nullopt : std::optional(std::chrono::microseconds(250 * round)));
    auto opened = cell::ModelStore::Open(state);
    REQUIRE(opened.ok());
    const auto now = opened.value().State();
    INFO((now ? "" : now.error()));
    REQUIRE(now.ok());
    REQUIRE((now->applied == in_force || now->applied == wanted));
    CHECK(now->history.back() == now->applied);
    REQUIRE(opened.value().Text(now->applied).ok());
    ++(now->applied == wanted ? new_ones : old_ones);
    in_force = now->applied;
  }
  CHECK(old_ones > 0);
  CHECK(new_ones > 0);
  CHECK(store.value().Versions().value().size() == 2);
}

TEST_CASE("a daemon killed while it loads a model starts with the applied one") {
  RunningCell cell(Idle());
  const TemporaryFolder state;
  const std::string config = Config(cell, state.path());
  int in_force = 1;
  for (int round = 0; round < 5; ++round) {
    {
      DaemonProcess daemon(config);
      RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
      INFO(daemon.Log());
      REQUIRE(Eventually([&] { return plc.Read(400, 20).Word(1) == in_force; }));
      auto store = cell::ModelStore::Open(state.path());
      REQUIRE(store.ok());
      if (round == 0) {
        const std::string text = store.value().Text(1).value();
        REQUIRE(store.value().Propose(text + "\n# another\n", {}, "").value() == 2);
      }
      in_force = 3 - in_force;
      Apply(in_force, state.path(), std::nullopt);  // notifies the daemon
      std::this_thread::sleep_for(std::chrono::milliseconds(3 * round));
      daemon.Signal(SIGKILL);
      CHECK(daemon.Wait() == 128 + SIGKILL);
    }
    DaemonProcess again(config);
    RegisterClient plc("plumblined", again.Plc(), 1, 10);
    INFO(again.Log());
    CHECK(Eventually([&] { return plc.Read(400, 20).Word(1) == in_force; }));
    CHECK(cell::ModelStore::Open(state.path())->State()->applied == in_force);
    CHECK(Eventually([&] { return (plc.Read(400, 20).Word(0) & 1) != 0; }));  // probes are recorded
  }
}

}  // namespace plumbline::kill_test
