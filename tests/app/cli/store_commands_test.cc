// plumbline journal and plumbline model, run as the real program.
#include <fcntl.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <thread>

#include "app/base/text/json_text.h"
#include "tests/app/cell/daemon/demo_config.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::store_commands_test {

using plumbline::test::TemporaryFolder;

namespace {

struct Answer {
  int code = -1;
  std::string text;  ///< both streams
};

Answer Plumbline(const std::string& arguments) {
  Answer answer;
  FILE* pipe = popen(("exec 2>&1; " PLUMBLINE " " + arguments).c_str(), "r");
  REQUIRE(pipe != nullptr);
  char buffer[4096];
  while (const std::size_t got = fread(buffer, 1, sizeof buffer, pipe)) {
    answer.text.append(buffer, got);
  }
  answer.code = WEXITSTATUS(pclose(pipe));
  return answer;
}

constexpr const char* kCell = "config/cells/ur10.toml";

}  // namespace

TEST_CASE("a table is imported completely or not at all, and can be exported again") {
  const TemporaryFolder folder;
  const std::string csv = folder.path() + "/measured.csv", out = folder.path() + "/out.csv";
  const std::string where = " --state " + folder.path() + "/state";
  std::ofstream(csv) << "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm\n"
                        "1,2,3,4,5,6,7,8,9\n"
                        "1,2,x,4,5,6,7,8,9\n"
                        "2,2,3,4,5,6,7,8,\n"
                        "3,2,3,4,5,6,7,8,9.5\n";
  const std::string import = "journal import " + csv + " --cell " + kCell + where;
  const Answer none = Plumbline("journal show" + where);
  CHECK(none.code == 1);
  CHECK_THAT(none.text,
             Catch::Contains("the journal does not exist yet") && Catch::Contains("--state"));

  Answer answer = Plumbline(import);
  CHECK(answer.code == 1);
  CHECK_THAT(answer.text, Catch::Contains(":3 q3_deg") && Catch::Contains("1 of 3 rows") &&
                              Catch::Contains("--skip-bad"));
  CHECK(Plumbline("journal show" + where).code == 1);  // nothing was imported

  answer = Plumbline(import + " --skip-bad");
  CHECK(answer.code == 0);
  CHECK_THAT(answer.text, Catch::Contains("2 rows imported as 1..2, 2 skipped") &&
                              Catch::Contains("without a measured point") &&
                              Catch::Contains("line 4"));
  answer = Plumbline(import + " --skip-bad");
  CHECK(answer.code == 1);
  CHECK_THAT(answer.text, Catch::Contains("--again"));

  answer = Plumbline("journal show --json --last 1" + where);
  CHECK(answer.code == 0);
  CHECK(text::JsonOrNull(answer.text)["q"][0].get<double>() == Approx(3));
  CHECK_THAT(Plumbline("journal tail --once" + where).text, Catch::Contains(" 9.50 "));
  CHECK_THAT(Plumbline("journal show" + where).text, Catch::StartsWith("   row  time"));

  const std::string touched = folder.path() + "/touched.csv";
  std::ofstream(touched) << "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,artefact\n1,2,3,4,5,6,bal\n";
  answer = Plumbline("journal import " + touched + " --cell " + kCell + where);
  CHECK(answer.code == 1);
  CHECK_THAT(answer.text, Catch::Contains("line 2: artefact \"bal\" is not declared in the cell"));

  answer = Plumbline("journal export --cell " + std::string(kCell) + " --out " + out + where);
  CHECK(answer.code == 0);
  CHECK(Plumbline("journal import " + out + " --cell " + kCell + where).code == 0);
  CHECK(Plumbline("journal export --session none --cell " + std::string(kCell) + " --out " + out +
                  where)
            .code == 1);
}

TEST_CASE(
    "journal commands: exit code 1 for unreadable inputs, 2 for outputs that would overwrite one") {
  const TemporaryFolder folder;
  const std::string where = " --state " + folder.path() + "/state";
  const std::string cell = folder.path() + "/cell.toml", csv = folder.path() + "/measured.csv";
  std::filesystem::copy_file(kCell, cell);
  Answer answer = Plumbline("journal import " + csv + " --cell " + cell + where);
  CHECK(answer.code == 1);
  CHECK_THAT(answer.text, Catch::Contains("measured.csv: cannot be read"));
  std::ofstream(csv) << "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm\n"
                        "1,2,3,4,5,6,7,8,9\n";
  CHECK(Plumbline("journal import " + csv + " --cell absent.toml" + where).code == 1);
  CHECK(Plumbline("journal import " + csv + " --cell " + cell + " --state /dev/null").code == 2);
  REQUIRE(Plumbline("journal import " + csv + " --cell " + cell + where).code == 0);

  const std::string journal = folder.path() + "/state/journal.sqlite";
  const std::string export_to = "journal export --cell " + cell + where + " --out ";
  for (const std::string& out : {cell, journal}) {
    CAPTURE(out);
    const auto size = std::filesystem::file_size(out);
    const auto refused = Plumbline(export_to + out);
    CHECK(refused.code == 2);
    CHECK_THAT(refused.text, Catch::Contains("--output would overwrite " + out));
    CHECK(std::filesystem::file_size(out) == size);
  }
  CHECK(Plumbline("journal export --cell " + cell + " --out /no/such/out.csv" + where).code == 2);
  answer = Plumbline("journal show" + where + " > /dev/full");
  CHECK(answer.code == 2);
  CHECK_THAT(answer.text, Catch::Contains("standard output cannot be written"));
  CHECK(Plumbline("journal tail" + where + " > /dev/full").code == 2);  // it does not go on
}

