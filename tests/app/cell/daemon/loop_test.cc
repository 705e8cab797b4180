// Monitoring end to end over real sockets: probes, drift alarm, diagnosis, proposal, applied model.
//
// The virtual cell has an undeclared compliance of joint 2. The diagnosis itself is not tested
// here: a script replaces it, which writes the correct answer or misbehaves.
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <new>
#include <thread>

#include "app/base/service/utc_clock.h"
#include "app/cell/daemon/reload.h"
#include "app/cell/journal/journal.h"
#include "app/cell/model_store/model_store.h"
#include "drivers/clock.h"
#include "firmware-like/snapshot.h"
#include "tests/app/cell/daemon/daemon_process.h"
#include "tests/app/cell/daemon/demo_config.h"
#include "tests/drivers/gauge/fake_gauge.h"
#include "tests/virtual_cell/running_cell.h"

namespace plumbline::loop_test {

using namespace plumbline::test;
using virtual_cell::Eventually;
using virtual_cell::Profile;
using virtual_cell::RegisterClient;
using virtual_cell::RunningCell;
using virtual_cell::VirtualCellOptions;

namespace {

VirtualCellOptions Idle() {
  return {.profile = Profile::kUr, .idle = true, .time_scale = 4};
}

/// Script that replaces `plumbline diagnose CELL MEASURED --json D --write-model C --report R`.
constexpr const char* kTrueAnswer = R"script(#!/bin/sh
set -e
[ "$1" = diagnose ] && [ "$4" = --json ] && [ "${10}" = --time-zero ] && [ "${12}" = --order-unknown ] && [ "$6" = --write-model ] && [ "$8" = --report ]
head -1 "$3" | grep -q '^session,t_s,q1_deg,.*,payload_kg,.*x_mm,y_mm,z_mm$'
cat "$2" - > "$7" <<END
[[effect]]
id = "joint_compliance"
scope = ["q2"]
parameters = [ { name = "q2", value = 2e-6, sd = 1e-9, unit = "rad/(N m)" } ]
END
echo '<html>' > "$9"
cat > "$5" <<END
{"schema": 1, "verdict": "explained", "effects": [{"id": "joint_compliance", "scope": ["q2"]}],
 "rivals": [], "drivers": [],
 "rms_mm": {"before": 9, "after": 0.05, "before_held_out": 9, "after_held_out": 0.05}}
END
)script";

struct Options {
  std::string loop;  ///< further lines of [monitoring]
  std::string script = kTrueAnswer;
  std::string profile = "universal-robots-fine";
  bool artefacts = false;  ///< the cell has a ball and a dial gauge
};

std::string LoopConfigText(const std::string& robot, const std::string& loop,
                           const std::string& profile = "universal-robots-fine") {
  std::string text = PatientConfig(robot, profile);
  if (profile == "universal-robots") {  // it reports no payload
    text = WithLine(text, "payload", "source", "\"fixed\"\nmass_kg = 60.0");
  }
  return text +
         "\n[monitoring]\nenabled = true\nsession = \"day 1\"\nreference_probes = 0\n"
         "probes_before_diagnosis = 8\n" +
         loop;
}

/// Makes the next daemon run the script.
class StandIn {
 public:
  explicit StandIn(const std::string& script) : path_(folder_.path() + "/plumbline") {
    std::ofstream(path_) << script;
    chmod(path_.c_str(), 0755);
    setenv("PLUMBLINE_PROGRAM", path_.c_str(), 1);
  }
  const std::string& folder() const { return folder_.path(); }

 private:
  TemporaryFolder folder_;
  std::string path_;
};

/// The demo's cell with a ball and a dial gauge.
class CellWithArtefacts {
 public:
  CellWithArtefacts() : path_(folder_.path() + "/cell.toml") {
    std::ofstream(path_) << WithLine("\n" + FileText("tests/virtual_cell/demo/cockpit-cell.toml"),
                                     "", "schema", "2")
                         << "\n[[artefact]]\nname = \"ball\"\nkind = \"point\"\n"
                            "\n[[artefact]]\nname = \"dial\"\nkind = \"gauge\"\n";
  }
  std::string In(const std::string& config) const {
    return WithLine(config, "", "cell", "\"" + path_ + "\"");
  }

 private:
  TemporaryFolder folder_;
  std::string path_;
};

struct Station {
  StandIn stand_in;
  CellWithArtefacts with_artefacts;
  RunningCell cell;
  DaemonProcess daemon;
  RegisterClient plc, tracker;
  std::uint16_t sequence = 100;

  explicit Station(const Options& options = {})
      : stand_in(options.script),
        cell(Idle(),
             virtual_cell::Effects({virtual_cell::EffectFromText("joint_compliance:q2=2e-6")})),
        daemon(ConfigText(options)),
        plc("plumblined", daemon.Plc(), 1, 10),
        tracker("tracker", cell.tracker(), 1, 10) {
    REQUIRE(cell.Tell("payload 60") == "ok");
    INFO(daemon.Log());
    REQUIRE(Eventually([&] { return Recording() && plc.Read(330, 2).Float(0) == 60; }));
    REQUIRE(Eventually([&] { return tracker.Read(0, 16).Word(13) == 1; }));
  }

  std::string ConfigText(const Options& options) const {
    const std::string text = LoopConfigText(cell.robot(), options.loop, options.profile);
    return options.artefacts ? with_artefacts.In(text) : text;
  }
  bool Recording() { return (plc.Read(400, 20).Word(0) & 1) != 0; }
  int State() { return plc.Read(400, 20).Word(0); }
  std::string state_directory() const { return daemon.folder() + "/state"; }

  /// Sends a command and waits for its echo. @return  the result code
  int Command(std::vector<std::uint16_t> words) {
    words.resize(40);
    words[39] = ++sequence;
    plc.Write(1000, words);
    INFO(daemon.Log());
    REQUIRE(Eventually([&] { return plc.Read(100, 40).Word(1) == sequence; }));
    return plc.Read(100, 40).Word(2);
  }

  /// Submits the tip that the tracker measures, displaced by `extra_mm` in z.
  /// @return  the command's result code
  int Probe(double extra_mm = 0) {
    const auto seen = tracker.Read(0, 16);
    std::vector<std::uint16_t> words = {6, 0};
    for (const std::uint16_t word :
         virtual_cell::WordsFromFloats({seen.Float(0), seen.Float(2), seen.Float(4) + extra_mm})) {
      words.push_back(word);
    }
    return Command(words);
  }
  void Probes(int count) {
    for (int i = 0; i < count; ++i) {
      const int code = Probe();
      INFO(daemon.Log());
      REQUIRE(code == 0);
    }
  }
  double LastResidual_mm() {
    const auto told = plc.Read(400, 20);
    return std::hypot(told.Float(8), told.Float(10), told.Float(12));
  }
  std::vector<cell::JournalRow> Journal() const {
    auto journal = cell::Journal::OpenForReading(state_directory() + "/journal.sqlite");
    INFO((journal ? "" : journal.error()));
    REQUIRE(journal.ok());
    return journal.value().Read({}, std::vector<model::Joint>(6)).value();
  }
  cell::ModelState Models() const {
    return cell::ModelStore::Open(state_directory())->State().value();
  }
};

/// A daemon with a cell file of its own, which is in force.
struct EditableCell {
  TemporaryFolder folder;
  RunningCell cell{Idle()};
  std::string file = folder.path() + "/cell.toml", state = folder.path() + "/state";
  std::string declared = FileText("tests/virtual_cell/demo/cockpit-cell.toml");
  DaemonProcess daemon;
  RegisterClient plc;

