#include "app/cell/model_store/model_store.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <fstream>
#include <random>
#include <thread>

#include "app/cell/model_store/cell_difference.h"
#include "app/cell/model_store/configuration_note.h"
#include "app/cell/model_store/daemon_signal.h"
#include "app/cell/model_store/model_change.h"
#include "app/cell/model_store/model_json.h"
#include "app/cell/model_store/point_moves.h"
#include "app/cell/model_store/usable_model.h"
#include "drivers/files/file_lock.h"
#include "drivers/files/replace_file.h"
#include "tests/app/temporary_folder.h"
#include "tests/file_text.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::model_store_test {

using namespace plumbline::cell;
using plumbline::test::TemporaryFolder;

namespace {

ModelStore StoreIn(const TemporaryFolder& folder) {
  auto store = ModelStore::Open(folder.path());
  REQUIRE(store.ok());
  return std::move(store).value();
}

ModelState StateOf(const ModelStore& store) {
  const auto state = store.State();
  INFO((state ? "" : state.error()));
  REQUIRE(state.ok());
  return *state;
}

/// A large model that identifies itself in every byte.
std::string BigText(int number) {
  return std::string(20000, static_cast<char>('a' + number % 26)) + std::to_string(number);
}

/// Checks that a version is exactly one BigText, neither mixed nor truncated.
void CheckWhole(const ModelStore& store, int number) {
  const auto text = store.Text(number);
  REQUIRE(text.ok());
  CHECK(text->size() > 20000);
  CHECK(text->find_first_not_of((*text)[0]) == 20000);
}

}  // namespace

TEST_CASE("the life of a model: declared, proposed, applied, rolled back") {
  const TemporaryFolder folder;
  ModelStore store = StoreIn(folder);
  CHECK(StateOf(store) == ModelState{});
  CHECK(*store.Declare("cell 1", "cell.toml") == 1);
  CHECK(*store.Declare("cell 1", "cell.toml") == 1);  // unchanged
  CHECK(StateOf(store) == ModelState{1, 1, 0, {1}});

  std::ofstream(folder.path() + "/r.html") << "<html>";
  ModelFacts facts;
  facts.origin = ModelFacts::Origin::kDiagnosis;
  facts.verdict = "explained";
  facts.effects = {"joint_compliance"};
  facts.rms_before_mm = 8.5;
  facts.rms_after_mm = 0.09;
  facts.implausible = {"joint_compliance: softer than any gear"};
  facts.discrepancy_share = 0.25;
  CHECK(*store.Propose("cell 1 corrected", facts, folder.path() + "/r.html") == 2);
  CHECK(StateOf(store) == ModelState{1, 1, 2, {1}});
  CHECK(*store.Text(2) == "cell 1 corrected");
  const auto kept = store.Facts(2);
  REQUIRE(kept.ok());
  CHECK(kept->based_on == 1);
  CHECK(kept->effects == facts.effects);
  CHECK(kept->rms_before_mm == 8.5);
  CHECK(kept->implausible == facts.implausible);
  CHECK(kept->discrepancy_share == 0.25);
  CHECK(kept->report == "0002.html");
  CHECK(std::ifstream(store.ReportFile(2)).get() == '<');

  REQUIRE(store.Apply(2).ok());
  CHECK(StateOf(store) == ModelState{1, 2, 0, {1, 2}});
  CHECK(*store.Declare("cell 1", "cell.toml") == 1);  // still unchanged: the correction stays
  CHECK(StateOf(store).applied == 2);
  CHECK(*store.RollBack() == 1);
  CHECK(StateOf(store) == ModelState{1, 1, 0, {1}});
  const auto no_more = store.RollBack();
  REQUIRE_FALSE(no_more.ok());
  CHECK_FALSE(store.Apply(7).ok());
  CHECK(StateOf(store).applied == 1);

  REQUIRE(store.Apply(2).ok());
  CHECK(*store.Declare("another cell", "cell.toml") == 3);  // somebody edited it
  const ModelState edited = StateOf(store);
  CHECK(edited.declared == 3);
  CHECK(edited.applied == 3);
  CHECK(edited.history == std::vector{1, 2, 3});
  REQUIRE(edited.set_aside);
  CHECK(edited.set_aside->version == 2);
  CHECK(store.Versions()->size() == 3);
}