TEST_CASE("for a model of the same arm, the movement of the tip is reported") {
  const TemporaryFolder folder;
  const std::string where = " --state " + folder.path(), longer = folder.path() + "/longer.toml";
  std::ifstream file(kCell);
  std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const std::string bare = "tcp_mm = [0.0, 0.0, 0.0]";
  REQUIRE(text.find(bare) != std::string::npos);
  text.replace(text.find(bare), bare.size(), "tcp_mm = [0.0, 0.0, 2.5]");
  std::ofstream(longer) << text;
  REQUIRE(Plumbline("model propose " + std::string(kCell) + where).code == 0);
  REQUIRE(Plumbline("model apply 1" + where).code == 0);
  const Answer proposed = Plumbline("model propose " + longer + where);
  CHECK(proposed.code == 0);
  CHECK_THAT(proposed.text,
             Catch::Contains("it moves the tip by up to 2.500 mm") &&
                 Catch::Contains("No daemon has recorded its configuration in " + folder.path()) &&
                 Catch::Contains("How far its points move under load is therefore unknown"));
}

TEST_CASE(
    "the change of a model is reported at the points of the given or recorded configuration") {
  const TemporaryFolder folder;
  const std::string state = folder.path() + "/state", where = " --state " + state;
  const std::string config = folder.path() + "/plumbline.toml";
  const std::string cell = "tests/virtual_cell/demo/cockpit-cell.toml";
  std::string text = plumbline::test::DemoConfig("127.0.0.1:502", "universal-robots-fine");
  text = plumbline::test::WithLine(text, "payload", "source", "\"fixed\"\nmass_kg = 60.0");
  std::ofstream(config) << text;
  const std::string longer = folder.path() + "/longer.toml";
  std::ofstream(longer) << plumbline::test::WithLine(plumbline::test::FileText(cell), "",
                                                     "base_xyz_mm", "[0.0, 0.0, 2.5]");
  std::filesystem::create_directory(state);
  REQUIRE(Plumbline("model propose " + cell + where).code == 0);
  REQUIRE(Plumbline("model apply 1" + where).code == 0);
  const std::string told = "the largest move of a configured point is 2.500 mm: point ";
  const Answer given = Plumbline("model propose " + longer + where + " --config " + config);
  CHECK(given.code == 0);
  CHECK_THAT(given.text, Catch::Contains(told) && Catch::Contains(" at 60 kg"));

  const Answer unknown = Plumbline("model propose " + longer + where);
  CHECK_THAT(unknown.text, Catch::Contains("is therefore unknown") && !Catch::Contains(told));
  std::ofstream(state + "/configuration") << config << '\n';  // as the daemon leaves it
  CHECK_THAT(Plumbline("model apply 2" + where).text, Catch::Contains(told));
  CHECK_THAT(Plumbline("model rollback" + where).text, Catch::Contains(told));

  const Answer absent =
      Plumbline("model apply 2" + where + " --config " + folder.path() + "/no.toml");
  CHECK(absent.code == 1);
  CHECK_THAT(absent.text, Catch::Contains("not applied"));
  std::ofstream(config) << plumbline::test::WithLine(text, "", "state_directory", "\"elsewhere\"");
  CHECK_THAT(Plumbline("model apply 2" + where).text,
             Catch::Contains("give the configuration with"));
}

TEST_CASE("the reason why a model is no longer in force is printed, with a remedy") {
  const TemporaryFolder folder;
  const std::string where = " --state " + folder.path();
  const std::string state = folder.path() + "/models/state.json";
  REQUIRE(Plumbline("model propose " + std::string(kCell) + where).code == 0);
  REQUIRE(Plumbline("model propose " + std::string(kCell) + where).code == 0);
  std::ofstream(state) << R"({"schema": 1, "declared": 1, "applied": 1, "proposed": 0,
    "history": [2, 1], "set_aside": {"version": 2, "declared": 1,
    "changes": ["robot.joint[2].compliance_rad_per_Nm 1e-06 -> 2e-06"], "withdrawn": 0}})";
  const Answer list = Plumbline("model list" + where);
  CHECK(list.code == 0);
  CHECK_THAT(list.text,
             Catch::Contains("SET ASIDE\n") &&
                 Catch::Contains("model version 2 is set aside: the cell file changed since: "
                                 "robot.joint[2].compliance_rad_per_Nm 1e-06 -> 2e-06") &&
                 Catch::Contains("`plumbline model apply 2" + where + "`"));
  const auto json = text::JsonOrNull(Plumbline("model list --json" + where).text);
  CHECK(json[0]["set_aside"] == false);
  CHECK(json[1]["set_aside"] == true);
  CHECK(json[1]["set_aside_because"][0] == "robot.joint[2].compliance_rad_per_Nm 1e-06 -> 2e-06");

  std::ofstream(state, std::ios::trunc).close();  // as a power cut may leave it
  for (const char* command : {"model list", "model rollback", "model show"}) {
    const Answer damaged = Plumbline(command + where);
    CAPTURE(command);
    CHECK(damaged.code == 1);
    CHECK_THAT(damaged.text,
               Catch::Contains("is empty, so it is unknown which model was in force") &&
                   Catch::Contains("`plumbline model apply N" + where + "`"));
  }
  CHECK_THAT(Plumbline("model list" + where).text, Catch::Contains("\n      2  "));
  REQUIRE(Plumbline("model apply 2" + where).code == 0);
  CHECK_THAT(Plumbline("model list" + where).text, Catch::Contains("APPLIED"));
}