  explicit EditableCell(const std::string& further_points = "")
      : daemon(Config() + further_points), plc("plumblined", daemon.Plc(), 1, 10) {
    INFO(daemon.Log());
    REQUIRE(Eventually([&] { return PointIsValid(); }));
  }

  std::string Config() const {
    std::ofstream(file) << declared;
    const std::string config =
        WithLine(LoopConfigText(cell.robot(), ""), "", "cell", '"' + file + '"');
    return WithLine(config, "", "state_directory", '"' + state + '"');
  }
  bool PointIsValid() { return (plc.Read(2000, 20).Word(1) & 1) != 0; }
  void ReloadWithBaseAt(const std::string& z_mm) const {
    std::ofstream(file) << WithLine(declared, "", "base_xyz_mm", "[0.0, 0.0, " + z_mm + "]");
    daemon.Signal(SIGHUP);
  }
  cell::ModelState Models() const { return cell::ModelStore::Open(state)->State().value(); }
};

int Plumbline(const std::string& arguments) {
  return WEXITSTATUS(system((std::string(PLUMBLINE) + " " + arguments + " > /dev/null").c_str()));
}

}  // namespace

TEST_CASE("from the first probe to a corrected model in force, and back") {
  const double began_s = service::SystemUtcSeconds();
  Station station;
  station.Probes(20);
  INFO(station.daemon.Log());
  REQUIRE(station.daemon.Awaits("version 2 proposed"));
  CHECK(station.daemon.Count("drift alarm") == 1);
  CHECK(station.daemon.Count("diagnosis started") == 1);
  REQUIRE(Eventually([&] { return station.plc.Read(400, 20).Long(4) == 20; }));
  CHECK(station.LastResidual_mm() > 1);
  CHECK((station.State() & 2) != 0);  // alarm
  REQUIRE(Eventually([&] { return (station.State() & 4) != 0; }));
  CHECK((station.plc.Read(14, 1).Word(0) & 0x60) == 0x60);
  CHECK(station.plc.Read(400, 20).Word(1) == 1);
  CHECK(station.plc.Read(400, 20).Word(2) == 2);
  CHECK(std::filesystem::exists(station.state_directory() + "/models/0002.html"));

  auto rows = station.Journal();
  REQUIRE(rows.size() == 20);
  CHECK(rows.front().session == "day 1");
  REQUIRE(rows.back().t_s);
  CHECK(*rows.back().t_s > *rows.front().t_s);
  const double epoch_s =
      plumbline::cell::Journal::OpenForReading(station.state_directory() + "/journal.sqlite")
          .value()
          .EpochUtc_s();
  CHECK(epoch_s + *rows.front().t_s > began_s);
  CHECK(epoch_s + *rows.back().t_s < service::SystemUtcSeconds());
  CHECK(rows.front().payload_kg == 60);
  CHECK(rows.front().model_version == 1);
  CHECK(std::count_if(rows.begin(), rows.end(),
                      [](const cell::JournalRow& r) { return r.alarm; }) == 1);

  REQUIRE(Plumbline("model apply 2 --state " + station.state_directory()) == 0);
  REQUIRE(station.daemon.Awaits("model version 2 in force"));
  REQUIRE(Eventually([&] { return station.plc.Read(400, 20).Word(1) == 2; }));
  REQUIRE(Eventually([&] { return (station.State() & 7) == 1; }));  // no alarm, no proposal
  REQUIRE(Eventually([&] { return (station.plc.Read(2000, 20).Word(1) & 1) != 0; }));
  station.Probes(20);
  REQUIRE(Eventually([&] { return station.plc.Read(400, 20).Long(4) == 40; }));
  CHECK(station.LastResidual_mm() < 0.05);
  CHECK((station.State() & 2) == 0);
  rows = station.Journal();
  REQUIRE(rows.size() == 40);
  CHECK(rows.back().model_version == 2);

  REQUIRE(Plumbline("model rollback --state " + station.state_directory()) == 0);
  REQUIRE(Eventually([&] { return station.plc.Read(400, 20).Word(1) == 1; }));
  REQUIRE(Eventually([&] { return (station.plc.Read(2000, 20).Word(1) & 1) != 0; }));
  station.Probes(1);
  CHECK(Eventually([&] { return station.LastResidual_mm() > 1; }));
}

TEST_CASE(
    "a model is applied automatically only if the configuration allows it, within its limits") {
  struct Case {
    const char* name;
    const char* loop;
    const char* told;
    int applied;
  };
  const Case cases[] = {
      {"ask", "", "`plumbline model apply 2 --state ", 1},
      {"within", "apply = \"automatic\"\nmax_change_mm = 100.0\n", "version 2 applied", 2},
      {"too far", "apply = \"automatic\"\nmax_change_mm = 0.5\n", "monitoring.max_change_mm", 1},
  };
  for (const Case& c : cases) {
    CAPTURE(c.name);
    Station station({.loop = c.loop});
    station.Probes(9);
    INFO(station.daemon.Log());
    REQUIRE(station.daemon.Awaits(c.told));
    CHECK(Eventually([&] { return station.plc.Read(400, 20).Word(1) == c.applied; }));
    CHECK(station.Models().applied == c.applied);
  }
}

TEST_CASE("a model that the daemon cannot use is stored, but never comes into force") {
  std::string script = kTrueAnswer;
  script.replace(script.find("joint_compliance"), 16, "approach_lag");
  script.replace(script.find("value = 2e-6"), 12, "value = 1e-3");
  script.replace(script.find("rad/(N m)"), 9, "1");
  Station station({.loop = "apply = \"automatic\"\nmax_change_mm = 100.0\n", .script = script});
  station.Probes(9);
  INFO(station.daemon.Log());
  REQUIRE(station.daemon.Awaits("not applied: its effect \"approach_lag\""));
  CHECK(Plumbline("model apply 2 --state " + station.state_directory() + " 2> /dev/null") == 1);
  CHECK(station.Models().applied == 1);
}