namespace {

/// The text with `from` replaced, which it holds.
std::string With(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

constexpr const char* kBase = "base_xyz_mm = [0.0, 0.0, 0.0]";

std::string DemoCell() {
  return test::FileText("tests/virtual_cell/demo/cockpit-cell.toml");
}

}  // namespace

TEST_CASE("cells are compared by their values, and differences are listed by key") {
  const std::string cell = DemoCell();
  const auto differences = [&cell](const std::string& other) {
    return CellTextDifferences(cell, other);
  };
  CHECK(differences(cell).empty());
  CHECK(differences("# a comment\n\n" + cell + "\n\n# another\n").empty());
  // Other number formats, an omitted default, another order, a label.
  CHECK(differences(With(cell, "3.0e-7", "0.0000003")).empty());
  CHECK(differences(With(cell, "theta_offset_deg = 0.0\nsign = -1", "sign = -1")).empty());
  CHECK(differences(With(cell, "alpha_deg = -90.0\nd_mm = 675.0", "d_mm = 675\nalpha_deg = -90"))
            .empty());
  CHECK(differences(With(cell, "name = \"KR", "name = \"Our KR")).empty());
  const auto raised = differences(With(cell, kBase, "base_xyz_mm = [0.0, 0.0, 1.5]"));
  CHECK(raised == std::vector<std::string>{"robot.base_xyz_mm [0, 0, 0] -> [0, 0, 1.5]"});
  CHECK(differences("no cell").size() == 1);
}

TEST_CASE("each value of a cell counts, in its key and unit") {
  const model::CellModel cell = test::HeavyArm();
  const auto difference = [&cell](const model::CellModel& other) {
    const auto found = CellDifferences(cell, other);
    return found.size() == 1 ? found[0] : fmt::format("{} differences", found.size());
  };
  model::CellModel other = cell;
  other.robot.joints[2].compliance_rad_per_Nm = 2e-6;
  CHECK(difference(other) == "robot.joint[3].compliance_rad_per_Nm 6e-07 -> 2e-06");
  other = cell;
  other.robot.joints[1].a_m += 1e-15;  // beyond the digits that are shown
  CHECK_THAT(difference(other), Catch::StartsWith("robot.joint[2].a_mm 1100 -> 1100 (in SI "));
  other = cell;
  other.tool.segments[0].material.youngs_modulus_Pa = 71e9;
  CHECK(difference(other) == "tool.segment[1].youngs_modulus_GPa 70 -> 71");
  other = cell;
  other.payload_cog_F.reset();
  CHECK(difference(other) == "payload.cog_mm [20, 50, 1100] -> absent");
  other = cell;
  other.domain.emplace().payload_kg = model::MeasuredRange{{{0, 60}}, {}};
  CHECK(difference(other) == "domain.payload_kg absent -> [0, 60]");
  other.domain->payload_kg = model::MeasuredRange{{{0, 0}, {60, 60}}, 2e-5};
  CHECK(CellDifferences(cell, other) ==
        std::vector<std::string>{"domain.payload_kg[1] absent -> [0, 0]",
                                 "domain.payload_kg[2] absent -> [60, 60]",
                                 "domain.payload_kg (growth, mm/kg) absent -> 0.02"});
  model::CellModel fitted = cell;
  fitted.domain.emplace();
  other = fitted;
  other.domain->as_validated = false;
  CHECK(CellDifferences(fitted, other) ==
        std::vector<std::string>{"domain (model changed after its fit) absent -> true"});
  other = cell;
  other.robot.name = "another label";
  other.robot.identity = {"KR 210", "2", "2019-05-01"};
  CHECK(CellDifferences(cell, other).empty());
}

TEST_CASE("an applied model survives an edit of the cell file that changes no value") {
  const TemporaryFolder folder;
  ModelStore store = StoreIn(folder);
  const std::string cell = DemoCell();
  REQUIRE(*store.Declare(cell, "cell.toml") == 1);
  REQUIRE(*store.Propose(cell + "# fitted\n", {}, "") == 2);
  REQUIRE(store.Apply(2).ok());
  CHECK(*store.Declare("# mounted by the night shift\n" + cell + "\n\n", "cell.toml") == 1);
  CHECK(StateOf(store) == ModelState{1, 2, 0, {1, 2}});
  CHECK(store.Versions()->size() == 2);
}

TEST_CASE("a model set aside stays so, with the reason, until a person applies a version") {
  const TemporaryFolder folder;
  const std::string cell = DemoCell();
  const auto moved = [&](const char* z_mm) {
    return With(cell, kBase, fmt::format("base_xyz_mm = [0.0, 0.0, {}]", z_mm));
  };
  ModelStore store = StoreIn(folder);
  REQUIRE(*store.Declare(cell, "cell.toml") == 1);
  REQUIRE(*store.Propose(cell + "# fitted\n", {}, "") == 2);
  REQUIRE(store.Apply(2).ok());
  REQUIRE(*store.Propose(cell + "# fitted anew\n", {}, "") == 3);
  REQUIRE(*store.Declare(moved("1.5"), "cell.toml") == 4);

  const auto aside = [&folder] { return StateOf(StoreIn(folder)).set_aside; };  // from the disk
  REQUIRE(aside());
  CHECK(aside()->version == 2);
  CHECK(aside()->declared == 1);
  CHECK(aside()->withdrawn == 3);
  REQUIRE(aside()->changes.size() == 1);
  CHECK_THAT(aside()->changes[0], Catch::StartsWith("robot.base_xyz_mm"));
  const std::string text = SupersededText(StateOf(store), "/state");
  CHECK_THAT(text, Catch::Contains("model version 2 is set aside: the cell file changed since: "
                                   "robot.base_xyz_mm") &&
                       Catch::Contains("`plumbline model apply 2 --state /state`") &&
                       Catch::Contains("`plumbline model apply 4 --state /state` confirms") &&
                       Catch::Contains("The proposed version 3 was withdrawn"));

  SECTION("a further edit: the reason is what changed since the model was in force") {
    REQUIRE(*store.Declare(moved("2.5"), "cell.toml") == 5);
    REQUIRE(aside());
    CHECK(aside()->version == 2);
    CHECK_THAT(aside()->changes[0], Catch::Contains("2.5]"));
    CHECK(*store.RollBack() == 2);  // skips the declared versions, which nobody chose
    CHECK_FALSE(aside());
  }
  SECTION("the edit is undone: a person still has to decide") {
    REQUIRE(*store.Declare(cell, "cell.toml") == 5);
    REQUIRE(aside());
    CHECK(aside()->changes.empty());
  }
  SECTION("the model is applied anyway") {
    REQUIRE(store.Apply(2).ok());
    CHECK_FALSE(aside());
    CHECK(*store.Declare(moved("1.5"), "cell.toml") == 4);
    CHECK(StateOf(store).applied == 2);
  }
  SECTION("the cell file is confirmed") {
    REQUIRE(store.Apply(4).ok());
    CHECK_FALSE(aside());
    CHECK(StateOf(store).history == std::vector{1, 2, 4});
  }
  SECTION("a proposal decides nothing") {
    REQUIRE(*store.Propose(cell + "# a third\n", {}, "") == 5);
    CHECK(aside());
  }
}

TEST_CASE("a version is never modified") {
  const TemporaryFolder folder;
  ModelStore store = StoreIn(folder);
  REQUIRE(store.Declare("cell 1", "cell.toml").ok());
  struct stat info {};
  REQUIRE(stat(store.ModelFile(1).c_str(), &info) == 0);
  CHECK((info.st_mode & 0777) == 0444);
}

TEST_CASE("an unreadable state is an error, and applying a version writes a new one") {
  const TemporaryFolder folder;
  const std::string file = folder.path() + "/models/state.json";
  ModelStore store = StoreIn(folder);
  REQUIRE(*store.Declare("cell 1", "cell.toml") == 1);
  REQUIRE(*store.Propose("cell 1 corrected", {}, "") == 2);
  REQUIRE(store.Apply(2).ok());
  const std::string whole = test::FileText(file);
  const std::optional<std::string> damage = GENERATE(
      as<std::optional<std::string>>(), std::nullopt, "", "{", "{\"applied\": \"two\"}", "[1]",
      R"({"schema": 1, "declared": 1, "applied": 2, "proposed": 0, "history": [1]})");
  CAPTURE(damage.value_or("no file"));
  std::filesystem::remove(file);
  if (damage) std::ofstream(file) << *damage;

  const auto state = store.State();
  REQUIRE_FALSE(state.ok());
  CHECK_THAT(state.error(),
             Catch::Contains(file) && Catch::Contains("it is unknown which model was in force") &&
                 Catch::Contains("`plumbline model apply N --state " + folder.path() + "`"));
  CHECK_FALSE(store.Declare("cell 1", "cell.toml").ok());
  CHECK_FALSE(store.Propose("x", {}, "").ok());
  CHECK_FALSE(store.RollBack().ok());
  CHECK(std::filesystem::exists(file) == damage.has_value());
  if (damage) CHECK(test::FileText(file) == *damage);

  CHECK_FALSE(store.Apply(7).ok());
  CHECK_FALSE(store.State().ok());
  REQUIRE(store.Apply(2).ok());
  CHECK(StateOf(store) == ModelState{1, 2, 0, {2}});
  CHECK(std::filesystem::exists(file + ".damaged") == damage.has_value());
  CHECK(*store.Declare("cell 1", "cell.toml") == 1);
  CHECK(StateOf(store).applied == 2);
}

TEST_CASE(
    "a version applied before any cell file was declared stays in force, and edits are detected") {
  const TemporaryFolder folder;
  ModelStore store = StoreIn(folder);
  REQUIRE(*store.Propose("cell 1 corrected", {}, "") == 1);
  REQUIRE(store.Apply(1).ok());
  CHECK(*store.Declare("cell 1", "cell.toml") == 2);
  CHECK(StateOf(store) == ModelState{2, 1, 0, {1}});
  CHECK(*store.Declare("another cell", "cell.toml") == 3);
  REQUIRE(StateOf(store).set_aside);
  CHECK(StateOf(store).set_aside->version == 1);
}

TEST_CASE("a state is not missing if the first version was incomplete") {
  const TemporaryFolder folder;
  ModelStore store = StoreIn(folder);
  CHECK(StateOf(store) == ModelState{});
  // The state after a power cut between writing the first version's facts and the state.
  REQUIRE(*store.Declare("cell 1", "cell.toml") == 1);
  std::ofstream(folder.path() + "/models/state.json") << JsonFrom(ModelState{});
  CHECK(StateOf(store) == ModelState{});
  CHECK(*store.Declare("cell 1", "cell.toml") == 2);
  CHECK(StateOf(store) == ModelState{2, 2, 0, {2}});
}

TEST_CASE("a version that is not an integer is not mistaken for another one") {
  const auto state = [](const std::string& applied, const std::string& before) {
    return ModelStateFromJson("{\"schema\": 1, \"declared\": 1, \"proposed\": 0, \"applied\": " +
                              applied + ", \"history\": [" + before + "]}");
  };
  REQUIRE(state("2", "1, 2"));
  for (const char* number : {"2.5", "4e80", "-1e300", "4294967298", "18446744073709551615"}) {
    INFO(number);
    CHECK_FALSE(state(number, "1"));
    CHECK_FALSE(state("2", number));
  }
  CHECK(SchemaInJson("{\"schema\": 4294967297}") == 0);
}

TEST_CASE("a folder that cannot be written is an error") {
  const TemporaryFolder folder;
  std::ofstream(folder.path() + "/models") << "a file in the way";
  CHECK_FALSE(ModelStore::Open(folder.path()).ok());
}

TEST_CASE("a folder that cannot be listed is not an empty one") {
  const TemporaryFolder folder;
  ModelStore store = StoreIn(folder);
  REQUIRE(*store.Declare("cell 1", "cell.toml") == 1);
  const std::string models = folder.path() + "/models";
  std::filesystem::rename(models, models + ".kept");
  std::string why = "cannot be read: ";
  SECTION("it is gone") {}
  SECTION("a file is in its place") {
    std::ofstream(models) << "a file in the way";
  }
  SECTION("state.json is unreadable") {
    std::filesystem::create_symlink("models", models);
    why = "it is unknown which model was in force";
  }
  const auto state = store.State();
  REQUIRE_FALSE(state.ok());
  CHECK_THAT(state.error(), Catch::Contains(models) && Catch::Contains(why));
  CHECK_FALSE(store.Versions().ok());
  CHECK_FALSE(store.Declare("cell 2", "cell.toml").ok());
  CHECK_FALSE(store.Propose("cell 2", {}, "").ok());
  CHECK_FALSE(store.Apply(1).ok());

  std::filesystem::remove(models);
  std::filesystem::rename(models + ".kept", models);
  CHECK(StateOf(store) == ModelState{1, 1, 0, {1}});
  CHECK(*store.Text(1) == "cell 1");
}

TEST_CASE("a model proposed without its report is not stored partially") {
  const TemporaryFolder folder;
  ModelStore store = StoreIn(folder);
  CHECK_FALSE(store.Propose("cell", {}, folder.path() + "/no-report.html").ok());
  CHECK(store.Versions()->empty());
  CHECK(StateOf(store).proposed == 0);
}

namespace {

/// Writes to the store endlessly; every third version is rolled back.
[[noreturn]] void WriteUntilKilled(const std::string& folder, unsigned seed, int begun) {
  auto store = ModelStore::Open(folder);
  std::mt19937 random(seed);
  if (write(begun, "b", 1) != 1) _exit(3);
  for (int i = 0;; ++i) {
    const auto number = store.value().Propose(BigText(static_cast<int>(random())), {}, "");
    if (!number || !store.value().Apply(*number)) _exit(1);
    if (i % 3 == 2 && !store.value().RollBack()) _exit(2);
  }
}

/// Duration of a proposal and its application on this disk.
std::chrono::microseconds TimeOfOneChange() {
  const TemporaryFolder folder;
  ModelStore store = StoreIn(folder);
  constexpr int kChanges = 10;
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < kChanges; ++i) {
    store.Apply(store.Propose(BigText(i), {}, "").value()).value();
  }
  return std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() -
                                                               begin) /
         kChanges;
}

}  // namespace

