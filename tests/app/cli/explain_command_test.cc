// plumbline explain: what it prints, and how it ends.
#include <catch2/catch.hpp>
#include <fstream>

#include "app/base/text/json_text.h"
#include "app/cli/commands.h"
#include "tests/app/cli/run_command.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::explain_command_test {

using namespace plumbline::cli;
using test::RunCommand;

namespace {

struct Files {
  test::TemporaryFolder folder;
  std::string Write(const std::string& name, const std::string& content) const {
    const std::string path = folder.path() + "/" + name;
    std::ofstream(path, std::ios::binary) << content;
    return path;
  }
};

}  // namespace

TEST_CASE("files are explained one after the other, each with the command that reads it") {
  const Files files;
  const std::string arm = files.Write("arm.urdf", "<robot name=\"a\"><link name=\"b\"/></robot>\n");
  const auto answer = RunCommand(AddExplainCommand, "explain config/cells/ur10.toml " + arm);
  CHECK(answer.exit_code == 0);
  CHECK(answer.err.empty());
  CHECK(answer.out.find("config/cells/ur10.toml: a model of a cell (cell.toml)") == 0);
  CHECK(answer.out.find("\n\n" + arm + ": a description of a robot (URDF)") != std::string::npos);
  CHECK(answer.out.find("use: plumbline import-urdf " + arm) != std::string::npos);
}

TEST_CASE("what is unknown, contradicts itself or is missing ends with 1") {
  const Files files;
  const std::string cut = files.Write("arm.urdf", "<robot name=\"a\"><link name=\"b\"/>\n");
  const auto contradicts = RunCommand(AddExplainCommand, "explain " + cut);
  CHECK(contradicts.exit_code == 1);
  CHECK(contradicts.out.find("contradiction: line 1, end: the file ends within <robot>") !=
        std::string::npos);
  CHECK(contradicts.out.find("use, once that is settled: ") != std::string::npos);
  CHECK(RunCommand(AddExplainCommand, "explain " + files.Write("a", "text\n")).exit_code == 1);
  const auto missing = RunCommand(AddExplainCommand, "explain /nonexistent/file");
  CHECK(missing.exit_code == 1);
  CHECK(missing.err.find("/nonexistent/file: cannot be read") == 0);
}

TEST_CASE("JSON has one entry a file") {
  const Files files;
  const std::string mesh = files.Write("a.wrl", "#VRML V2.0 utf8\nShape { }\n");
  const auto answer =
      RunCommand(AddExplainCommand, "explain --json " + mesh + " config/bodies.toml");
  const auto json = text::JsonOrNull(answer.out);
  REQUIRE(json["files"].size() == 2);
  CHECK(json["schema"] == 1);
  CHECK(json["files"][0]["kind"] == "vrml97");
  CHECK(json["files"][1]["kind"] == "tags");
  CHECK(json["files"][1]["certainty"] == "shown");
}

}  // namespace plumbline::explain_command_test