TEST_CASE("a model that moves points farther than its data explain waits for a person") {
  Station station;
  const std::string where = " --state " + station.state_directory() + " 2> /dev/null";
  {  // as another program would: `plumbline model apply` refuses it
    cell::ModelStore store = cell::ModelStore::Open(station.state_directory()).value();
    std::string text = store.Text(1).value() +
                       "\n[[effect]]\nid = \"base_frame\"\nscope = []\nparameters = [\n"
                       "  { name = \"x\", value = 14.0, unit = \"mm\" } ]\n"
                       "\n[domain]\nq_deg = [";
    for (int joint = 0; joint < 6; ++joint) text += "[-360.0, 360.0], ";
    text += "]\nlargest_residual_mm = 0.5\n";
    REQUIRE(store.Propose(text, {}, "").ok());
    CHECK(Plumbline("model apply 2" + where) == 1);
    CHECK(station.Models().applied == 1);
    REQUIRE(store.Apply(2).ok());
  }
  const auto x_mm = [&] { return station.plc.Read(2000, 20).Float(3); };
  const double before_mm = x_mm();
  station.daemon.Signal(SIGHUP);
  REQUIRE(station.daemon.Awaits("model version 2 is not put in force: point 1 (assembly 1) at "));
  REQUIRE(station.daemon.Awaits(" reloaded"));  // the rest of the configuration
  INFO(station.daemon.Log());
  CHECK(station.daemon.Says("would move by 13.99"));
  CHECK(station.daemon.Says("Version 1 stays in force, also after a restart"));
  CHECK(station.Models().applied == 1);
  CHECK(x_mm() == Approx(before_mm).margin(0.02));
  CHECK(station.plc.Read(400, 20).Word(1) == 1);

  CHECK(Plumbline("model apply 2 --force" + where) == 0);
  REQUIRE(station.daemon.Awaits("model version 2 in force"));
  CHECK(Eventually([&] { return std::abs(x_mm() - before_mm) > 13; }));
  CHECK(Plumbline("model rollback" + where) == 1);  // as far back
  CHECK(station.Models().applied == 2);
  CHECK(Plumbline("model rollback --force" + where) == 0);
  CHECK(Eventually([&] { return std::abs(x_mm() - before_mm) < 0.02; }));
}

TEST_CASE("an edited cell file that costs a point its correction does not come into force") {
  EditableCell edited;
  const DaemonProcess& daemon = edited.daemon;
  edited.ReloadWithBaseAt("9000.0");
  INFO(daemon.Log());
  REQUIRE(daemon.Awaits("model version 2 is not put in force: point 1 (assembly 1) at "));
  REQUIRE(daemon.Awaits(" reloaded"));
  CHECK(daemon.Says("would lose its correction: out of reach"));
  CHECK(
      daemon.Says("Version 1 stays in force, also after a restart. Undo the edit of the cell "
                  "file, or accept it with `plumbline model apply 2 --force --state "));
  CHECK_FALSE(daemon.Says("fitted to"));
  CHECK(edited.PointIsValid());
  CHECK(edited.Models().declared == 2);  // recorded, and not in force
  CHECK(edited.Models().applied == 1);

  SECTION("the edit is undone") {
    edited.ReloadWithBaseAt("0.0");
    REQUIRE(Eventually([&] { return daemon.Count(" reloaded") == 2; }));
    CHECK(edited.Models().declared == 1);
  }
  SECTION("the edit is corrected") {
    edited.ReloadWithBaseAt("0.5");
    REQUIRE(Eventually([&] { return daemon.Count(" reloaded") == 2; }));
    CHECK(edited.Models().applied == 3);
    CHECK_FALSE(daemon.Says("is set aside"));
  }
  CHECK(daemon.Count("is not put in force") == 1);
}

TEST_CASE("a model is refused once, and the fault that prevents the reload is logged") {
  EditableCell edited;
  const DaemonProcess& daemon = edited.daemon;
  const std::string in_force = edited.state + "/models/0001.toml";
  REQUIRE(std::filesystem::remove(in_force));
  SECTION("the version in force is damaged") {
    std::ofstream(in_force) << "no cell";
    edited.ReloadWithBaseAt("9000.0");
    REQUIRE(daemon.Awaits("Configuration not reloaded"));
    INFO(daemon.Log());
    CHECK(daemon.Says("version 1 is in force, but cannot be used"));
    CHECK(edited.Models().applied == 1);
  }
  SECTION("it is missing, so the refused version cannot be withdrawn") {
    edited.ReloadWithBaseAt("9000.0");
    REQUIRE(daemon.Awaits("Configuration not reloaded"));
    INFO(daemon.Log());
    CHECK(
        daemon.Says("Version 1 stays in force, but only until a restart, because version 2 could "
                    "not be withdrawn ("));
    CHECK(daemon.Says("`plumbline model apply 1 --force --state " + edited.state +
                      "` keeps version 1 in force after a restart"));
  }
  CHECK(daemon.Count("is not put in force") == 1);
  CHECK(edited.PointIsValid());
}

TEST_CASE("SIGTERM ends the daemon while it checks a model that is to come into force") {
  std::string many;  // out of reach of the edited cell: each takes tens of milliseconds
  for (int id = 3; id < 500; ++id) {
    many += "\n[[point]]\nid = " + std::to_string(id) + "\nname = \"" + std::to_string(id) +
            "\"\nframe = \"body\"\nxyz_mm = [433.0, -424.0, -76.3]\nrpy_deg = [0.0, 90.0, 0.0]\n"
            "near_deg = [18.5, -83.5, 126.0, 26.0, -46.0, -19.0]\n";
  }
  EditableCell edited(many);
  edited.ReloadWithBaseAt("9000.0");
  REQUIRE(Eventually([&] { return edited.Models().declared == 2; }));
  edited.daemon.Signal(SIGTERM);
  CHECK(edited.daemon.Wait() == 0);
  INFO(edited.daemon.Log());
  CHECK_FALSE(edited.daemon.Says("is not put in force"));  // not decided
  CHECK_FALSE(edited.daemon.Says("not reloaded"));
}

namespace {

/// While it exists, this process can start no thread.
class NoThreads {
 public:
  NoThreads() {
    getrlimit(RLIMIT_NPROC, &before_);
    rlimit none = before_;
    none.rlim_cur = 0;
    setrlimit(RLIMIT_NPROC, &none);
    dropped_ = getuid() == 0 && setresuid(kNobody, kNobody, 0) == 0;  // root has no such limit
  }
  ~NoThreads() {
    if (dropped_ && setresuid(0, 0, 0) != 0) std::abort();
    setrlimit(RLIMIT_NPROC, &before_);
  }
  NoThreads(const NoThreads&) = delete;
  NoThreads& operator=(const NoThreads&) = delete;

 private:
  static constexpr uid_t kNobody = 65534;
  rlimit before_{};
  bool dropped_ = false;
};

}  // namespace

TEST_CASE("a reload that runs out of threads or memory is an error, and the daemon goes on") {
  const auto read = [] { return cell::RunOnThread<int>([] { return 7; }).get(); };
  const auto thrown = cell::RunOnThread<int>([]() -> int { throw std::bad_alloc(); }).get();
  REQUIRE_FALSE(thrown);
  CHECK(thrown.error() == "std::bad_alloc");
  {
    const NoThreads none;
    const auto not_started = read();
    REQUIRE_FALSE(not_started);
    CHECK_THAT(not_started.error(), Catch::Contains("unavailable"));
  }
  CHECK(read().value() == 7);
}