TEST_CASE("killed at any moment, the store holds the state before or after") {
  constexpr int kFolders = 20,
                kKillsEach = 10;  // few in each, because every version is read every time
  const int longest_us = static_cast<int>(4 * TimeOfOneChange().count());
  const auto enough = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  int kills = 0;
  std::mt19937 random(3);
  int changed = 0;
  // Fewer on a slow disk.
  for (int round = 0; round < kFolders && (round < 5 || std::chrono::steady_clock::now() < enough);
       ++round) {
    const TemporaryFolder folder;
    StoreIn(folder).Declare(BigText(1), "cell.toml").value();
    for (int kill_number = 0; kill_number < kKillsEach; ++kill_number, ++kills) {
      const ModelState before = StateOf(StoreIn(folder));
      const auto versions_before = *StoreIn(folder).Versions();
      const int last_before = versions_before.back().number;
      int ends[2];
      REQUIRE(pipe(ends) == 0);
      const unsigned seed = static_cast<unsigned>(random());
      const pid_t writer = fork();
      if (writer == 0) WriteUntilKilled(folder.path(), seed, ends[1]);
      close(ends[1]);
      char begun = 0;
      REQUIRE(read(ends[0], &begun, 1) == 1);
      std::this_thread::sleep_for(
          std::chrono::microseconds(std::uniform_int_distribution(0, longest_us)(random)));
      kill(writer, SIGKILL);
      int status = 0;
      waitpid(writer, &status, 0);
      close(ends[0]);
      REQUIRE(WIFSIGNALED(status));

      ModelStore store = StoreIn(folder);
      const ModelState state = StateOf(store);
      const auto versions = store.Versions();
      REQUIRE(versions.ok());
      CHECK(versions->size() >= versions_before.size());
      for (const int number : {state.declared, state.applied}) CHECK(store.Text(number).ok());
      if (state.proposed != 0) CHECK(store.Text(state.proposed).ok());
      CHECK(state.history.back() == state.applied);
      CHECK(state.history.size() + 1 >= before.history.size());
      for (const ModelVersion& version : *versions) {
        if (version.number > last_before) CheckWhole(store, version.number);
      }
      changed += state.applied != before.applied ? 1 : 0;
      // The store still works, also with what was left behind.
      const auto next = store.Propose(BigText(1), {}, "");
      REQUIRE(next.ok());
      CHECK(*store.Text(*next) == BigText(1));
    }
    const ModelStore store = StoreIn(folder);
    const auto versions = store.Versions();
    REQUIRE(versions.ok());
    for (const ModelVersion& version : *versions) CheckWhole(store, version.number);
  }
  CHECK(changed > kills / 10);  // a kill before any change proves little
}

