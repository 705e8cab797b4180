// plumbline program as a command: files, a second run, and exit codes.
#include "app/cli/program_command.h"

#include <fmt/format.h>

#include <array>
#include <catch2/catch.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/base/config/cell_reader.h"
#include "drivers/files/text_file.h"
#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"
#include "tests/app/cli/run_command.h"
#include "tests/app/programs/toy_brand.h"
#include "tests/app/temporary_folder.h"
#include "tests/file_text.h"
#include "tests/simulator/cell.h"

namespace plumbline::program_command_test {

using Catch::Contains;
using test::Answer;
using test::FileText;

namespace {

void AddToyCommand(CLI::App& app, int& exit_code) {
  static const test::ToyBrand kToy;
  static const std::array<const programs::Brand*, 1> kBrands = {&kToy};
  cli::AddProgramCommandFor(kBrands, app, exit_code);
}

void AddToyCommandWithoutComments(CLI::App& app, int& exit_code) {
  static const test::ToyBrand kToy({}, false);
  static const std::array<const programs::Brand*, 1> kBrands = {&kToy};
  cli::AddProgramCommandFor(kBrands, app, exit_code);
}

struct Program {
  test::TemporaryFolder folder;
  std::string cell = folder.path() + "/cell.toml", file = folder.path() + "/a.toy",
              corrected = folder.path() + "/corrected/a.toy";
  std::string text;

  explicit Program(const std::string& more = "") {
    simulator::Cell simulated = simulator::ReadyCell("ur10");
    simulated.sigma_m = 1e-4;
    simulator::WriteCell(simulated, cell);
    config::FaultList faults;
    const deflection::LoadedArm arm(*config::ReadCell(cell, faults));
    text = fmt::format("tool t 0 0 {} 0 0 0\n", 1e3 * arm.X_FT().p.z());
    model::JointVector q(6);
    q << 10, -80, 100, -60, 70, 20;
    for (const char* name : {"p", "q"}) {
      const Pose X_BT = arm.UnloadedTip(kRadPerDeg * q);
      const Vec3 turn = kDegPerRad * VectorFromRotation(X_BT.R);
      text += fmt::format("point {} {:.4f} {:.4f} {:.4f} {:.4f} {:.4f} {:.4f} posture={}\n", name,
                          1e3 * X_BT.p.x(), 1e3 * X_BT.p.y(), 1e3 * X_BT.p.z(), turn.x(), turn.y(),
                          turn.z(), test::ToyBrand::PostureText(q));
      q[0] += 20;
    }
    text += "sub main starts\nuse t\nJ p\nL q\n" + more + "end\n";
    REQUIRE(files::WriteTextFile(file, text));
  }

  void Replace(const std::string& old, const std::string& by) {
    text.replace(text.find(old), old.size(), by);
    REQUIRE(files::WriteTextFile(file, text));
  }