TEST_CASE("models are proposed, applied and rolled back; a faulty one is never accepted") {
  const TemporaryFolder folder;
  const std::string where = " --state " + folder.path();
  CHECK(Plumbline("model list" + where).code == 1);
  const std::string faulty = folder.path() + "/faulty.toml";
  std::ofstream(faulty) << "schema = 1\n[robot]\nname = 3\n";
  const Answer refused = Plumbline("model propose " + faulty + where);
  CHECK(refused.code == 1);
  CHECK_THAT(refused.text, Catch::Contains("robot.name"));
  CHECK(Plumbline("model list" + where).code == 1);

  CHECK(Plumbline("model propose absent.toml" + where).code == 1);
  for (const char* option : {" --report", " --diagnosis"}) {
    CAPTURE(option);
    CHECK(Plumbline("model propose " + std::string(kCell) + option + " absent" + where).code == 1);
  }

  CHECK(Plumbline("model propose config/cells/ur10.toml" + where).code == 0);
  CHECK(Plumbline("model propose config/cells/ur5.toml" + where).code == 0);
  CHECK(Plumbline("model apply 1" + where).code == 0);
  const Answer other = Plumbline("model apply 2" + where);
  CHECK(other.code == 1);
  CHECK_THAT(other.text, Catch::Contains("this cell describes another arm: its flange is up to ") &&
                             Catch::Contains("--force") &&
                             Catch::Contains("version 2 not applied"));
  CHECK(Plumbline("model propose config/cells/iiwa7.toml" + where).code == 1);
  const Answer applied = Plumbline("model apply 2 --force" + where);
  CHECK(applied.code == 0);
  CHECK_THAT(applied.text, Catch::Contains("no daemon is running"));
  CHECK_THAT(Plumbline("model show" + where).text,
             Catch::Contains("# version 2") && Catch::Contains("APPLIED"));
  const Answer none = Plumbline("model apply 3" + where);
  CHECK(none.code == 1);
  CHECK(none.text == "no version 3; `plumbline model list` lists all versions\n");
  CHECK(Plumbline("model show 3" + where).text == none.text);
  CHECK(Plumbline("model rollback" + where).code == 0);
  CHECK(text::JsonOrNull(Plumbline("model list --json" + where).text)[0]["applied"] == true);
  CHECK(Plumbline("model rollback" + where).code == 1);
  CHECK(Plumbline("model rollback --to 2" + where).code == 1);
  CHECK(Plumbline("model rollback --force --to 2" + where).code == 0);
  CHECK(Plumbline("model apply" + where).code == 2);
  CHECK(Plumbline("model").code == 2);
}

TEST_CASE("waiting for a locked model store is reported, and ends with a timeout") {
  const TemporaryFolder folder;
  const std::string where = " --state " + folder.path();
  REQUIRE(Plumbline("model propose " + std::string(kCell) + where).code == 0);
  const std::string path = folder.path() + "/models/lock";
  const int fd = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  REQUIRE(fd >= 0);
  REQUIRE(flock(fd, LOCK_EX) == 0);
  SECTION("for good") {
    const Answer refused = Plumbline("model apply 1" + where);
    CHECK(refused.code == 2);
    CHECK_THAT(refused.text, Catch::Contains("waiting for ") &&
                                 Catch::Contains("which holds " + path) &&
                                 Catch::Contains(path + ": waited 10 s for the lock, which ") &&
                                 Catch::Contains(" now holds. Nothing was changed. "
                                                 "Wait until it has finished, or stop it"));
  }
  SECTION("for a moment") {
    std::thread holder([fd] {
      std::this_thread::sleep_for(std::chrono::seconds(3));
      flock(fd, LOCK_UN);
    });
    const Answer applied = Plumbline("model apply 1" + where);
    holder.join();
    CHECK(applied.code == 0);
    CHECK_THAT(applied.text, Catch::Contains("waiting for "));
  }
  close(fd);
}

}  // namespace plumbline::store_commands_test
