// The real plumbline program in a shell: exit codes and failing outputs.
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "tests/app/cli/shell.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::process_test {

using plumbline::test::Answer;
using plumbline::test::Shell;
using plumbline::test::TemporaryFolder;

namespace {

/// Server that accepts one connection on a loopback port and calls a handler.
class OneShotServer {
 public:
  explicit OneShotServer(void (*behave)(int connection))
      : listener_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* const generic = reinterpret_cast<sockaddr*>(&address);
    REQUIRE(bind(listener_, generic, size) == 0);
    REQUIRE(listen(listener_, 1) == 0);
    getsockname(listener_, generic, &size);
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this, behave] {
      const int connection = accept(listener_, nullptr, nullptr);
      behave(connection);
      close(connection);
    });
  }
  ~OneShotServer() {
    shutdown(listener_, SHUT_RDWR);  // where nobody came, accept() ends
    thread_.join();
    close(listener_);
  }
  OneShotServer(const OneShotServer&) = delete;
  OneShotServer& operator=(const OneShotServer&) = delete;
  std::string Port() const { return std::to_string(port_); }

 private:
  int listener_;
  int port_ = 0;
  std::thread thread_;
};

/// Until the other side closes.
void ReadAll(int connection) {
  char byte = 0;
  while (read(connection, &byte, 1) > 0) {
  }
}

}  // namespace

TEST_CASE("a failed write to standard output is reported, with exit code 2") {
  for (const char* command :
       {"registers", "registers --json", "check config/cells/ur10.toml",
        "check --json config/cells/ur10.toml", "beam --paper-table2", "--version", "beam --help"}) {
    for (const char* target : {"> /dev/full", ">&-"}) {
      CAPTURE(command, target);
      const Answer answer = Shell(std::string(command) + " " + target);
      CHECK(answer.exit_code == 2);
      CHECK_THAT(answer.output, Catch::Contains("standard output cannot be written"));
    }
  }
}

TEST_CASE("a missing program of the package is named, with how to restore it") {
  const TemporaryFolder folder;
  const std::string alone = folder.path() + "/plumbline";
  std::filesystem::copy_file(PLUMBLINE, alone);
  std::ofstream(folder.path() + "/gripper.stl") << "solid a\nendsolid a\n";
  const std::string commands[] = {
      "snapshot config/plumbline.toml --out " + folder.path() + "/a.png",
      "distance config/plumbline.toml", "mesh check " + folder.path() + "/gripper.stl"};
  for (const std::string& command : commands) {
    CAPTURE(command);
    const Answer answer = Shell("--version > /dev/null; " + alone + " " + command);
    CHECK(answer.exit_code != 0);
    const char* missing = command[0] == 'm' ? "/plumbline-mesh" : "/plumbline-view";
    CHECK_THAT(answer.output, Catch::Contains(folder.path() + missing + " cannot be started") &&
                                  Catch::Contains("apt install --reinstall plumbline") &&
                                  Catch::Contains("./dev build"));
  }
}

TEST_CASE("without the image codec module: one message, and JPEG is still read") {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() + "/bin");
  const std::string alone = folder.path() + "/bin/plumbline";
  std::filesystem::copy_file(PLUMBLINE, alone);
  std::filesystem::create_directory(folder.path() + "/frames");
  for (const char* name : {"/frames/a.pgm", "/frames/b.pgm"}) {
    std::ofstream(folder.path() + name) << "P5\n8 8\n255\n" << std::string(64, 'x');
  }
  const std::string calibrate = " calibrate-lens --board 9x6 --images " + folder.path() + "/frames";
  const Answer missing = Shell("--version > /dev/null; " + alone + calibrate);
  INFO(missing.output);
  CHECK(missing.exit_code == 1);
  const std::string module = folder.path() + "/lib/plumbline/plumbline-image-codecs.so";
  CHECK_THAT(missing.output,
             Catch::StartsWith("the image codecs " + module + " cannot be loaded: ") &&
                 Catch::Contains("No such file") &&
                 Catch::Contains("apt install --reinstall plumbline") &&
                 Catch::Contains("./dev build"));
  CHECK(std::count(missing.output.begin(), missing.output.end(), '\n') == 1);
  std::ofstream(folder.path() + "/lens.json")
      << R"({"schema": 1, "accepted": true, "image_size": [8, 8], "fx": 8.0, "fy": 8.0, "cx": 4.0,
             "cy": 4.0, "distortion": [0, 0, 0, 0, 0]})";
  const std::string track =
      " track --tag-size-mm 80 --intrinsics " + folder.path() + "/lens.json --fast --camera ";
  const Answer recording =
      Shell("--version > /dev/null; " + alone + track + folder.path() + "/frames");
  INFO(recording.output);
  CHECK(recording.exit_code == 1);
  CHECK_THAT(recording.output, Catch::Contains("the image codecs " + module));
  CHECK(std::count(recording.output.begin(), recording.output.end(), '\n') == 1);
  // The start of a JPEG: refused for what it lacks, not for the module.
  for (const char* name : {"/frames/a.pgm", "/frames/b.pgm"}) {
    std::ofstream(folder.path() + name) << "\xFF\xD8\xFF\xD9";
  }
  const Answer jpeg = Shell("--version > /dev/null; " + alone + calibrate);
  CHECK_THAT(jpeg.output, Catch::Contains("JPEG") && !Catch::Contains("cannot be loaded"));
}