TEST_CASE("a model that is unexplained or does not help is never applied automatically") {
  struct Case {
    const char* name;
    const char* from;
    const char* to;
    const char* told;
    int proposed;
  };
  const Case cases[] = {
      {"ambiguous", "\"explained\"", "\"ambiguous\"", "not applied: the verdict", 2},
      {"nothing held out", "\"before_held_out\": 9", "\"x\": 9", "nothing was held out", 2},
      {"implausible", "\"rivals\": []",
       "\"rivals\": [], \"implausible\": [\"joint_compliance: softer than any gear\"]",
       "not applied: implausible on a healthy machine: joint_compliance: softer than any gear", 2},
      {"unnamed", "\"rivals\": []",
       "\"rivals\": [], \"discrepancy_model\": {\"parameters\": 9.5, \"share_of_correction\": 0.8}",
       "not applied: 80 % of the correction is not explained by a named effect", 2},
      {"worse", "\"after_held_out\": 0.05", "\"after_held_out\": 9.5", "nothing proposed", 0},
      {"no effect", "\"explained\"", "\"no_effect\"", "no effect exceeds the noise", 0},
      {"no verdict", "\"explained\"", "\"perhaps\"", "diagnosis failed", 0},
      {"no answer", "cat > \"$5\"", "cat > /dev/null", "diagnosis failed: diagnosis.json", 0},
      {"a faulty model", "id = \"joint_compliance\"", "id = \"gremlins\"", "has faults", 0},
      {"it fails", "set -e", "echo no rows to fit; exit 1", "exit code 1: no rows to fit", 0},
      {"it crashes", "set -e", "kill -SEGV $$", "signal 11", 0},
  };
  for (const Case& c : cases) {
    CAPTURE(c.name);
    std::string script = kTrueAnswer;
    script.replace(script.find(c.from), std::string(c.from).size(), c.to);
    Station station({.loop = "apply = \"automatic\"\nmax_change_mm = 100.0\n", .script = script});
    station.Probes(12);
    INFO(station.daemon.Log());
    REQUIRE(station.daemon.Awaits(c.told));
    station.Probes(3);  // recording continues
    CHECK(station.Models().applied == 1);
    CHECK(station.Models().proposed == c.proposed);
    CHECK(station.daemon.Count("diagnosis started") == 1);  // once for each alarm
  }
}

TEST_CASE("rows left out of the export for a diagnosis are logged") {
  std::string script = kTrueAnswer;
  const auto check = script.find("head -1 \"$3\"");
  script.erase(check, script.find('\n', check) - check);
  Station station({.loop = "", .script = script});
  const std::string file = station.stand_in.folder() + "/one.csv";
  std::ofstream(file) << "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm\n"
                         "0,-90,90,0,0,0,1500,0,1800\n";
  REQUIRE(Plumbline("journal import " + file + " --cell tests/virtual_cell/demo/cockpit-cell.toml" +
                    " --state " + station.state_directory()) == 0);
  station.Probes(9);
  INFO(station.daemon.Log());
  REQUIRE(station.daemon.Awaits("diagnosis started"));
  CHECK(station.daemon.Says("diagnosis: column t_s: left out, only"));
  CHECK(station.daemon.Says("diagnosis: column payload_kg: left out, only"));
}

TEST_CASE("a diagnosis is stopped after its timeout, and together with the daemon") {
  const std::string endless = "#!/bin/sh\necho $$ > \"$0.pid\"\nsleep 1000 & wait\n";
  const auto pid_of = [](const Station& station) {
    pid_t pid = 0;
    std::ifstream(station.stand_in.folder() + "/plumbline.pid") >> pid;
    return pid;
  };
  const auto group_gone = [](pid_t pid) { return killpg(pid, 0) != 0 && errno == ESRCH; };
  SECTION("too long") {
    Station station({.loop = "diagnosis_timeout_s = 1\n", .script = endless});
    station.Probes(9);
    REQUIRE(station.daemon.Awaits("diagnosis started"));
    REQUIRE(Eventually([&] { return pid_of(station) > 0; }));
    const pid_t pid = pid_of(station);
    CHECK(getpriority(PRIO_PROCESS, static_cast<id_t>(pid)) == 19);
    CHECK(getpgid(pid) == pid);
    REQUIRE(Eventually([&] { return (station.State() & 16) != 0; }));
    CHECK(station.daemon.Awaits("not finished within"));
    CHECK(Eventually([&] { return group_gone(pid); }));
    CHECK(Eventually([&] { return (station.State() & 0x30) == 0x20; }));
  }
  SECTION("SIGTERM") {
    Station station({.loop = "", .script = endless});
    station.Probes(9);
    REQUIRE(Eventually([&] { return pid_of(station) > 0; }));
    station.daemon.Signal(SIGTERM);
    CHECK(station.daemon.Wait() == 0);
    CHECK(Eventually([&] { return group_gone(pid_of(station)); }));
  }
  SECTION("SIGKILL") {
    Station station({.loop = "", .script = "#!/bin/sh\necho $$ > \"$0.pid\"\nexec sleep 1000\n"});
    station.Probes(9);
    REQUIRE(Eventually([&] { return pid_of(station) > 0; }));
    station.daemon.Signal(SIGKILL);
    CHECK(station.daemon.Wait() == 128 + SIGKILL);
    CHECK(Eventually([&] { return group_gone(pid_of(station)); }));
  }
}

TEST_CASE("joint registers with steps of a milliradian are reported and passed to the diagnosis") {
  std::string script = kTrueAnswer;
  script.replace(script.find("set -e"), 6, "set -e; head -1 \"$3\" | grep -q ,q_step_deg,");
  Station station({.loop = "", .script = script, .profile = "universal-robots"});
  station.Probes(9);
  INFO(station.daemon.Log());
  REQUIRE(station.daemon.Awaits("version 2 proposed"));
  CHECK(station.daemon.Awaits("probes have a resolution of 1 mrad, "));
  CHECK(station.daemon.Awaits("joint registers are coarse"));
  REQUIRE(station.Journal().front().q_step_rad);
  CHECK(*station.Journal().front().q_step_rad == Approx(1e-3));
}

TEST_CASE("a PLC can restart the drift monitor; integers work as well as floats") {
  Station station({.loop = "diagnose = false\n"});
  station.Probes(8);
  REQUIRE(station.daemon.Awaits("drift alarm"));
  REQUIRE(Eventually([&] { return (station.State() & 2) != 0; }));
  CHECK(station.Command({8}) == 0);
  REQUIRE(Eventually([&] { return (station.State() & 2) == 0; }));
  CHECK_FALSE(station.daemon.Says("diagnosis started"));

  const auto seen = station.tracker.Read(0, 16);
  std::vector<std::uint16_t> words(40);
  words[0] = 7;
  for (int k = 0; k < 3; ++k) {
    const auto micrometres = static_cast<std::uint32_t>(
        static_cast<std::int32_t>(std::lround(1e3 * static_cast<double>(seen.Float(2 * k)))));
    const std::size_t high = 32 + 2 * static_cast<std::size_t>(k);
    words[high] = static_cast<std::uint16_t>(micrometres >> 16);
    words[high + 1] = static_cast<std::uint16_t>(micrometres);
  }
  CHECK(station.Command(words) == 0);
  const auto answer = station.plc.Read(100, 40);
  CHECK((answer.Word(3) & 1) != 0);
  REQUIRE(Eventually([&] { return station.plc.Read(400, 20).Long(4) == 9; }));
  const auto rows = station.Journal();
  REQUIRE(rows.size() == 9);
  CHECK((*rows[8].measured_W - *rows[7].measured_W).norm() < 2e-6);
  const double residual_mm = station.LastResidual_mm();
  CHECK(residual_mm ==
        Approx(1e3 * (*rows[8].measured_W - *rows[8].predicted_W).norm()).margin(1e-4));
  const double told_mm = std::hypot(answer.Float(16), answer.Float(18), answer.Float(20));
  CHECK(told_mm == Approx(residual_mm).margin(1e-3));
  CHECK(0.01 * station.plc.Read(216, 1).Word(0) == Approx(residual_mm).margin(0.01));
}

