// plumbline path: a table of poses, and what it says about rows that it cannot correct.
#include <catch2/catch.hpp>

#include "app/cli/commands.h"
#include "drivers/files/text_file.h"
#include "tests/app/cli/run_command.h"
#include "tests/app/temporary_folder.h"
#include "tests/file_text.h"
#include "tests/simulator/cell.h"

namespace plumbline::path_command_test {

using namespace plumbline::cli;
using Catch::Contains;
using test::Answer;
using test::RunCommand;
using test::TemporaryFolder;

namespace {

struct Files {
  TemporaryFolder folder;
  std::string cell = folder.path() + "/cell.toml", path = folder.path() + "/path.csv",
              out = folder.path() + "/corrected.csv";

  explicit Files(const std::string& table) {
    simulator::Cell simulated = simulator::ReadyCell("ur10");
    simulated.sigma_m = 1e-4;
    simulator::WriteCell(simulated, cell);
    REQUIRE(files::WriteTextFile(path, table));
  }
  Answer Run(const std::string& options = "") const {
    return RunCommand(AddPathCommand,
                      "path " + cell + " " + path + " --output " + out + " " + options);
  }
  std::string Line(int number) const {
    std::istringstream lines(test::FileText(out));
    std::string line;
    for (int k = 0; k < number; ++k) std::getline(lines, line);
    return line;
  }
};

constexpr const char* kJoints = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,payload_kg\n";

}  // namespace

TEST_CASE("joints become corrected poses and joints") {
  const Files files(std::string(kJoints) + "10,-80,100,-60,70,20,5\r\n11,-80,100,-60,70,20,5\r\n");
  const Answer answer = files.Run();
  INFO(answer.err);
  CHECK(answer.exit_code == 0);
  CHECK_THAT(files.Line(1), Contains("x_mm,y_mm,z_mm,rx_deg") && Contains("u_mm,basis"));
  CHECK_THAT(files.Line(3), Contains("assumed") || Contains("propagated"));
  CHECK_THAT(answer.err, Contains("2 poses corrected, 0 not"));
}

TEST_CASE("without radii, their columns stay empty") {
  const Files joints(std::string(kJoints) + "10,-80,100,-60,70,20,0\n");
  REQUIRE(joints.Run("--no-radius").exit_code == 0);
  CHECK_THAT(joints.Line(2), Contains(",,,0,"));  // neither radius nor basis
}

TEST_CASE("rows that cannot be corrected keep their place and have a reason") {
  const Files files("x_mm,y_mm,z_mm,qw,qx,qy,qz\n5000,0,0,1,0,0,0\n600,100,300,0,1,0,0,9\n");
  const Answer answer = files.Run("--near 0,-90,90,-90,-90,0 --payload 3");
  CHECK(answer.exit_code == 1);
  CHECK_THAT(answer.err, Contains(":2: not corrected") && Contains(":3: not corrected") &&
                             Contains("has 8 cells, the header 7"));
  CHECK_FALSE(files.Line(3).empty());
}

TEST_CASE("a table without poses is refused") {
  const Files files("x_mm,y_mm\n1,2\n");
  const Answer answer = files.Run();
  CHECK(answer.exit_code == 2);
  CHECK_THAT(answer.err, Contains("q1_deg .. q6_deg") && Contains("qw"));
}

TEST_CASE("a corrected table is refused") {
  const Files files(std::string(kJoints) + "10,-80,100,-60,70,20,5\n");
  REQUIRE(files.Run().exit_code == 0);
  const Answer again = RunCommand(
      AddPathCommand, "path " + files.cell + " " + files.out + " --output " + files.path + ".2");
  CHECK(again.exit_code == 2);
  CHECK_THAT(again.err, Contains("already corrected"));
}

TEST_CASE("the output does not replace the input") {
  const Files files(kJoints);
  CHECK(RunCommand(AddPathCommand,
                   "path " + files.cell + " " + files.path + " --output " + files.path)
            .exit_code == 2);
}

}  // namespace plumbline::path_command_test