TEST_CASE("without the module that draws sheets: one message with the remedy") {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() + "/bin");
  const std::string alone = folder.path() + "/bin/plumbline";
  std::filesystem::copy_file(PLUMBLINE, alone);
  const Answer missing = Shell("--version > /dev/null; " + alone +
                               " print tag --id 7 --size-mm 80 --out " + folder.path() + "/a.pdf");
  CHECK(missing.exit_code == 2);
  CHECK_THAT(missing.output, Catch::StartsWith("the module that draws sheets, " + folder.path() +
                                               "/lib/plumbline/plumbline-sheets.so, cannot be "
                                               "loaded: ") &&
                                 Catch::Contains("apt install --reinstall plumbline"));
  CHECK_FALSE(std::filesystem::exists(folder.path() + "/a.pdf"));
}

TEST_CASE("a reader that exits early is not an error") {
  CHECK(Shell("registers | head -1").output == "# The register map\n");
  const Answer ignored = Shell("--version > /dev/null; trap '' PIPE; (" PLUMBLINE
                               " registers; echo \"code $?\" >&2) | head -1");
  CHECK_THAT(ignored.output, Catch::Contains("code 0"));
  CHECK_THAT(ignored.output, !Catch::Contains("cannot be written"));
}

TEST_CASE("`help COMMAND` is `COMMAND --help`") {
  for (const std::string command : {"", " check", " model apply"}) {
    CAPTURE(command);
    const Answer asked = Shell("help" + command);
    CHECK(asked.exit_code == 0);
    CHECK(asked.output == Shell(command + " --help").output);
    CHECK_THAT(asked.output, Catch::Contains("Usage: plumbline" + command));
  }
}

TEST_CASE("a wrong command line prints one line that refers to the help") {
  struct Wrong {
    const char* arguments;
    const char* output;
  };
  const Wrong wrong[] = {
      {"", "plumbline: the command is missing; see plumbline --help\n"},
      {"foo", "plumbline: \"foo\" is not a command; see plumbline --help\n"},
      {"stats",
       "plumbline: \"stats\" is not a command; did you mean \"status\"?; see plumbline --help\n"},
      {"journal exprot",
       "plumbline journal: \"exprot\" is not a command; did you mean \"export\"?; see plumbline "
       "journal --help\n"},
      {"status --prot 1502",
       "plumbline status: --prot is not a known argument; did you mean \"--port\"?; see plumbline "
       "status --help\n"},
      {"--bogus status",
       "plumbline status: --bogus is not a known argument; see plumbline status --help\n"},
      {"check --jsno", "plumbline check: file is missing; see plumbline check --help\n"},
      {"check", "plumbline check: file is missing; see plumbline check --help\n"},
      {"beam --bogus",
       "plumbline beam: --bogus is not a known argument; see plumbline beam --help\n"},
      {"journal", "plumbline journal: the command is missing; see plumbline journal --help\n"},
      {"model bogus", "plumbline model: \"bogus\" is not a command; see plumbline model --help\n"},
      {"journal show --bogus",
       "plumbline journal show: --bogus is not a known argument; see plumbline journal show "
       "--help\n"},
      {"diagnose a b --threads nan",
       "plumbline diagnose: --threads: nan is not a whole number from 1 to 256; see plumbline "
       "diagnose --help\n"},
      {"snapshot plumbline.toml --out plumbline.toml",
       "plumbline snapshot: --output: the picture is a PNG file; its name must end in .png; see "
       "plumbline snapshot --help\n"},
      {"predict a b --out c --deflection-sd nan",
       "plumbline predict: --deflection-sd: nan is not a number from 0 to 1; see plumbline predict "
       "--help\n"},
  };
  const Wrong further[] = {
      {"diagnose a b c",
       "plumbline diagnose: c is not a known argument; see plumbline diagnose --help\n"},
      {"status --port",
       "plumbline status: --port: its value is missing; see plumbline status "
       "--help\n"},
      {"status --port 65536",
       "plumbline status: --port: 65536 is not a whole number from 1 to 65535; see plumbline "
       "status --help\n"},
      {"journal show --last 0",
       "plumbline journal show: --last: 0 is not a whole number from 1 to 1000000000; see "
       "plumbline journal show --help\n"},
      {"journal show --after x",
       "plumbline journal show: --after: x is not a number; see plumbline journal show --help\n"},
      {"beam --csv --json",
       "plumbline beam: --csv and --json cannot be combined; see plumbline beam --help\n"},
      {"beam --direction z",
       "plumbline beam: --direction: z is not one of x, y; see plumbline beam --help\n"},
      {"track --intrinsics a --gain 3",
       "plumbline track: --gain requires --camera; see plumbline track --help\n"},
  };
  for (const Wrong& w : further) {
    CAPTURE(w.arguments);
    const Answer answer = Shell(w.arguments);
    CHECK(answer.exit_code == 2);
    CHECK(answer.output == w.output);
  }
  for (const Wrong& w : wrong) {
    CAPTURE(w.arguments);
    const Answer answer = Shell(w.arguments);
    CHECK(answer.exit_code == 2);
    CHECK(answer.output == w.output);
  }
}

