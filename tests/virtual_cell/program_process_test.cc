// Both programs as processes: standard output, console, invalid arguments, clean exit.
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <string>
#include <vector>

#include "tests/app/temporary_folder.h"
#include "tests/port_file.h"
#include "tests/virtual_cell/register_client.h"

namespace virtual_cell::program_process_test {
namespace {

constexpr const char* kCell = "tests/virtual_cell/demo/cockpit-cell.toml";

/// A child process with pipes to its standard input, output and error.
class Child {
 public:
  explicit Child(std::vector<std::string> arguments) {
    int in[2], out[2];
    REQUIRE(::pipe2(in, O_CLOEXEC) == 0);
    REQUIRE(::pipe2(out, O_CLOEXEC) == 0);
    pid_ = ::fork();
    if (pid_ == 0) {
      ::dup2(in[0], 0);
      ::dup2(out[1], 1);
      ::dup2(out[1], 2);
      std::vector<char*> pointers;
      pointers.reserve(arguments.size() + 1);
      for (std::string& argument : arguments) pointers.push_back(argument.data());
      pointers.push_back(nullptr);
      ::execv(pointers[0], pointers.data());
      ::_exit(127);
    }
    ::close(in[0]);
    ::close(out[1]);
    in_ = in[1];
    out_ = out[0];
  }
  ~Child() {
    if (pid_ > 0) {
      ::kill(pid_, SIGKILL);
      ::waitpid(pid_, nullptr, 0);
    }
    ::close(in_);
    ::close(out_);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  void Say(const std::string& line) {
    const std::string text = line + "\n";
    REQUIRE(::write(in_, text.data(), text.size()) == static_cast<ssize_t>(text.size()));
  }
  std::string Line() {
    std::string line;
    for (char c = 0; ::read(out_, &c, 1) == 1 && c != '\n';) line += c;
    return line;
  }
  std::string Rest() {
    std::string text;
    char buffer[256];
    for (ssize_t got; (got = ::read(out_, buffer, sizeof buffer)) > 0;) {
      text.append(buffer, static_cast<std::size_t>(got));
    }
    return text;
  }
  void Signal(int number) const { ::kill(pid_, number); }
  int ExitCode() {
    int status = 0;
    ::waitpid(pid_, &status, 0);
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  pid_t pid_ = -1;
  int in_ = -1, out_ = -1;
};

TEST_CASE("the virtual cell reports its ports, executes console lines and quits") {
  const plumbline::test::TemporaryFolder folder;
  const std::string ports = folder.path() + "/ports";
  Child cell({VIRTUAL_CELL, "--cell", kCell, "--idle", "--effect", "joint_compliance:q2=1e-7",
              "--temperature", "0:20,100:30", "--fault", "@0 joint 1 2.5", "--tracker-noise-mm",
              "0.01", "--reflector", "0,424,0", "--port-file", ports});
  const std::string listening = cell.Line();
  REQUIRE_THAT(listening, Catch::StartsWith("listening on 127.0.0.1:"));
  REQUIRE_THAT(cell.Line(), Catch::StartsWith("tracker on 127.0.0.1:"));
  const int port = plumbline::test::PortIn(ports, "robot");
  CHECK(listening == "listening on 127.0.0.1:" + std::to_string(port));
  RegisterClient robot("robot", "127.0.0.1:" + std::to_string(port), 1, 5);
  CHECK(robot.Read(258, 1).Word(0) == 7);
  cell.Say("payload 12");
  CHECK(cell.Line() == "ok");
  cell.Say("nonsense");
  CHECK_THAT(cell.Line(), Catch::StartsWith("error: "));
  cell.Say("quit");
  CHECK(cell.Line() == "ok");
  CHECK(cell.ExitCode() == 0);
}

TEST_CASE("the virtual cell refuses an invalid port") {
  for (const char* option : {"--port", "--tracker-port"}) {
    Child cell({VIRTUAL_CELL, "--cell", kCell, option, "99999999"});
    CHECK(cell.ExitCode() != 0);
  }
}

TEST_CASE("the virtual cell exits cleanly on SIGTERM") {
  Child cell({VIRTUAL_CELL, "--cell", kCell});
  cell.Line();
  cell.Line();
  cell.Signal(SIGTERM);
  CHECK(cell.ExitCode() == 0);
}

TEST_CASE("invalid arguments are rejected with the reason") {
  struct Row {
    std::vector<std::string> arguments;
    const char* reason;
  };
  const Row rows[] = {
      {{"--cell", "no-such.toml"}, "no-such.toml"},
      {{"--cell", kCell, "--effect", "luck:q1=1"}, "effect 'luck' is unknown"},
      {{"--cell", kCell, "--program", kCell}, "home_deg"},
      {{"--cell", kCell, "--address", "299.0.0.1"}, "cannot listen on 299.0.0.1"},
      {{"--cell", kCell, "--real-joints", "no-such.csv"}, "no-such.csv"},
      {{"--cell", kCell, "--profile", "kuka"}, "--profile"},
  };
  for (const Row& row : rows) {
    CAPTURE(row.reason);
    std::vector<std::string> arguments = {VIRTUAL_CELL};
    arguments.insert(arguments.end(), row.arguments.begin(), row.arguments.end());
    Child cell(arguments);
    CHECK_THAT(cell.Rest(), Catch::Contains(row.reason));
    CHECK(cell.ExitCode() != 0);
  }
}

TEST_CASE("the PLC client reports which peer does not respond") {
  Child client({PLC_CLIENT, "visit", "--robot", "127.0.0.1:1", "--tracker", "127.0.0.1:1",
                "--daemon", "127.0.0.1:1", "--timeout-s", "0.1", "--program",
                "tests/virtual_cell/demo/cockpit-program.toml"});
  CHECK_THAT(client.Rest(), Catch::Contains("robot: no answer at 127.0.0.1:1"));
  CHECK(client.ExitCode() == 2);
}

}  // namespace
}  // namespace virtual_cell::program_process_test