TEST_CASE("symbolic links in place of state files are not followed") {
  const TemporaryFolder folder;
  const std::string victim = folder.path() + "/victim";
  std::ofstream(victim) << "precious";
  const auto link = [&](const std::string& name) {
    REQUIRE(symlink(victim.c_str(), (folder.path() + name).c_str()) == 0);
  };
  link("/daemon.pid");
  bool taken = true;
  CHECK_FALSE(LockStateDirectory(folder.path(), &taken));
  CHECK_FALSE(taken);
  auto store = ModelStore::Open(folder.path());
  REQUIRE(store);
  link("/models/lock");
  CHECK_FALSE(store.value().Declare("a = 1\n", "cell.toml"));
  std::filesystem::remove(folder.path() + "/models/lock");
  link("/models/state.json");
  CHECK(files::ReplaceFileDurably(folder.path() + "/models/state.json", "ours"));
  CHECK(test::FileText(victim) == "precious");
}

TEST_CASE(
    "a recorded cell file needs no lock: a read-only disk does not change the model in force") {
  const TemporaryFolder folder;
  auto store = ModelStore::Open(folder.path());
  REQUIRE(store);
  REQUIRE(*store.value().Declare("a = 1\n", "cell.toml") == 1);
  std::filesystem::remove(folder.path() + "/models/lock");
  std::filesystem::create_directory(folder.path() + "/models/lock");  // cannot be locked
  const auto again = store.value().Declare("a = 1\n", "cell.toml");
  REQUIRE(again);
  CHECK(*again == 1);
  CHECK_FALSE(store.value().Declare("a = 2\n", "cell.toml"));
}

TEST_CASE("writers wait for each other") {
  const TemporaryFolder folder;
  const auto propose = [&folder] {
    auto store = ModelStore::Open(folder.path());
    for (int i = 0; i < 25; ++i) {
      if (!store || !store.value().Propose(BigText(i), {}, "")) return;
    }
  };
  std::thread first(propose), second(propose);
  first.join();
  second.join();
  CHECK(StoreIn(folder).Versions()->size() == 50);
}

TEST_CASE("the daemon of a directory is found while it runs, and not afterwards") {
  const TemporaryFolder folder;
  CHECK(*NotifyDaemon(folder.path()) == Notified::kNoDaemon);
  int ends[2];
  REQUIRE(pipe(ends) == 0);
  const pid_t daemon = fork();
  if (daemon == 0) {
    signal(SIGHUP, [](int) { _exit(42); });
    const auto lock = LockStateDirectory(folder.path());
    const char ready = lock ? 'y' : 'n';
    if (write(ends[1], &ready, 1) != 1) _exit(1);
    for (;;) pause();
  }
  char ready = 0;
  REQUIRE(read(ends[0], &ready, 1) == 1);
  CHECK(ready == 'y');
  const auto second = LockStateDirectory(folder.path());
  REQUIRE_FALSE(second.ok());
  CHECK(second.error() == fmt::format("another plumblined (process {}) uses it", daemon));
  CHECK(*NotifyDaemon(folder.path()) == Notified::kYes);
  int status = 0;
  waitpid(daemon, &status, 0);
  CHECK(WEXITSTATUS(status) == 42);
  CHECK(*NotifyDaemon(folder.path()) == Notified::kNoDaemon);
  close(ends[0]);
  close(ends[1]);
}

namespace {

/// A child that exits with `code` on SIGHUP; optionally it first locks the directory as the daemon.
pid_t Listener(const std::string& state, bool announces, int code) {
  int ends[2];
  REQUIRE(pipe(ends) == 0);
  const pid_t child = fork();
  if (child == 0) {
    static int at_hangup = 0;
    at_hangup = code;
    signal(SIGHUP, [](int) { _exit(at_hangup); });
    std::optional<Result<StateDirectoryLock>> mark;
    if (announces) mark.emplace(LockStateDirectory(state));
    const char ready = !mark || mark->ok() ? 'y' : 'n';
    if (write(ends[1], &ready, 1) != 1) _exit(1);
    for (;;) pause();
  }
  char ready = 0;
  REQUIRE(read(ends[0], &ready, 1) == 1);
  CHECK(ready == 'y');
  close(ends[0]);
  close(ends[1]);
  return child;
}

}  // namespace