TEST_CASE("status reports what is wrong with the address, and what to do") {
  const Answer name = Shell("status --host no-such-host.invalid");
  CHECK(name.exit_code == 2);
  CHECK_THAT(name.output, Catch::Contains("unknown host name") && Catch::Contains("--host"));

  struct Case {
    void (*behave)(int);
    const char* output;
  };
  const Case cases[] = {
      {[](int) {}, "closes the connection"},
      {[](int connection) { ReadAll(connection); }, "does not respond"},
      {[](int connection) {
         const std::string_view answer = "HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\n\r\n";
         static_cast<void>(write(connection, answer.data(), answer.size()));
         ReadAll(connection);
       },
       "does not speak Modbus"},
  };
  for (const Case& c : cases) {
    CAPTURE(c.output);
    const OneShotServer server(c.behave);
    const Answer answer = Shell("status --port " + server.Port());
    CHECK(answer.exit_code == 2);
    CHECK_THAT(answer.output, Catch::Contains(c.output) && Catch::Contains("plc.port"));
  }
}

TEST_CASE("Ctrl-C stops tracking of a camera after a complete line, with exit code 0") {
  const TemporaryFolder folder;
  std::ofstream(folder.path() + "/frame.pgm") << "P5\n64 48\n255\n" << std::string(64 * 48, 'x');
  std::ofstream(folder.path() + "/lens.json")
      << R"({"schema": 1, "accepted": true, "image_size": [64, 48], "fx": 80, "fy": 80, "cx": 32,)"
      << R"( "cy": 24, "distortion": [0, 0, 0, 0, 0]})";
  const std::string track = "track --camera " + folder.path() + " --intrinsics " + folder.path() +
                            "/lens.json --tag-size-mm 80 --json";
  // The reader of the first line sends the signal; all that comes is in the file.
  for (const char* signal : {"INT", "TERM"}) {
    const std::string sender = "( " PLUMBLINE " " + track +
                               " --repeat & echo $! > pid; wait $!; echo \"code $?\" >&2 ) > pipe";
    const std::string reader = "{ read line; until [ -s pid ]; do sleep 0.01; done; kill -" +
                               std::string(signal) +
                               " $(cat pid); echo \"$line\"; cat; } < pipe > all";
    const Answer answer =
        Shell("--version > /dev/null; cd " + folder.path() + "; rm -f pid pipe; mkfifo pipe; " +
              sender + " & " + reader + "; wait; tail -c 1 all | od -c");
    CAPTURE(signal, answer.output);
    CHECK_THAT(answer.output, Catch::Contains("code 0") && Catch::Contains("\\n"));
  }
  CHECK(Shell(track + " --fast --repeat --frames 2 | wc -l").output == "2\n");
  CHECK(Shell(track + " --fast --repeat | head -1 | wc -l").output == "1\n");
}

}  // namespace plumbline::process_test