  Answer Run(const std::string& options = "--load 5", const std::string& of = "") const {
    return test::RunCommand(AddToyCommand,
                            "program " + cell + " " + (of.empty() ? file : of) + " " + options);
  }
};

}  // namespace

TEST_CASE("the corrected program is written beside the original, which stays") {
  const Program program;
  const Answer answer = program.Run();
  INFO(answer.err << answer.out);
  CHECK(answer.exit_code == 0);
  CHECK_THAT(answer.out, Contains("2 points corrected"));
  CHECK(FileText(program.file) == program.text);
  CHECK_THAT(FileText(program.corrected), Contains("# plumbline "));
  CHECK_THAT(FileText(program.corrected + ".plumbline.json"),
             Contains("\"original\": \"../a.toy\""));
}

TEST_CASE("a second run changes nothing") {
  const Program program;
  REQUIRE(program.Run().exit_code == 0);
  const std::string once = FileText(program.corrected);
  CHECK(program.Run().exit_code == 0);
  CHECK(FileText(program.corrected) == once);
  const Answer answer = program.Run("--load 5", program.corrected);
  CHECK(answer.exit_code == 0);
  CHECK_THAT(answer.err, Contains("already corrected"));
  CHECK(FileText(program.corrected) == once);
}

TEST_CASE("a corrected file that was edited is refused, unless it starts again") {
  const Program program;
  REQUIRE(program.Run().exit_code == 0);
  const std::string once = FileText(program.corrected);
  std::string edited = once;
  const std::size_t digit = edited.find("point p ") + 8;
  edited[digit] = edited[digit] == '9' ? '8' : '9';
  REQUIRE(files::WriteTextFile(program.corrected, edited));
  const Answer refused = program.Run("--load 5", program.corrected);
  CHECK(refused.exit_code == 2);
  CHECK_THAT(refused.err, Contains("were changed since"));
  CHECK(FileText(program.corrected) == edited);
  const Answer again = program.Run("--load 5 --again", program.corrected);
  INFO(again.err);
  CHECK(again.exit_code == 0);
  CHECK(FileText(program.corrected) == once);
  CHECK(FileText(program.file) == program.text);
}

TEST_CASE("points that are left have the exit code 1 and their line") {
  const Program program("search q\n");
  const Answer answer = program.Run();
  CHECK(answer.exit_code == 1);
  CHECK_THAT(answer.out, Contains("a.toy:8: q stays as it is: a search ends"));
}

TEST_CASE("a load that nobody states is asked for") {
  const Answer answer = Program().Run("");
  CHECK(answer.exit_code == 1);
  CHECK_THAT(answer.out, Contains("give --load KG"));
}

TEST_CASE("--routine states that a routine which is in none of the files changes nothing") {
  const Program program("call grip\nL p\n");
  const Answer unknown = program.Run();
  CHECK(unknown.exit_code == 1);
  CHECK_THAT(unknown.out, Contains("--routine 'grip=harmless'"));
  CHECK(program.Run("--load 5 --routine grip=harmless").exit_code == 0);
  const Answer wrong = program.Run("--load 5 --routine grip=slow");
  CHECK(wrong.exit_code == 2);
  CHECK_THAT(wrong.err, Contains("--routine grip=slow: give NAME=harmless"));
}

TEST_CASE("the report as JSON has every point") {
  const Program program;
  const nlohmann::json report = nlohmann::json::parse(program.Run("--load 5 --json").out);
  CHECK(report["counts"]["corrected"] == 2);
  CHECK(report["corrected"][0]["error_after_mm"] < 0.01);
  CHECK(report["corrected"][0]["error_before_mm"] > 0.05);
}

TEST_CASE("a dry run writes the report only") {
  const Program program;
  const std::string page = program.folder.path() + "/report.html";
  CHECK(program.Run("--load 5 --dry-run --report " + page).exit_code == 0);
  CHECK_THAT(FileText(page), Contains("<svg"));
  CHECK(FileText(program.corrected).empty());
}

TEST_CASE("two versions of a program are compared") {
  const Program program;
  REQUIRE(program.Run().exit_code == 0);
  const Answer answer =
      test::RunCommand(AddToyCommand, "program --check " + program.file + " " + program.corrected);
  CHECK(answer.exit_code == 0);
  CHECK_THAT(answer.out, Contains("2 of 2 points differ") && Contains("nothing else differs"));
}

TEST_CASE("an output that would replace the program is refused") {
  const Program program;
  const Answer answer = program.Run("--load 5 --output " + program.folder.path());
  CHECK(answer.exit_code == 2);
  CHECK(FileText(program.file) == program.text);
}

TEST_CASE("frames and loads come from a file, with its line where it is wrong") {
  const Program program;
  const std::string frames = program.folder.path() + "/frames.toml";
  REQUIRE(files::WriteTextFile(frames,
                               "[tool.\"t\"]\nnumber = 1\nload_kg = 12\ncog_mm = [0, 0, 200]\n"));
  CHECK(program.Run("--frames " + frames).exit_code == 0);
  REQUIRE(files::WriteTextFile(frames, "[tool.\"t\"]\nnumber = 1\nload = 12\n"));
  const Answer answer = program.Run("--frames " + frames);
  CHECK(answer.exit_code == 2);
  CHECK_THAT(answer.err, Contains("frames.toml:3"));
}

TEST_CASE("joint targets that nobody wants corrected are no failure") {
  Program program("J home\n");
  program.Replace("sub main", "joints home 10 -80 90 -60 70 20\nsub main");
  const Answer answer = program.Run();
  CHECK(answer.exit_code == 0);
  CHECK_THAT(answer.out, Contains("1 left by choice"));
  CHECK(program.Run("--load 5 --joints --force").exit_code == 0);
}

TEST_CASE("a motion to a computed target is listed with its line") {
  const Program program("L computed\n");
  const Answer answer = program.Run();
  CHECK(answer.exit_code == 1);
  CHECK_THAT(answer.out, Contains("a.toy:8: the motion to computed stays as it is") &&
                             Contains("1 motion not to a corrected point"));
  const auto report = nlohmann::json::parse(program.Run("--load 5 --json --dry-run").out);
  CHECK(report["left_motions"][0]["line"] == 8);
}

TEST_CASE("beside a corrected file, a new one is corrected") {
  const Program program;
  REQUIRE(program.Run().exit_code == 0);
  const std::string once = FileText(program.corrected), next = program.folder.path() + "/b.toy";
  std::string text = program.text;
  for (const char* const point : {"point p ", "point q "}) {
    text.replace(text.find(point) + 6, 1, point[6] == 'p' ? "r" : "s");
  }
  text.replace(text.find("sub main"), 8, "sub more");
  text.replace(text.find("J p\nL q"), 7, "J r\nL s");
  REQUIRE(files::WriteTextFile(next, text));
  const Answer answer = program.Run("--load 5", program.corrected + " " + next);
  INFO(answer.err << answer.out);
  CHECK(answer.exit_code == 0);
  CHECK_THAT(answer.err, Contains("a.toy: is already corrected"));
  CHECK_THAT(FileText(program.folder.path() + "/corrected/b.toy"), Contains("# plumbline "));
  CHECK(FileText(program.corrected) == once);
}

TEST_CASE("an output that was edited, or that no run wrote, is replaced only by force") {
  const Program program;
  REQUIRE(program.Run().exit_code == 0);
  const std::string edited = FileText(program.corrected) + "# by hand\n";
  REQUIRE(files::WriteTextFile(program.corrected, edited));
  const Answer refused = program.Run();
  CHECK(refused.exit_code == 2);
  CHECK_THAT(refused.err, Contains("--force"));
  CHECK(FileText(program.corrected) == edited);
  CHECK(program.Run("--load 5 --force").exit_code == 0);
  CHECK(FileText(program.corrected) != edited);
}

TEST_CASE("nothing is written if one file cannot be") {
  const Program program;
  std::filesystem::create_directories(program.corrected + ".plumbline.json");
  const Answer answer = program.Run("--load 5 --report " + program.folder.path() + "/r.html");
  CHECK(answer.exit_code == 2);
  CHECK(FileText(program.corrected).empty());
  CHECK(FileText(program.folder.path() + "/r.html").empty());
}

TEST_CASE("a file without a mark is recognised without its record") {
  const Program program;
  const auto run = [&](const std::string& file) {
    return test::RunCommand(AddToyCommandWithoutComments,
                            "program " + program.cell + " " + file + " --load 5");
  };
  const Answer first = run(program.file);
  CHECK(first.exit_code == 0);
  CHECK_THAT(first.err, Contains("has no place for a mark"));
  const std::string moved = program.folder.path() + "/moved.toy";
  std::filesystem::rename(program.corrected, moved);
  const Answer second = run(moved);
  CHECK(second.exit_code == 0);
  CHECK_THAT(second.err, Contains("already corrected"));
  CHECK(FileText(program.corrected).empty());
}

TEST_CASE("a file that is given twice is read once") {
  const Program program;
  const Answer answer =
      program.Run("--load 5", program.file + " " + program.folder.path() + "/./a.toy");
  CHECK(answer.exit_code == 0);
  CHECK_THAT(answer.out, Contains("toy of 1 file: 2 points corrected"));
}

TEST_CASE("a stated key that the program does not use is an error, with the nearest one") {
  const Program program;
  const Answer tool = program.Run("--load 5 --tool tt=1");
  CHECK(tool.exit_code == 2);
  CHECK_THAT(tool.err, Contains("uses the tool 'tt'; the nearest that it uses is 't'"));
  CHECK(program.Run("--load 5 --base u=1,2,3").exit_code == 2);
  CHECK(program.Run("--load tt=5").exit_code == 2);
  const std::string frames = program.folder.path() + "/frames.toml";
  REQUIRE(files::WriteTextFile(frames, "[base.\"u\"]\npose = [1, 2, 3]\n"));
  const Answer noted = program.Run("--load 5 --frames " + frames);
  CHECK(noted.exit_code == 0);
  CHECK_THAT(noted.err, Contains("no line of the program uses the base 'u'"));
}

TEST_CASE("a tool without a pose has its tool point at the tip of the cell's tool") {
  Program program;
  REQUIRE(program.Run("--load 5").exit_code == 0);
  const std::string corrected = FileText(program.corrected);
  program.text.erase(0, program.text.find('\n') + 1);  // the line of the tool
  REQUIRE(files::WriteTextFile(program.file, program.text));
  const std::string frames = program.folder.path() + "/frames.toml",
                    load = "load_kg = 5\ncog_mm = [0, 0, 100]\n";
  const std::string options = "--load t=5 --force --frames " + frames;
  REQUIRE(files::WriteTextFile(frames, "[tool.\"t\"]\n" + load));
  const Answer asked = program.Run(options);
  CHECK(asked.exit_code == 2);
  CHECK_THAT(asked.err, Contains("give number"));
  REQUIRE(files::WriteTextFile(frames, "[tool.\"t\"]\nnumber = 1\n" + load));
  const Answer answer = program.Run(options);
  INFO(answer.err << answer.out);
  CHECK(answer.exit_code == 0);
  const auto points = [](const std::string& text) {
    return text.substr(text.find("point p"), text.find("sub main") - text.find("point p"));
  };
  CHECK(points(FileText(program.corrected)) == points(corrected));
}

TEST_CASE("two folders are compared by the names of their files, and other files do not count") {
  const Program program;
  REQUIRE(program.Run().exit_code == 0);
  const std::string old_folder = program.folder.path() + "/old";
  std::filesystem::create_directories(old_folder);
  std::filesystem::copy_file(program.file, old_folder + "/a.toy");
  REQUIRE(files::WriteTextFile(old_folder + "/Notes.txt", "by hand"));
  const std::string check =
      "program --check " + old_folder + " " + program.folder.path() + "/corrected";
  const Answer same = test::RunCommand(AddToyCommand, check);
  INFO(same.out << same.err);
  CHECK(same.exit_code == 0);
  CHECK_THAT(same.out, Contains("2 of 2 points differ") && Contains("nothing else differs"));
  std::filesystem::copy_file(program.file, old_folder + "/0.toy");
  const Answer lone = test::RunCommand(AddToyCommand, check);
  CHECK(lone.exit_code == 1);
  CHECK_THAT(lone.out, Contains("0.toy:0: only one version has this file") &&
                           !Contains("bytes beside the numbers"));
}

TEST_CASE("a folder that cannot be made is named with the reason") {
  const Program program;
  const std::string folder = program.folder.path() + "/link";
  std::filesystem::create_symlink(program.folder.path() + "/none", folder);
  const Answer answer = program.Run("--load 5 --output " + folder);
  CHECK(answer.exit_code == 2);
  CHECK_THAT(answer.err, Contains("link: this folder cannot be made: "));
}

TEST_CASE("a tool that only its number names is told") {
  Program program;
  std::string& text = program.text;
  text.erase(0, text.find('\n') + 1);  // the line of the tool
  program.Replace("use t\n", "use TOOL1\n");
  std::string cell = FileText(program.cell);
  cell.insert(cell.find("[tool]") + 6, "\nnumber = 1");
  REQUIRE(files::WriteTextFile(program.cell, cell));
  const Answer assumed = program.Run();
  INFO(assumed.out << assumed.err);
  CHECK(assumed.exit_code == 0);
  CHECK_THAT(assumed.out, Contains("taken to be the cell's [[tool]] 1 by its number"));
  CHECK_THAT(program.Run("--load 5 --tool TOOL1=1").out, !Contains("by its number"));
}

TEST_CASE("a run that changes no digit writes no program") {
  const Program program;
  const Answer answer = program.Run("");
  CHECK_THAT(answer.err, Contains("no program is written"));
  CHECK(FileText(program.corrected).empty());
}

TEST_CASE("--insert lists the circles, which are not refined, with what remains") {
  const Program circle("C p+base:0,5,5 p+base:0,0,40\n");
  const Answer answer = circle.Run("--load 5 --insert 0.001 --offset-bound 10");
  CHECK_THAT(answer.out, Contains("this circular motion leaves its path by") &&
                             Contains("only linear motions are refined"));
}

TEST_CASE("--again writes nothing below the corrected files") {
  const Program program;
  REQUIRE(program.Run().exit_code == 0);
  const std::string folder = program.folder.path() + "/corrected", other = folder + "/other.toy";
  REQUIRE(files::WriteTextFile(other, "sub other\nend\n"));
  const Answer answer = program.Run("--load 5 --again", program.corrected + " " + other);
  INFO(answer.err);
  CHECK(answer.exit_code == 0);
  CHECK_FALSE(std::filesystem::exists(folder + "/corrected"));
  CHECK(FileText(other) == "sub other\nend\n");
}

TEST_CASE("a file of no language is named") {
  const Program program;
  const Answer answer = program.Run("", program.cell);
  CHECK(answer.exit_code == 2);
  CHECK_THAT(answer.err, Contains("no robot program that is read here (toy)"));
}

}  // namespace plumbline::program_command_test