TEST_CASE("the holder of the lock is notified, whatever process id is in the file") {
  const TemporaryFolder folder;
  const pid_t daemon = Listener(folder.path(), true, 42);
  const pid_t stranger = Listener(folder.path(), false, 7);
  // As between locking and writing: the id of a previous daemon, by now another process.
  std::ofstream(folder.path() + "/daemon.pid") << stranger << '\n';
  CHECK(*NotifyDaemon(folder.path()) == Notified::kYes);
  int status = 0;
  REQUIRE(waitpid(daemon, &status, 0) == daemon);
  CHECK((WIFEXITED(status) && WEXITSTATUS(status) == 42));
  CHECK(*NotifyDaemon(folder.path()) == Notified::kNoDaemon);  // the id is still in the file
  CHECK(waitpid(stranger, &status, WNOHANG) == 0);
  kill(stranger, SIGKILL);
  REQUIRE(waitpid(stranger, &status, 0) == stranger);
  CHECK(WIFSIGNALED(status));  // it got no SIGHUP before
}

TEST_CASE("querying for a daemon never prevents a start, and the id is removed at its end") {
  const TemporaryFolder folder;
  REQUIRE(LockStateDirectory(folder.path()).ok());
  const auto former = signal(SIGHUP, SIG_IGN);
  const pid_t asker = fork();
  if (asker == 0) {
    for (;;) static_cast<void>(NotifyDaemon(folder.path()).ok());
  }
  int refused = 0;
  for (int i = 0; i < 5000; ++i) refused += LockStateDirectory(folder.path()).ok() ? 0 : 1;
  CHECK(refused == 0);
  kill(asker, SIGKILL);
  waitpid(asker, nullptr, 0);
  signal(SIGHUP, former);
  CHECK(std::filesystem::file_size(folder.path() + "/daemon.pid") == 0);
  {
    const auto mark = LockStateDirectory(folder.path());
    REQUIRE(mark.ok());
    pid_t told = 0;
    // In another process: closing the file in this one would release the lock.
    const std::string copy = "cp " + folder.path() + "/daemon.pid " + folder.path() + "/copy";
    REQUIRE(system(copy.c_str()) == 0);
    std::ifstream(folder.path() + "/copy") >> told;
    CHECK(told == getpid());
  }
  CHECK(std::filesystem::file_size(folder.path() + "/daemon.pid") == 0);
}

TEST_CASE("the diagnosis result is read, and invalid results are refused") {
  const auto facts = ModelFactsFromDiagnosis(R"({"schema": 1, "verdict": "explained",
    "effects": [{"id": "joint_compliance", "scope": ["q2"]}], "rivals": [],
    "rms_mm": {"before": 8.64, "after": 0.09, "before_held_out": 8.7, "after_held_out": 0.1}})");
  REQUIRE(facts.ok());
  CHECK(facts->verdict == "explained");
  CHECK(facts->effects == std::vector<std::string>{"joint_compliance"});
  CHECK(facts->rms_before_mm == 8.7);
  CHECK(facts->rms_after_mm == 0.1);
  CHECK(facts->implausible.empty());
  CHECK_FALSE(facts->discrepancy_share);
  const auto doubtful = ModelFactsFromDiagnosis(R"({"verdict": "explained", "rms_mm": {},
    "implausible": ["backlash: 3 degrees"], "discrepancy_model": {"parameters": 9, "share_of_correction": 0.5}})");
  REQUIRE(doubtful.ok());
  CHECK(doubtful->implausible == std::vector<std::string>{"backlash: 3 degrees"});
  CHECK(doubtful->discrepancy_share == 0.5);
  for (const char* text :
       {"", "[]", "{}", R"({"verdict": "fine", "rms_mm": {}})", R"({"verdict": "explained"})",
        R"({"verdict": "explained", "rms_mm": 3})"}) {
    CAPTURE(text);
    CHECK_FALSE(ModelFactsFromDiagnosis(text).ok());
  }
}

TEST_CASE("the change between two models is that of the loaded tip") {
  const model::CellModel cell = test::HeavyArm();
  model::CellModel other = cell;
  other.robot.X_WB.p += Vec3(0, 0, 2e-3);
  std::mt19937 random(1);
  std::vector<ModelPose> poses;
  poses.reserve(10);
  for (int i = 0; i < 10; ++i) poses.push_back({test::RandomPosture(cell, random), 60, {}, {}});
  CHECK(*LargestTipChange(cell, cell, poses) == 0);
  CHECK(*LargestTipChange(cell, other, poses) == Approx(2e-3));
  other = cell;
  other.robot.joints[1].compliance_rad_per_Nm = 2e-6;
  CHECK(*LargestTipChange(cell, other, poses) > 1e-3);
  other.robot.joints[2].link_mass_kg.reset();
  CHECK_FALSE(LargestTipChange(cell, other, poses).ok());
}

namespace {

MachineConfig ConfigOf(const model::CellModel& cell) {
  MachineConfig config;
  config.cell = cell;
  const deflection::LoadedArm arm(cell);
  std::mt19937 random(4);
  for (const int id : {1, 2, 3}) {
    correction::AssemblyPoint& point = config.points.emplace_back();
    point.id = id;
    point.name = fmt::format("point {}", id);
    point.near_q = test::RandomPosture(cell, random);
    deflection::LoadedState state;
    arm.AtActual(*point.near_q, {}, {}, state);
    point.X_WP = cell.robot.X_WB * state.X_BT;
  }
  return config;
}

/// As in a machine, by the corrector itself.
double MoveOf(const correction::AssemblyPoint& point, double payload_kg,
              const model::CellModel& before, const model::CellModel& after,
              const correction::CorrectionLimits& limits) {
  std::array<correction::Correction, 2> corrections;
  const std::array<const model::CellModel*, 2> cells{&before, &after};
  for (std::size_t k = 0; k < 2; ++k) {
    effects::Conditions conditions;
    conditions.payload_kg = payload_kg;
    correction::Corrector(*cells[k], limits)
        .Correct(point, {payload_kg, *cells[k]->payload_cog_F}, conditions, *point.near_q,
                 correction::BranchSearch::kThorough, corrections[k]);
    REQUIRE(corrections[k].code == correction::CorrectionCode::kOk);
  }
  return (corrections[1].X_BP_command.p - corrections[0].X_BP_command.p).norm();
}

}  // namespace