TEST_CASE("SIGHUP records no probe twice, and the journal stays in the original state directory") {
  Station station({.loop = "diagnose = false\n"});
  station.Probes(3);
  REQUIRE(Eventually([&] { return station.plc.Read(404, 2).Long(0) == 3; }));
  const auto before = station.plc.Read(100, 40);
  const std::string elsewhere = WithLine(LoopConfigText(station.cell.robot(), "diagnose = false\n"),
                                         "", "state_directory", "\"elsewhere\"");
  station.daemon.Write(elsewhere);
  station.daemon.Signal(SIGHUP);
  REQUIRE(station.daemon.Awaits("reloaded"));
  CHECK(station.daemon.Says("needs a restart: state_directory"));
  CHECK_FALSE(std::filesystem::exists(station.daemon.folder() + "/elsewhere"));
  REQUIRE(Eventually([&] { return (station.plc.Read(2000, 20).Word(1) & 1) != 0; }));
  REQUIRE(Eventually([&] { return station.Recording(); }));
  const auto after = station.plc.Read(100, 40);
  for (const int word : {0, 1, 2, 4, 5, 16, 17, 18, 19, 20, 21}) {
    CAPTURE(word);
    CHECK(after.Word(word) == before.Word(word));
  }
  CHECK(station.Journal().size() == 3);
  station.Probes(1);
  REQUIRE(Eventually([&] { return station.plc.Read(404, 2).Long(0) == 4; }));
  CHECK(station.Journal().size() == 4);
}

TEST_CASE("after a kill the daemon restores the alarm from its journal") {
  RunningCell cell(
      Idle(), virtual_cell::Effects({virtual_cell::EffectFromText("joint_compliance:q2=2e-6")}));
  const StandIn stand_in("#!/bin/sh\necho not today; exit 3\n");
  const TemporaryFolder state;
  const std::string config = WithLine(LoopConfigText(cell.robot(), "diagnose = false\n"), "",
                                      "state_directory", "\"" + state.path() + "\"");
  REQUIRE(cell.Tell("payload 60") == "ok");
  RegisterClient tracker("tracker", cell.tracker(), 1, 10);
  REQUIRE(Eventually([&] { return tracker.Read(0, 16).Word(13) == 1; }));
  const auto seen = tracker.Read(0, 16);
  for (const int round : {1, 2}) {
    DaemonProcess daemon(config);
    RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
    INFO(daemon.Log());
    REQUIRE(Eventually([&] { return (plc.Read(400, 20).Word(0) & 1) != 0; }));
    REQUIRE(Eventually([&] { return plc.Read(330, 2).Float(0) == 60; }));
    if (round == 1) {
      for (std::uint16_t i = 1; i <= 10; ++i) {
        std::vector<std::uint16_t> words = {6, 0};
        for (const std::uint16_t word :
             virtual_cell::WordsFromFloats({seen.Float(0), seen.Float(2), seen.Float(4)})) {
          words.push_back(word);
        }
        words.resize(40);
        words[39] = i;
        plc.Write(1000, words);
        REQUIRE(Eventually([&] { return plc.Read(404, 2).Long(0) == i; }));
      }
      REQUIRE(daemon.Awaits("drift alarm"));
      daemon.Signal(SIGKILL);
      CHECK(daemon.Wait() == 128 + SIGKILL);
    } else {
      CHECK(daemon.Awaits("is still active"));
      CHECK(Eventually([&] { return (plc.Read(400, 20).Word(0) & 2) != 0; }));
      CHECK(daemon.Count("residual of probes changed") == 0);  // not raised again
    }
  }
}

TEST_CASE("probes that cannot be recorded are refused, with the reason") {
  SECTION("no [monitoring]") {
    RunningCell cell(Idle());
    DaemonProcess daemon(DemoConfig(cell.robot(), "universal-robots-fine"));
    RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
    REQUIRE(Eventually([&] { return (plc.Read(300, 1).Word(0) & 1) != 0; }));
    std::vector<std::uint16_t> words(40);
    words[0] = 6;
    words[39] = 5;
    plc.Write(1000, words);
    REQUIRE(Eventually([&] { return plc.Read(101, 1).Word(0) == 5; }));
    CHECK(plc.Read(102, 1).Word(0) == 12);
    CHECK(plc.Read(400, 20).Word(1) == 1);  // the cell file is still version 1
  }
  SECTION("a file that is not a journal") {
    RunningCell cell(Idle());
    const TemporaryFolder state;
    std::ofstream(state.path() + "/journal.sqlite") << std::string(4096, 'x');
    DaemonProcess daemon(WithLine(LoopConfigText(cell.robot(), ""), "", "state_directory",
                                  "\"" + state.path() + "\""));
    RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
    CHECK(daemon.Awaits("journal: "));
    CHECK(Eventually([&] { return (plc.Read(14, 1).Word(0) & 0x80) != 0; }));
    CHECK((plc.Read(400, 1).Word(0) & 1) == 0);
    std::filesystem::remove(state.path() + "/journal.sqlite");
    CHECK(daemon.Awaits("journal works again"));
    CHECK(Eventually([&] { return (plc.Read(400, 1).Word(0) & 1) != 0; }));
  }
  SECTION("an empty journal file") {
    RunningCell cell(Idle());
    const TemporaryFolder state;
    std::ofstream(state.path() + "/journal.sqlite").close();
    DaemonProcess daemon(WithLine(LoopConfigText(cell.robot(), ""), "", "state_directory",
                                  "\"" + state.path() + "\""));
    CHECK(daemon.Awaits("journal.sqlite is empty: a new journal is started"));
  }
  SECTION("not a number") {
    Station station;
    CHECK(station.Command({6, 0, 0x7FC0, 0, 0, 0, 0, 0}) == 10);
    CHECK(station.Journal().empty());
  }
}

