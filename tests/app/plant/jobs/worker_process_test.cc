// Workers as processes that are killed, stopped and cut off from their database.
#include <catch2/catch.hpp>

#include "app/base/text/json_text.h"
#include "app/measure/table/csv.h"
#include "app/plant/jobs/cell_work.h"
#include "tests/app/base/text/test_keys.h"
#include "tests/app/plant/database/postgres_process.h"
#include "tests/app/plant/jobs/plant_cells.h"
#include "tests/app/plant/jobs/plant_program.h"

namespace plumbline::plant::worker_process_test {

using test::PlantProgram;
using test::Soon;

/// One server for all cases: each has its schema anew.
test::PostgresProcess& Server() {
  static test::PostgresProcess server;
  return server;
}

Connection NewPlant() {
  Connection owner = Server().Connect();
  REQUIRE(owner.RunScript("DROP SCHEMA IF EXISTS plumbline CASCADE; DROP ROLE IF EXISTS w").ok());
  return Server().ConnectToNewPlant();
}

/// A plant with cells of 30 rows each.
struct Station {
  explicit Station(int cells) : owner(NewPlant()) {
    const std::string toml = test::FileText("config/cells/ur10.toml");
    const auto joints = test::JointsOf(toml);
    for (int k = 0; k < cells; ++k) {
      const auto cell = test::AddCell(owner, "line-1", fmt::format("cell-{}", k), toml);
      test::AddProbes(owner, cell, test::AnyRows(30, joints.size()), joints);
    }
    REQUIRE(owner.RunScript("CREATE ROLE w LOGIN IN ROLE plumbline_worker").ok());
  }
  std::vector<std::string> Words(std::vector<std::string> words) const {
    words.insert(words.begin(), PLUMBLINE_PLANT);
    words.insert(words.end(), {"--database", server.Settings("plumbline", "w")});
    return words;
  }
  /// @return  exit code
  int Run(std::vector<std::string> words) const {
    return PlantProgram(Words(std::move(words)), Log()).End();
  }
  std::vector<std::string> Worker(std::vector<std::string> further = {}) const {
    further.insert(further.begin(), {"worker", "--lease-s", "2", "--program", stub.path()});
    return Words(std::move(further));
  }
  std::string Log() const { return folder.path() + "/log"; }
  std::int64_t Count(const std::string& what) {
    const auto rows = owner.Run(("SELECT count(*) FROM " + what).c_str());
    return rows.ok() ? rows->Integer(0, 0) : -1;
  }