TEST_CASE("a point moves with the tool that was mounted when it was taught") {
  model::CellModel before = test::HeavyArm();
  const MachineConfig config = [&] {
    MachineConfig of = ConfigOf(before);
    of.limits.max_translation_m = 1;
    of.payload.source = PayloadPolicy::Source::kFixed;
    return of;
  }();
  before.tool.number = 4;
  model::Tool taught = before.tool;
  taught.number = 7;
  before.tool.tcp_F.z() += 0.4;
  before.tool.rigid = true;
  before.tool.segments.clear();
  before.further_tools = {taught};
  const PointMoves moves = ComputePointMoves(config, before, before, 0);
  REQUIRE(moves.all.size() == 3);
  for (const PointMove& move : moves.all) {
    CHECK(move.tool_number == 7);
    CHECK(move.Compared());
  }
  CHECK_THAT(TextOf(moves, "p.toml"), Catch::Contains("at 0 kg with tool 7"));
}

TEST_CASE("the change of a model is reported at the configured points, with the configured loads") {
  const model::CellModel before = test::HeavyArm();
  model::CellModel after = before;
  after.robot.joints[1].compliance_rad_per_Nm = 2e-6;
  MachineConfig config = ConfigOf(before);
  config.limits.max_translation_m = 1;
  config.points[1].payload_kg = 120;
  SECTION("a fixed mass, and a point with its own") {
    config.payload.source = PayloadPolicy::Source::kFixed;
    config.payload.fixed.mass_kg = 60;
    const PointMoves moves = ComputePointMoves(config, before, after, 0);
    REQUIRE(moves.all.size() == 3);
    const PointMove* largest = moves.Largest();
    REQUIRE(largest != nullptr);
    double expected_m = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double load_kg = k == 1 ? 120 : 60;
      CHECK(moves.all[k].payload_kg == load_kg);
      const double move_m = MoveOf(config.points[k], load_kg, before, after, config.limits);
      CHECK(moves.all[k].Distance_m() == Approx(move_m).margin(1e-9));
      expected_m = std::max(expected_m, move_m);
    }
    CHECK(expected_m > 1e-3);
    CHECK(largest->Distance_m() == Approx(expected_m).margin(1e-9));
    CHECK(moves.notes.empty());
    CHECK_THAT(TextOf(moves, "p.toml"),
               Catch::Contains(fmt::format("the largest move of a configured point is {:.3f} mm: "
                                           "point {} (point {}) at {:g} kg",
                                           1e3 * expected_m, largest->id, largest->id,
                                           largest->payload_kg)));
  }
  SECTION("every tool of a table") {
    config.payload.source = PayloadPolicy::Source::kTable;
    config.payload.table = {{1, 10, std::nullopt}, {2, 80, std::nullopt}};
    const PointMoves moves = ComputePointMoves(config, before, after, 0);
    REQUIRE(moves.all.size() == 5);
    CHECK(moves.all[0].payload_kg == 10);
    CHECK(moves.all[1].payload_kg == 80);
    CHECK(moves.all[2].payload_kg == 120);
  }
  SECTION("a load that the robot reports is not known here, and a note says so") {
    const PointMoves unknown = ComputePointMoves(config, before, after, 0);
    CHECK(unknown.all[0].payload_kg == 0);
    REQUIRE(unknown.notes.size() == 1);
    CHECK_THAT(unknown.notes[0], Catch::Contains("assumed to be no load"));
    after.domain.emplace().payload_kg = model::MeasuredRange{{{0, 60}}, {}};
    after.domain->q.assign(6, model::Interval{-10, 10});
    const PointMoves fitted = ComputePointMoves(config, before, after, 0, {{75, Vec3(0, 0, 1.3)}});
    REQUIRE(fitted.all.size() == 7);
    CHECK(fitted.all[1].payload_kg == 60);
    CHECK(fitted.all[2].payload_kg == 75);
    model::CellModel elsewhere = after;  // the robot reports the centre of mass, too
    elsewhere.payload_cog_F = Vec3(0, 0, 1.3);
    model::CellModel before_elsewhere = before;
    before_elsewhere.payload_cog_F = elsewhere.payload_cog_F;
    CHECK(fitted.all[2].Distance_m() ==
          Approx(MoveOf(config.points[0], 75, before_elsewhere, elsewhere, config.limits))
              .margin(1e-9));
    CHECK_THAT(fitted.notes[0], Catch::Contains("each of 0, 60, 75 kg"));
  }
  SECTION("the progress callback is called for each point and load, even without a solution") {
    config.payload.source = PayloadPolicy::Source::kTable;
    config.payload.table = {{1, 10, std::nullopt}, {2, 80, std::nullopt}};
    config.points[0].X_WP.p = Vec3(100, 0, 0);  // out of reach: searched thoroughly
    int steps = 0;
    const PointMoves moves = ComputePointMoves(config, before, after, 0, {}, [&steps] { ++steps; });
    CHECK(moves.all.size() == 5);
    CHECK(steps == 5);
    std::stop_source stop;  // a daemon that is to end does not compute the remaining ones
    const auto stop_at_second = [&] {
      if (++steps == 7) stop.request_stop();
    };
    CHECK(ComputePointMoves(config, before, after, 0, {}, stop_at_second, stop.get_token())
              .all.size() == 2);
  }
  SECTION("a point that a model cannot correct is listed, not left out") {
    config.payload.source = PayloadPolicy::Source::kFixed;
    after.payload_cog_F.reset();
    config.payload.fixed.mass_kg = 60;
    const PointMoves moves = ComputePointMoves(config, before, after, 0);
    CHECK(moves.Largest() == nullptr);
    CHECK_THAT(TextOf(moves, "p.toml"),
               Catch::Contains("point 1 (point 1) at 60 kg has no correction then: ") &&
                   Catch::Contains("is not known: none can be compared"));
  }
  SECTION("a point without its posture is noted") {
    config.points[2].near_q.reset();
    config.payload.source = PayloadPolicy::Source::kFixed;
    CHECK_THAT(ComputePointMoves(config, before, after, 0).notes.at(0),
               Catch::StartsWith("point 3 without near_deg"));
  }
}

