// The program plumbline-virtual-ur, by its console.
#include <catch2/catch.hpp>
#include <cstdio>
#include <string>

namespace {

std::string Output(const std::string& command) {
  FILE* const pipe = popen(command.c_str(), "r");
  REQUIRE(pipe != nullptr);
  std::string text;
  char buffer[256];
  while (fgets(buffer, sizeof buffer, pipe) != nullptr) text += buffer;
  CHECK(pclose(pipe) == 0);
  return text;
}

}  // namespace

TEST_CASE("the program serves RTDE, runs a robot program and executes console lines") {
  const std::string text =
      Output("printf 'payload 3\\nfault drop 3\\nfault melt\\nregisters\\nquit\\n' | " VIRTUAL_UR
             " --cell config/cells/ur10.toml --idle --fault 'version 1' --script "
             "packaging/examples/ur/plumbline_rtde.script");
  CAPTURE(text);
  CHECK(text.find("RTDE on 127.0.0.1:") == 0);
  CHECK(text.find("\nok\nok\nerror: 'melt' is not a fault") != std::string::npos);
  CHECK(text.find("\n0 0 0 0 ") != std::string::npos);
}

TEST_CASE("a wrong option or file ends the program with its reason") {
  CHECK(Output(VIRTUAL_UR " --cell config/cells/ur10.toml --idle --fault melt 2>&1 || true")
            .find("'melt' is not a fault") != std::string::npos);
  CHECK(Output(VIRTUAL_UR " --cell none.toml 2>&1 || true").find("none.toml") != std::string::npos);
}