  const test::TemporaryFolder folder;
  const test::StubDiagnosis stub;
  test::PostgresProcess& server = Server();
  Connection owner;
};

bool Skipped() {
  if (!test::PostgresPrograms().empty()) return false;
  WARN("SKIPPED: no PostgreSQL 15 here");
  return true;
}

TEST_CASE("the jobs of a killed worker are done once, by another") {
  if (Skipped()) return;
  Station plant(3);
  REQUIRE(plant.Run({"schedule"}) == 0);
  REQUIRE(plant.Run({"schedule"}) == 0);
  REQUIRE(plant.Count("job") == 3);
  plant.stub.Set("hold");
  PlantProgram killed(plant.Worker({"--jobs", "2"}), plant.Log());
  INFO(test::FileText(plant.Log()));
  REQUIRE(Soon([&] { return plant.stub.Runs() == 2; }));
  killed.End(SIGKILL);
  plant.stub.Clear("hold");
  PlantProgram other(plant.Worker(), plant.Log());
  REQUIRE(Soon([&] { return plant.Count("job WHERE finished IS NOT NULL") == 3; }));
  CHECK(plant.Count("result") == 3);
  CHECK(plant.Count("job WHERE attempts = 2 AND failed IS NULL") == 2);
  CHECK(plant.owner.Run("SELECT output->>'limit_kb' FROM result LIMIT 1")->Integer(0, 0) ==
        4096 * 1024);
  CHECK(plant.owner.Run("SELECT output->'plant'->>'rows' FROM result LIMIT 1")->Text(0, 0) == "30");
  CHECK(other.End(SIGTERM) == 0);
}

TEST_CASE("an answer outlives a crash of the database, and SIGTERM hands a job back") {
  if (Skipped()) return;
  Station plant(1);
  REQUIRE(plant.Run({"schedule"}) == 0);
  plant.stub.Set("hold");
  PlantProgram worker(plant.Worker(), plant.Log());
  REQUIRE(Soon([&] { return plant.stub.Runs() == 1; }));
  plant.server.Stop(SIGKILL);
  plant.stub.Clear("hold");
  REQUIRE(Soon([&] {
    return test::FileText(plant.Log()).find("running jobs continue") != std::string::npos;
  }));
  plant.server.Start();
  plant.owner = plant.server.Connect();
  INFO(test::FileText(plant.Log()));
  REQUIRE(Soon([&] { return plant.Count("result") == 1; }));
  CHECK(plant.Count("job WHERE attempts = 1 AND failed IS NULL") == 1);
  CHECK(plant.stub.Runs() == 1);

  REQUIRE(plant.owner.RunScript("UPDATE probe SET utc = utc + interval '1 s'").ok());
  REQUIRE(plant.Run({"schedule"}) == 0);
  plant.stub.Set("hold");
  REQUIRE(Soon([&] { return plant.stub.Runs() == 2; }));
  CHECK(worker.End(SIGTERM) == 0);
  CHECK(plant.Count("job WHERE finished IS NULL AND attempts = 0 AND worker IS NULL") == 1);
}

TEST_CASE("a job that crashes, hangs or is refused is named") {
  if (Skipped()) return;
  Station plant(1);
  REQUIRE(plant.Run({"schedule"}) == 0);
  const auto once = [&plant](std::vector<std::string> further) {
    further.emplace_back("--once");
    return PlantProgram(plant.Worker(std::move(further)), plant.Log()).End();
  };
  plant.stub.Set("fail");
  CHECK(once({}) == 1);
  CHECK(plant.Count("job WHERE finished IS NOT NULL AND attempts = 3 AND failed ="
                    " 'killed by signal 11: it \"broke\"'") == 1);
  CHECK(plant.stub.Runs() == 3);
  plant.stub.Clear("fail");

  REQUIRE(plant.Run({"schedule", "--last", "25"}) == 0);
  plant.stub.Set("hold");
  CHECK(once({"--timeout-s", "1"}) == 1);
  CHECK(plant.Count("job WHERE failed LIKE 'not finished within 1 s%'") == 1);
  plant.stub.Clear("hold");

  REQUIRE(plant.Run({"schedule", "--last", "26"}) == 0);
  plant.stub.Set("refuse");
  CHECK(once({}) == 0);
  CHECK(plant.Count("result WHERE output->>'refused' = 'no use'") == 1);
}

TEST_CASE("versions are compared on the same rows") {
  if (Skipped()) return;
  Station plant(4);
  const test::StubDiagnosis newer("stub 2", "an option that is not known here");
  const std::string json = plant.folder.path() + "/comparison.json";
  const std::vector<std::string> compare = {"compare", "--program", newer.path(), "--json", json};
  CHECK(plant.Run(compare) == 1);  // nothing is stored yet
  REQUIRE(plant.Run({"schedule"}) == 0);
  PlantProgram worker(plant.Worker({newer.path()}), plant.Log());
  REQUIRE(Soon([&] { return plant.Count("result") == 4; }));
  INFO(test::FileText(plant.Log()));
  CHECK(plant.Run(compare) == 0);
  CHECK(text::JsonOrNull(test::FileText(json))["equal"] == 4);
  CHECK(newer.Runs() == 4);
  CHECK(plant.Run(compare) == 0);
  CHECK(newer.Runs() == 4);
  CHECK(plant.Count("result WHERE program LIKE 'stub 2, %'") == 4);
  CHECK(
      plant.Count("result WHERE program LIKE 'stub 1, %' AND output->>'may_use_prior' = 'false'") ==
      4);  // whatever is installed on the machine

  auto against = compare;
  against.insert(against.end(), {"--against", plant.stub.path(), "--last", "25"});
  newer.Set("refuse");
  CHECK(plant.Run(against) == 1);
  CHECK(text::JsonOrNull(test::FileText(json))["worse"] == 4);
}

TEST_CASE("a prior is made of the arms of one model, in steps that are not repeated") {
  if (Skipped()) return;
  Station plant(3);
  const std::string toml = test::FileText("config/cells/ur10.toml");
  test::AddCell(plant.owner, "line-1", "empty", toml);
  test::AddCell(plant.owner, "line-1", "other", toml, "KR 210");
  const std::string key = plant.folder.path() + "/plant.key", file = plant.folder.path() + "/prior";
  std::ofstream(key) << "key";
  const auto prior = [&] {
    return plant.Run(
        {"prior", "UR10", "--key", key, "--output", file, "--program", plant.stub.path()});
  };
  PlantProgram worker(plant.Worker(), plant.Log());
  CHECK(prior() == 1);
  CHECK(plant.Count("job") == 0);
  CHECK(test::FileText(plant.Log()).find("is not an Ed25519 private key") != std::string::npos);
  std::ofstream(key) << test::kPrivateKey;
  REQUIRE(prior() == 0);
  INFO(test::FileText(plant.Log()));
  CHECK(text::JsonOrNull(test::FileText(file))["step"] == "sign");
  CHECK(plant.Count("prior WHERE arm_model = 'UR10' AND arms = 3") == 1);
  CHECK(plant.Count("result WHERE output->>'step' = 'arm'") == 3);
  // The arm, its rows and the agreed sizes.
  CHECK(plant.Count("result WHERE output->>'step' = 'fit' AND output->>'files' = '3'") == 3);
  CHECK(test::FileText(plant.Log()).find("left out: line-1/empty: 0 rows") != std::string::npos);
  const std::size_t runs = plant.stub.Runs();
  CHECK(runs == 3 + 3 + 3);  // arms, fits; sizes, pool, sign
  REQUIRE(prior() == 0);
  CHECK(plant.stub.Runs() == runs + 3);
  CHECK(plant.Run({"prior", "none", "--key", key, "--output", file}) == 1);
}

TEST_CASE("the stored rows of a simulated cell are diagnosed and exported") {
  if (Skipped()) return;
  const test::TemporaryFolder made;
  PlantProgram simulate(
      {PLUMBLINE_SIMULATE, "--family", "joint_compliance@q2,q3", "--robot", "ur10", "--rows", "40",
       "--seed", "3", "--signal", "20", "--out", made.path()},
      made.path() + "/log");
  REQUIRE(simulate.End() == 0);
  const std::string toml = test::FileText(made.path() + "/cell.toml");
  const auto joints = test::JointsOf(toml);
  config::FaultList faults;
  const auto table = measure::TableFromCsv(test::FileText(made.path() + "/measured.csv"),
                                           "measured.csv", joints, faults);
  REQUIRE(table);
  Station plant(0);
  const auto cell = test::AddCell(plant.owner, "line-1", "cell-1", toml);
  test::AddProbes(plant.owner, cell, cell::JournalRowsFrom(*table), joints);
  REQUIRE(plant.Run({"schedule"}) == 0);
  CHECK(
      PlantProgram(plant.Words({"worker", "--once", "--program", PLUMBLINE}), plant.Log()).End() ==
      0);
  INFO(test::FileText(plant.Log()));
  CHECK(plant.Count("result WHERE output->>'verdict' = 'explained'"
                    " AND output->'effects'->0->>'id' = 'joint_compliance'") == 1);
  const std::string csv = made.path() + "/exported.csv", file = made.path() + "/exported.toml";
  CHECK(plant.Run({"export", "line-1/cell-1", "--output", csv, "--cell-output", file}) == 0);
  CHECK(test::FileText(file) == toml);
  const auto exported = measure::TableFromCsv(test::FileText(csv), csv, joints, faults);
  REQUIRE(exported);
  CHECK(exported->rows.size() == table->rows.size());
  CHECK((*exported->rows[7].measured_W - *table->rows[7].measured_W).norm() < 1e-8);
  CHECK((exported->rows[7].q - table->rows[7].q).norm() < 1e-8);
}

}  // namespace plumbline::plant::worker_process_test