TEST_CASE("a person must confirm a model that moves points farther than its data explain") {
  model::CellModel before = test::HeavyArm(), after = before;
  after.robot.joints[1].compliance_rad_per_Nm = 2e-6;
  MachineConfig config = ConfigOf(before);
  config.limits.max_translation_m = 1;
  config.payload.source = PayloadPolicy::Source::kFixed;
  config.payload.fixed.mass_kg = 60;
  const auto objections = [&] { return Objections(ComputePointMoves(config, before, after, 0)); };
  const auto fitted = [](model::CellModel& cell, double largest_m) {
    cell.domain.emplace().largest_residual_m = largest_m;
    cell.domain->payload_kg = model::MeasuredRange{{{0, 60}}, {}};
    cell.domain->q.assign(6, model::Interval{-10, 10});
  };
  const double most_m = ComputePointMoves(config, before, after, 0).Largest()->Distance_m();
  REQUIRE(most_m > 1e-3);
  SECTION("no claim is made by a model that was not fitted") {
    CHECK(objections().empty());
  }
  SECTION("three times the largest residual, of the model that comes or of the one that goes") {
    model::CellModel& claims = GENERATE(false, true) ? before : after;
    fitted(claims, 1.01 * most_m / 3);
    CHECK(objections().empty());
    fitted(claims, 0.99 * most_m / 3);
    REQUIRE(objections().size() == 1);
    CHECK_THAT(objections()[0],
               Catch::Contains(fmt::format("would move by {:.3f} mm, more than 3 times the largest "
                                           "residual that the model explains ({:.3f} mm)",
                                           1e3 * most_m, 1e3 * 0.99 * most_m / 3)));
  }
  SECTION("a point would lose its correction") {
    after.robot.joints[1].compliance_rad_per_Nm = 1e-3;
    config.limits.max_translation_m = 0.2;
    REQUIRE(objections().size() == 3);
    CHECK_THAT(objections()[0], Catch::Contains("point 1 (point 1) at 60 kg would lose its "
                                                "correction: correction too large"));
    std::swap(before, after);  // gaining one is no objection
    CHECK(objections().empty());
  }
  SECTION("a point would leave the range that its model was fitted to") {
    fitted(before, 1);
    fitted(after, 1);
    CHECK(objections().empty());
    after.domain->payload_kg = model::MeasuredRange{{{0, 40}}, {}};
    REQUIRE(objections().size() == 3);
    CHECK_THAT(objections()[0],
               Catch::Contains("would be outside the range that its model was fitted "
                               "to: the payload is 60 kg, measured: 0 to 40 kg"));
    before.domain.reset();  // it never was inside a measured range
    CHECK(objections().empty());
  }
  SECTION("many are not all listed") {
    fitted(after, 1e-9);
    const correction::AssemblyPoint point = config.points[0];
    config.points.assign(9, point);
    REQUIRE(objections().size() == 6);
    CHECK(objections()[5] == "and 4 more");
  }
}

TEST_CASE("points keep the declared base and tip, unless they are in the instrument's frame") {
  const model::CellModel declared = test::HeavyArm();
  model::CellModel fitted = declared;
  fitted.measurement.frame_known = fitted.measurement.tool_known = false;
  fitted.sessions = {{"1", {Mat3::Identity(), Vec3(0, 0, 3)}, {{std::nullopt, Vec3(0, 0.2, 0.5)}}}};
  MachineConfig config = ConfigOf(declared);
  config.limits.max_translation_m = 5;
  config.payload.source = PayloadPolicy::Source::kFixed;
  PointMoves moves = ComputePointMoves(config, declared, fitted, 0);
  REQUIRE(moves.Largest() != nullptr);
  CHECK(moves.Largest()->Distance_m() < 1e-9);
  CHECK_THAT(TextOf(moves, "p.toml"),
             Catch::Contains("the points' frame is the cell's: base and tip as declared, not as "
                             "fitted"));
  fitted.measurement.holds_points = true;
  fitted.sessions[0].X_WB = {declared.robot.X_WB.R, declared.robot.X_WB.p + Vec3(0, 0, 0.01)};
  moves = ComputePointMoves(config, declared, fitted, 0);
  REQUIRE(moves.Largest() != nullptr);
  CHECK(moves.Largest()->Distance_m() == Approx(0.01).epsilon(0.05));
  CHECK_THAT(TextOf(moves, "p.toml"), Catch::Contains("the points' frame is the instrument's"));
}

TEST_CASE("a version that the daemon refuses is withdrawn, and a confirmation is kept with it") {
  const TemporaryFolder folder;
  ModelStore store = StoreIn(folder);
  REQUIRE(store.Declare("cell 1", "cell.toml").ok());
  REQUIRE(store.Propose("cell 2", {}, "").ok());
  REQUIRE(store.Apply(2, true).ok());
  CHECK(StateOf(store).confirmed);
  CHECK(StateOf(store) == StateOf(StoreIn(folder)));
  REQUIRE(store.Withdraw(3, 1).ok());  // another version was applied meanwhile
  CHECK(StateOf(store).applied == 2);
  REQUIRE(store.Withdraw(2, 1).ok());
  CHECK(StateOf(store) == ModelState{1, 1, 0, {1}});
  REQUIRE(store.Apply(2).ok());
  CHECK_FALSE(StateOf(store).confirmed);
  REQUIRE(store.Declare("cell 1 edited", "cell.toml").ok());  // sets version 2 aside
  REQUIRE(StateOf(store).applied == 3);
  REQUIRE(store.Withdraw(3, 2).ok());
  CHECK(StateOf(store) ==
        ModelState{3, 2, 0, {1, 2}, std::nullopt, false, CellEdit{.withdrawn = 0, .accepted = 1}});
  REQUIRE(store.RollBack(true).ok());
  CHECK(StateOf(store).applied == 1);
  CHECK(StateOf(store).confirmed);
}