TEST_CASE("a disk that blocks the journal never blocks the control cycle") {
  Station station({.loop = "diagnose = false\n"});
  station.Probes(1);
  REQUIRE(Eventually([&] { return station.plc.Read(404, 2).Long(0) == 1; }));
  auto other = sqlite::Database::Open(station.state_directory() + "/journal.sqlite",
                                      sqlite::Database::Mode::kWrite);
  REQUIRE(other.value().Run("BEGIN IMMEDIATE"));  // blocks all other writers
  const auto refreshed = [&] { return station.plc.Read(2000, 20).Word(19); };
  const auto before = refreshed();
  int taken = 1;
  int code = 0;
  for (; code == 0 && taken < 200; taken += code == 0 ? 1 : 0) code = station.Probe();
  CHECK(code == 12);  // the queue is full: refused, not lost
  CHECK(taken > 60);
  CHECK(refreshed() != before);
  CHECK(station.plc.Read(404, 2).Long(0) == 1);
  REQUIRE(other.value().Run("COMMIT"));
  CHECK(Eventually(
      [&] { return station.plc.Read(404, 2).Long(0) == static_cast<std::uint32_t>(taken); }));
  CHECK(station.Journal().size() == static_cast<std::size_t>(taken));
  CHECK(station.Probe() == 0);
}

namespace {

/// Standard output of a `plumbline` command.
std::string OutputOf(const std::string& arguments) {
  FILE* const pipe = popen((std::string(PLUMBLINE) + " " + arguments + " 2>&1").c_str(), "r");
  REQUIRE(pipe != nullptr);
  std::string text;
  for (int c = 0; (c = fgetc(pipe)) != EOF;) text += static_cast<char>(c);
  pclose(pipe);
  return text;
}

std::vector<std::uint16_t> ProbeWords(const std::vector<double>& position_mm) {
  std::vector<std::uint16_t> words = {6, 0};
  for (const std::uint16_t word : virtual_cell::WordsFromFloats(position_mm)) words.push_back(word);
  return words;
}

}  // namespace

TEST_CASE("implausible probes are refused with the reason, and never reach the journal") {
  Station station({.loop = "diagnose = false\n"});
  REQUIRE(station.Probe() == 0);
  REQUIRE(station.plc.Read(104, 2).Float(0) != 0);
  const auto seen = station.tracker.Read(0, 16);
  const std::vector<double> metres = {1e-3 * seen.Float(0), 1e-3 * seen.Float(2),
                                      1e-3 * seen.Float(4)};
  CHECK(station.Command(ProbeWords({0, 0, 0})) == 17);
  const auto answer = station.plc.Read(100, 40);
  CHECK(answer.Word(3) == 0);
  for (int word = 4; word < 30; ++word) CHECK(answer.Word(word) == 0);
  REQUIRE(station.daemon.Awaits("not recorded: it is 0, 0, 0"));
  CHECK(station.Command(ProbeWords({0, 0, 0})) == 17);
  CHECK(station.Command(ProbeWords(metres)) == 17);
  REQUIRE(station.daemon.Awaits("is it given in metres?"));
  CHECK(station.Command(ProbeWords({2147483647, 2147483647, 2147483647})) == 17);
  REQUIRE(station.daemon.Awaits("farther from the base than"));
  std::vector<std::uint16_t> fine(40);
  fine[0] = 7;
  for (const std::size_t high : {32, 34, 36}) {
    fine[high] = 0x7FFF;
    fine[high + 1] = 0xFFFF;
  }
  CHECK(station.Command(fine) == 17);
  CHECK(station.plc.Read(420, 2).Long(0) == 5);
  CHECK(station.daemon.Count("it is 0, 0, 0") == 1);
  CHECK(OutputOf("status --port " + station.daemon.Plc().substr(station.daemon.Plc().find(':') + 1))
            .find("5 refused") != std::string::npos);
  REQUIRE(station.Probe() == 0);
  CHECK(station.daemon.Awaits("probes are accepted again; 5 were refused"));
  REQUIRE(Eventually([&] { return station.plc.Read(404, 2).Long(0) == 2; }));
  CHECK(station.Journal().size() == 2);
}

TEST_CASE("a probe that contradicts the model waits in quarantine until a person accepts it") {
  Station station({.loop = "diagnose = false\n"});
  CHECK(station.Probe(400) == 20);
  const auto answer = station.plc.Read(100, 40);
  CHECK((answer.Word(3) & 1) == 0);
  CHECK(std::hypot(answer.Float(16), answer.Float(18), answer.Float(20)) ==
        Approx(400).margin(20));  // measured minus predicted
  CHECK(station.Probe(401) == 20);
  REQUIRE(Eventually([&] { return station.plc.Read(422, 1).Word(0) == 2; }));
  CHECK((station.State() & 0x40) != 0);
  CHECK(station.daemon.Awaits("probe quarantined: row 1 of the journal is"));
  CHECK(station.Journal().empty());
  const std::string state = " --state " + station.state_directory();
  const std::string listed = OutputOf("journal quarantine list" + state);
  CHECK(listed.find("quarantine: waiting") != std::string::npos);
  CHECK(OutputOf("journal show" + state).find("quarantine: waiting") != std::string::npos);
  CHECK(OutputOf("journal quarantine accept 7" + state)
            .find("row 7 is not in quarantine; nothing decided") != std::string::npos);
  REQUIRE(Plumbline("journal quarantine accept 1" + state) == 0);
  REQUIRE(Plumbline("journal quarantine reject 2" + state) == 0);
  REQUIRE(Eventually([&] { return station.plc.Read(422, 1).Word(0) == 0; }));
  CHECK((station.State() & 0x40) == 0);
  CHECK(station.daemon.Awaits("quarantine: probes were accepted or rejected"));
  CHECK(station.Journal().size() == 1);
}

TEST_CASE("two masters in the command window are reported, to both and in the log") {
  Station station;
  const auto warned = [&] { return (station.plc.Read(14, 1).Word(0) & 0x8000) != 0; };
  station.Probes(1);
  CHECK_FALSE(warned());
  CHECK(station.plc.Read(425, 1).Word(0) == 0x0001);  // 127.0.0.1
  CHECK(station.plc.Read(426, 1).Word(0) != 0);
  {
    RegisterClient panel("plumblined", station.daemon.Plc(), 1, 10);
    panel.Write(1001, {1});
    station.Probes(1);
    REQUIRE(Eventually(warned));
    CHECK(station.plc.Read(427, 1).Word(0) == 0x0001);
    CHECK(station.daemon.Awaits("two masters: 127.0.0.1:"));
  }
  CHECK(Eventually([&] { return !warned(); }));
  CHECK(station.plc.Read(427, 1).Word(0) == 0);
  CHECK(station.daemon.Awaits("one client alone writes the command window again"));
  CHECK(station.daemon.Count("two masters: ") == 1);
}

TEST_CASE(
    "a probe on an artefact is journalled with its name, and does not move the drift monitor") {
  Station station({.loop = "diagnose = false\n", .artefacts = true});
  std::vector<std::uint16_t> words = {13, 2};
  for (const std::uint16_t word : virtual_cell::WordsFromFloats({-0.125})) words.push_back(word);
  CHECK(station.Command(words) == 0);
  words[1] = 1;
  CHECK(station.Command(words) == 10);  // the ball has no reading, and no negative distance
  words[1] = 3;
  CHECK(station.Command(words) == 10);  // no such artefact
  CHECK(station.Command({12, 1}) == 0);
  REQUIRE(Eventually([&] { return station.plc.Read(404, 2).Long(0) == 2; }));
  const auto rows = station.Journal();
  REQUIRE(rows.size() == 2);
  CHECK(rows[0].artefact == "dial");
  CHECK(*rows[0].gauge_m == Approx(-1.25e-4));
  CHECK(rows[1].artefact == "ball");
  CHECK_FALSE(rows[1].measured_W);
  CHECK(rows[1].q.size() == 6);
  CHECK(station.LastResidual_mm() == 0);
}

