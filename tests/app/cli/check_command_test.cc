#include "app/cli/check_command.h"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>

namespace plumbline {
namespace {

struct Answer {
  int exit_code = -1;
  std::string out;
};

/// Runs `plumbline check ARGUMENTS`.
Answer RunCheck(const std::string& arguments) {
  Answer answer;
  CLI::App app("test", "plumbline");
  AddCheckCommand(app, answer.exit_code);
  std::ostringstream out;
  std::ostringstream err;
  std::streambuf* const old_out = std::cout.rdbuf(out.rdbuf());
  std::streambuf* const old_err = std::cerr.rdbuf(err.rdbuf());
  app.parse("check " + arguments);
  std::cout.rdbuf(old_out);
  std::cerr.rdbuf(old_err);
  answer.out = out.str() + err.str();
  return answer;
}

/// A file of its own for this process, removed at the end.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& text)
      : path_("/tmp/plumbline_check_" + std::to_string(getpid()) + ".toml") {
    std::ofstream(path_) << text;
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() { std::remove(path_.c_str()); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

TEST_CASE("A good cell: exit 0, and what it amounts to") {
  const Answer answer = RunCheck("config/cells/ur10.toml");
  CHECK(answer.exit_code == 0);
  CHECK(answer.out.find("robot        UR10, 6 joints") != std::string::npos);
  CHECK(answer.out.find("masses       link mass known of all (28.43 kg)") != std::string::npos);
  CHECK(answer.out.find("compliance   none declared") != std::string::npos);
}

TEST_CASE("A configuration is known by its cell key and checked with its files") {
  const Answer answer = RunCheck("config/plumbline.toml");
  CAPTURE(answer.out);
  CHECK(answer.exit_code == 0);
  CHECK(answer.out.find("points       1 assembly points, cycle 10 ms, PLC port 502") !=
        std::string::npos);
}

TEST_CASE("A faulty cell: exit 1, every fault, no summary") {
  const TemporaryFile file("schema = 1\n[robot]\nname = 3\n");
  const Answer answer = RunCheck(file.path());
  CHECK(answer.exit_code == 1);
  CHECK(answer.out.find(":3 robot.name: 3 is not a text in quotes\n") != std::string::npos);
  CHECK(answer.out.find(":1 tool: missing; expected the table [tool]\n") != std::string::npos);
  CHECK(answer.out.find("compliance ") == std::string::npos);
}

TEST_CASE("A file that cannot be read: exit 2") {
  const Answer answer = RunCheck("/nonexistent/cell.toml");
  CHECK(answer.exit_code == 2);
  CHECK(answer.out == "/nonexistent/cell.toml: cannot be read: No such file or directory\n");
  CHECK(RunCheck("/").exit_code == 2);
}

TEST_CASE("As JSON: faults with their place, apart from warnings") {
  const TemporaryFile file("schema = 1\n[robot]\nname = \"\xFF\"\n");
  const auto bad = nlohmann::json::parse(RunCheck("--json " + file.path()).out);
  CHECK(bad["good"] == false);
  REQUIRE(bad["faults"].size() == 1);
  CHECK(bad["faults"][0]["line"] == 3);

  const auto good = nlohmann::json::parse(RunCheck("--json config/cells/kr210.toml").out);
  CHECK(good["good"] == true);
  CHECK(good["kind"] == "cell");
  CHECK(good["faults"].empty());
  CHECK(good["summary"]["masses"] == "no link mass declared: joint torques are unknown");
}

}  // namespace
}  // namespace plumbline