TEST_CASE("after a refused edit of the cell file, another edit or none leaves the model in force") {
  const TemporaryFolder folder;
  const std::string cell = DemoCell();
  const auto moved = [&](const char* z_mm) {
    return With(cell, kBase, fmt::format("base_xyz_mm = [0.0, 0.0, {}]", z_mm));
  };
  ModelStore store = StoreIn(folder);
  REQUIRE(*store.Declare(cell, "cell.toml") == 1);
  SECTION("a fitted model is in force") {
    REQUIRE(*store.Propose(cell + "# fitted\n", {}, "") == 2);
    REQUIRE(store.Apply(2).ok());
    REQUIRE(*store.Propose(cell + "# fitted anew\n", {}, "") == 3);
    REQUIRE(*store.Declare(moved("9000.0"), "cell.toml") == 4);
    REQUIRE(store.Withdraw(4, 2).ok());
    CHECK(StateOf(store).proposed == 3);                         // it waits again
    REQUIRE(*store.Declare(moved("9000.0"), "cell.toml") == 4);  // at the next reload
    CHECK(StateOf(store).applied == 2);
    const auto warnings = [&](const std::string& text) {
      const std::string file = folder.path() + "/cell.toml";
      std::ofstream(file) << text;
      config::FaultList faults;
      CheckModelStore(folder.path(), file, faults);
      return config::FaultsText(faults);
    };
    CHECK_THAT(warnings(moved("9000.0")), !Catch::Contains("aside"));
    CHECK_THAT(warnings(cell), !Catch::Contains("aside"));
    CHECK_THAT(warnings(moved("1.5")), Catch::Contains("the daemon sets version 2 aside"));

    SECTION("the edit is undone") {
      if (GENERATE(false, true)) REQUIRE(store.Apply(3).ok());
      const int applied = StateOf(store).applied;
      CHECK(*store.Declare(cell, "cell.toml") == 1);
      CHECK(StateOf(store).applied == applied);
      CHECK(StateOf(store).proposed == (applied == 2 ? 3 : 0));
      CHECK_FALSE(StateOf(store).set_aside);
      CHECK_FALSE(StateOf(store).edit);
    }
    SECTION("the edit is corrected: the reason is what changed since the model was in force") {
      CHECK(*store.Declare(moved("1.5"), "cell.toml") == 5);
      REQUIRE(StateOf(store).set_aside);
      CHECK(StateOf(store).set_aside->version == 2);
      CHECK(StateOf(store).set_aside->declared == 1);
      CHECK(StateOf(store).set_aside->withdrawn == 3);
      REQUIRE(store.Withdraw(5, 2).ok());  // refused, too
      CHECK(*store.Declare(cell, "cell.toml") == 1);
      CHECK(StateOf(store) == ModelState{1, 2, 3, {1, 2}});
    }
    SECTION("the edit is accepted") {
      REQUIRE(store.Apply(4, true).ok());
      CHECK(*store.Declare(cell, "cell.toml") == 5);  // an edit like any other
      CHECK(StateOf(store).applied == 5);
    }
  }
  SECTION("the cell file is in force") {
    REQUIRE(*store.Propose(cell + "# fitted\n", {}, "") == 2);
    REQUIRE(*store.Declare(moved("9000.0"), "cell.toml") == 3);
    REQUIRE(store.Withdraw(3, 1).ok());
    CHECK(StateOf(store).proposed == 2);
    SECTION("the edit is undone") {
      CHECK(*store.Declare(cell, "cell.toml") == 1);
      CHECK(StateOf(store) == ModelState{1, 1, 2, {1}});
    }
    SECTION("the edit is corrected: no version is set aside") {
      CHECK(*store.Declare(moved("1.5"), "cell.toml") == 4);
      CHECK(StateOf(store).applied == 4);
      CHECK_FALSE(StateOf(store).set_aside);
    }
  }
  SECTION("a model stays set aside, with what changed in the cell file in force") {
    REQUIRE(*store.Propose(cell + "# fitted\n", {}, "") == 2);
    REQUIRE(store.Apply(2).ok());
    REQUIRE(*store.Declare(moved("1.5"), "cell.toml") == 3);
    REQUIRE(*store.Declare(moved("9000.0"), "cell.toml") == 4);
    REQUIRE(store.Withdraw(4, 3).ok());
    const auto aside = StateOf(store).set_aside;
    REQUIRE(aside);
    CHECK(aside->version == 2);
    REQUIRE(aside->changes.size() == 1);
    CHECK_THAT(aside->changes[0], Catch::Contains("1.5]"));
    CHECK(*store.Declare(moved("1.5"), "cell.toml") == 3);
    CHECK(StateOf(store).applied == 3);
  }
}

TEST_CASE("the configuration of a daemon is recorded with its absolute path") {
  const TemporaryFolder folder;
  CHECK_FALSE(RecordedConfigurationPath(folder.path()));
  REQUIRE(RecordConfigurationPath(folder.path(), "here/plumbline.toml").ok());
  CHECK(RecordedConfigurationPath(folder.path()) ==
        std::filesystem::current_path().string() + "/here/plumbline.toml");
  CHECK_FALSE(RecordConfigurationPath(folder.path() + "/absent", "plumbline.toml").ok());
}

TEST_CASE("a model that depends on signals unknown for a point is refused, with the reason") {
  model::CellModel cell = plumbline::test::HeavyArm();
  const auto why = [&cell](const model::WrittenEffect& effect) {
    cell.effects = {effect};
    return ModelUnusableReason(cell).value_or("usable");
  };
  model::WrittenEffect drift;
  drift.id = "thermal_drift";
  drift.parameters = {{"x", 1, std::nullopt, "mm", ""},
                      {"time_constant", 600, std::nullopt, "s", ""}};
  model::WrittenEffect step;
  step.id = "step_event";
  step.parameters = {{"time", 5000, std::nullopt, "s", ""}, {"x", 1, std::nullopt, "mm", ""}};
  model::WrittenEffect step_by_row = step;
  step_by_row.parameters[0].name = "row";
  model::WrittenEffect curve;
  curve.id = "empirical";
  curve.parameters = {{"base_x", 1, std::nullopt, "1", ""}};
  curve.nodes.setZero(2, 2);
  curve.nodes(1, 0) = 1;
  const auto following = [&curve](const char* driver) {
    model::WrittenEffect effect = curve;
    effect.drivers = {driver};
    return effect;
  };
  CHECK_THAT(why(drift), Catch::Contains("time_zero_utc"));
  CHECK_THAT(why(step), Catch::Contains("time_zero_utc"));
  CHECK_THAT(why(following("t_s")), Catch::Contains("time_zero_utc"));
  CHECK_THAT(why(step_by_row), Catch::Contains("depends on \"row\""));
  CHECK_THAT(why(following("air_pressure_bar")), Catch::Contains("air_pressure_bar"));
  CHECK(why(following("temp_C")) == "usable");
  CHECK(why(following("q2_deg")) == "usable");
  cell.domain.emplace().time_zero_s = 1.8e9;
  CHECK(why(drift) == "usable");
  CHECK(why(step) == "usable");
  CHECK(why(following("t_s")) == "usable");
  CHECK_THAT(why(step_by_row), Catch::Contains("depends on \"row\""));
}

}  // namespace plumbline::model_store_test