TEST_CASE("the button of a gauge makes a probe, which is journalled and logged") {
  const FakeGauge dial;
  Station station({.loop = "diagnose = false\n\n[[gauge]]\nartefact = \"dial\"\ndevice = \"" +
                           dial.device() + "\"\nformat = \"plain\"\nsigma_mm = 0.002\n",
                   .artefacts = true});
  plumbline::SleepSeconds(0.5);  // the line must have been silent after the connection
  dial.Send("-0.125 mm\r\n");
  CHECK(station.daemon.Awaits("gauge dial: -0.1250 mm recorded"));
  REQUIRE(Eventually([&] { return station.plc.Read(404, 2).Long(0) == 1; }));
  const auto outcome = [&] { return station.plc.Read(1119, 1).Word(0); };
  CHECK(Eventually([&] { return outcome() == 1; }));
  dial.Send("-0.1x5 mm\r\n");
  CHECK(station.daemon.Awaits("gauge dial: not recorded: "));
  CHECK(Eventually([&] { return outcome() == 2; }));
  plumbline::SleepSeconds(0.5);
  dial.Send("600 mm\r\n");
  CHECK(station.daemon.Awaits("gauge dial: 600.0000 mm not recorded"));
  CHECK(Eventually([&] { return outcome() > 100; }));
  const auto rows = station.Journal();
  REQUIRE(rows.size() == 1);
  CHECK(rows[0].source == plumbline::cell::JournalRow::Source::kGauge);
  CHECK(rows[0].artefact == "dial");
  CHECK(*rows[0].gauge_m == Approx(-1.25e-4));
  CHECK(*rows[0].sigma_m == Approx(2e-6));
  CHECK_FALSE(rows[0].command);
  const std::string shown = OutputOf("journal show --state " + station.state_directory());
  CHECK(shown.find("gauge") != std::string::npos);
}

TEST_CASE("a probe before the journal is open is answered as pending") {
  RunningCell cell(Idle());
  const TemporaryFolder state;
  const std::string file = state.path() + "/journal.sqlite";
  REQUIRE(plumbline::cell::Journal::Open(file).ok());
  auto other = sqlite::Database::Open(file, sqlite::Database::Mode::kWrite);
  REQUIRE(other.value().Run("BEGIN IMMEDIATE"));  // the daemon waits for it
  DaemonProcess daemon(WithLine(LoopConfigText(cell.robot(), ""), "", "state_directory",
                                "\"" + state.path() + "\""));
  RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
  std::vector<std::uint16_t> words = ProbeWords({1000, 0, 1000});
  words.resize(40);
  words[39] = 7;
  plc.Write(1000, words);
  REQUIRE(Eventually([&] { return plc.Read(101, 1).Word(0) == 7; }));
  CHECK(plc.Read(102, 1).Word(0) == 11);
  REQUIRE(other.value().Run("COMMIT"));
  CHECK(Eventually([&] { return (plc.Read(400, 1).Word(0) & 1) != 0; }));
}

TEST_CASE("an edited cell file is in force, whatever was applied before") {
  RunningCell cell(Idle());
  const TemporaryFolder state;
  const std::string file = state.path() + "/cell.toml";
  std::filesystem::copy_file("tests/virtual_cell/demo/cockpit-cell.toml", file);
  std::string config = WithLine(DemoConfig(cell.robot(), "universal-robots-fine"), "",
                                "state_directory", "\"" + state.path() + "\"");
  config = WithLine(config, "", "cell", "\"" + file + "\"");
  DaemonProcess daemon(config);
  RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
  CHECK(plc.Read(136, 1).Word(0) <= 1);
  REQUIRE(Plumbline("model propose config/cells/kr210.toml --state " + state.path()) == 0);
  REQUIRE(Plumbline("model apply 2 --state " + state.path()) == 0);
  REQUIRE(daemon.Awaits("model version 2 in force"));
  const std::string text = FileText(file);
  std::ofstream(file) << "# a comment\n\n" << text;
  daemon.Signal(SIGHUP);
  REQUIRE(Eventually([&] { return daemon.Count(" reloaded") == 2; }));
  CHECK(plc.Read(400, 20).Word(1) == 2);  // same meaning: the applied model stays
  CHECK((plc.Read(14, 1).Word(0) & warning::kModelSetAside) == 0);

  std::ofstream(file) << WithLine(text, "", "base_xyz_mm", "[0.0, 0.0, 1.5]");
  daemon.Signal(SIGHUP);
  CHECK(Eventually([&] { return plc.Read(400, 20).Word(1) == 3; }));
  CHECK(Eventually([&] { return plc.Read(400, 20).Word(3) == 3; }));
  CHECK(Eventually([&] { return (plc.Read(14, 1).Word(0) & warning::kModelSetAside) != 0; }));
  CHECK(daemon.Awaits("model version 2 is set aside: the cell file changed since: "));
  CHECK(daemon.Says("robot.base_xyz_mm [0, 0, 0] -> [0, 0, 1.5]"));

  daemon.Signal(SIGTERM);
  REQUIRE(daemon.Wait() == 0);
  DaemonProcess again(config);
  RegisterClient plc_again("plumblined", again.Plc(), 1, 10);
  const auto aside = [&] { return (plc_again.Read(14, 1).Word(0) & warning::kModelSetAside) != 0; };
  CHECK(aside());  // from the first answer on
  CHECK(again.Awaits("model version 2 is set aside: "));
  REQUIRE(Plumbline("model apply 3 --state " + state.path() + " 2> /dev/null") == 0);
  CHECK(Eventually([&] { return !aside(); }));  // the declared version is confirmed
  CHECK(plc_again.Read(400, 20).Word(1) == 3);
}

TEST_CASE("a lost state of the model store does not stop a running daemon, but prevents a start") {
  RunningCell cell(Idle());
  const TemporaryFolder state;
  const std::string config = WithLine(DemoConfig(cell.robot(), "universal-robots-fine"), "",
                                      "state_directory", "\"" + state.path() + "\"");
  const std::string where = " --state " + state.path() + " 2> /dev/null";
  {
    DaemonProcess daemon(config);
    RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
    const std::string demo_cell = "tests/virtual_cell/demo/cockpit-cell.toml";
    REQUIRE(Plumbline("model propose " + demo_cell + where) == 0);
    REQUIRE(Plumbline("model apply 2" + where) == 0);
    REQUIRE(Eventually([&] { return plc.Read(400, 20).Word(1) == 2; }));
    std::ofstream(state.path() + "/models/state.json", std::ios::trunc).close();
    daemon.Signal(SIGHUP);
    INFO(daemon.Log());
    CHECK(daemon.Awaits("Configuration not reloaded; the previous one stays in force"));
    CHECK(daemon.Says("state.json: is empty, so it is unknown which model was in force"));
    CHECK(plc.Read(400, 20).Word(1) == 2);
    CHECK(Eventually([&] { return (plc.Read(2000, 20).Word(1) & 1) != 0; }));
    CHECK(Plumbline("check " + daemon.ConfigFile()) == 1);
  }
  {
    DaemonProcess daemon(config);
    CHECK(daemon.Wait() == 1);
    CHECK(daemon.Says("`plumbline model apply N --state " + state.path() + "`"));
    CHECK(daemon.Says("not started"));
  }
  REQUIRE(Plumbline("model apply 2" + where) == 0);
  DaemonProcess daemon(config);
  RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
  CHECK(Eventually([&] { return plc.Read(400, 20).Word(1) == 2; }));
}

TEST_CASE("a model comes into force between two cycles: no point is withdrawn, no alarm raised") {
  Station station({.loop = "diagnose = false\n"});
  const std::string where = " --state " + station.state_directory();
  const std::string corrected = station.stand_in.folder() + "/corrected.toml";
  std::ofstream(corrected) << FileText("tests/virtual_cell/demo/cockpit-cell.toml")
                           << "\n[[effect]]\nid = \"joint_compliance\"\nscope = [\"q2\"]\n"
                              "parameters = [ { name = \"q2\", value = 2e-6, sd = 1e-9, "
                              "unit = \"rad/(N m)\" } ]\n";
  REQUIRE(Plumbline("model propose " + corrected + where + " 2> /dev/null") == 0);
  const auto valid = [&](int point) {
    return (station.plc.Read(2000 + 20 * point, 20).Word(1) & 1) != 0;
  };
  REQUIRE(Eventually([&] { return valid(0) && valid(1); }));
  REQUIRE(Eventually([&] { return station.daemon.Says("robot link up"); }));
  const int links = station.daemon.Count("robot link up");

  const std::string address = station.daemon.Plc();  // asserts: not for another thread
  int polls = 0, withdrawn = 0, alarmed = 0;
  std::jthread poller([&](const std::stop_token& stop) {
    RegisterClient plc("poller", address, 1, 10);
    for (; !stop.stop_requested(); ++polls) {
      for (const int k : {0, 1}) withdrawn += (plc.Read(2000 + 20 * k, 20).Word(1) & 1) == 0;
      alarmed += plc.Read(12, 1).Word(0) != 0;
    }
  });
  const auto z_mm = [&] { return static_cast<double>(station.plc.Read(2000, 20).Float(7)); };
  const double declared_mm = z_mm();
  double moved_mm = 0;
  for (int round = 0; round < 5; ++round) {
    REQUIRE(Plumbline("model apply 2" + where + " 2> /dev/null") == 0);
    CHECK(Eventually([&] { return station.plc.Read(400, 20).Word(1) == 2; }));
    moved_mm = std::abs(z_mm() - declared_mm);
    REQUIRE(Plumbline("model rollback" + where + " 2> /dev/null") == 0);
    CHECK(Eventually([&] { return station.plc.Read(400, 20).Word(1) == 1; }));
    station.daemon.Signal(SIGHUP);
  }
  poller.request_stop();
  poller.join();
  INFO(station.daemon.Log());
  CHECK(moved_mm > 1);
  CHECK(polls > 20);
  CHECK(withdrawn == 0);
  CHECK(alarmed == 0);
  CHECK_FALSE(station.daemon.Says("not trusted"));
  CHECK(station.daemon.Count("robot link up") == links);
}

TEST_CASE("`model apply` prints how far the configured points move, at the relevant loads") {
  struct Case {
    const char* name;
    const char* source;  ///< of [payload]
    int probes;          ///< in the journal
    bool port_known;
  };
  const Case cases[] = {{"a fixed mass", "\"fixed\"\nmass_kg = 60.0", 0, false},
                        {"the robot reports it, and the daemon is asked", "\"robot\"", 0, true},
                        {"the robot reported it at probes", "\"robot\"", 2, false}};
  for (const Case& c : cases) {
    CAPTURE(c.name);
    Station station({.loop = "diagnose = false\n"});
    const std::string where = " --state " + station.state_directory();
    const std::string folder = station.stand_in.folder();
    const std::string corrected = folder + "/corrected.toml", told = folder + "/told.txt";
    std::ofstream(corrected) << FileText("tests/virtual_cell/demo/cockpit-cell.toml")
                             << "\n[[effect]]\nid = \"joint_compliance\"\nscope = [\"q2\"]\n"
                                "parameters = [ { name = \"q2\", value = 2e-6, sd = 1e-9, "
                                "unit = \"rad/(N m)\" } ]\n";
    station.Probes(c.probes);
    const auto recorded = static_cast<std::uint32_t>(c.probes);
    REQUIRE(Eventually([&] { return station.plc.Read(404, 2).Long(0) == recorded; }));
    std::string config = WithLine(LoopConfigText(station.cell.robot(), "diagnose = false\n"),
                                  "payload", "source", c.source);
    if (c.port_known) {
      const std::string plc = station.daemon.Plc();
      config = WithLine(config, "plc", "port", plc.substr(plc.find(':') + 1));
    }
    station.daemon.Write(config);
    station.daemon.Signal(SIGHUP);
    REQUIRE(station.daemon.Awaits(" reloaded"));
    REQUIRE(Plumbline("model propose " + corrected + where + " 2> " + told) == 0);
    const std::string text = FileText(told);
    INFO(text);
    const std::string marker = "the largest move of a configured point is ";
    REQUIRE(text.find(marker) != std::string::npos);
    const double told_mm = std::stod(text.substr(text.find(marker) + marker.size()));
    CHECK(text.find(" at 60 kg") != std::string::npos);

    const auto command = [&](int k) {
      const auto block = station.plc.Read(2000 + 20 * k, 20);
      return Vec3(block.Float(3), block.Float(5), block.Float(7));
    };
    const auto valid = [&](int k) {
      return (station.plc.Read(2000 + 20 * k, 20).Word(1) & 1) != 0;
    };
    REQUIRE(Eventually([&] { return valid(0) && valid(1); }));
    const std::array<Vec3, 2> before{command(0), command(1)};
    REQUIRE(Plumbline("model apply 2" + where + " 2> /dev/null") == 0);
    REQUIRE(Eventually([&] { return station.plc.Read(400, 20).Word(1) == 2; }));
    // A point that is valid from now on belongs to the new model; before, its numbers are
    // meaningless.
    REQUIRE(Eventually([&] { return valid(0) && valid(1); }));
    const double true_mm =
        std::max((command(0) - before[0]).norm(), (command(1) - before[1]).norm());
    CHECK(true_mm > 1);
    CHECK(told_mm == Approx(true_mm).margin(0.002));
  }
}

TEST_CASE("two daemons do not share a journal") {
  RunningCell cell(Idle());
  const TemporaryFolder state;
  const std::string config =
      WithLine(LoopConfigText(cell.robot(), ""), "", "state_directory", "\"" + state.path() + "\"");
  DaemonProcess first(config);
  first.Plc();
  DaemonProcess second(config);
  CHECK(second.Wait() == 2);
  CHECK(second.Says(state.path() + ": another plumblined (process "));
}

}  // namespace plumbline::loop_test
