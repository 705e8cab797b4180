// Child processes, tested with real shell processes.
#include "drivers/os/child_process.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <thread>

#include "drivers/clock.h"
#include "drivers/os/descriptor.h"
#include "drivers/os/run_program.h"

namespace plumbline::child_process_test {

using namespace plumbline::os;
using Catch::Contains;

namespace {

ChildOptions Shell(const std::string& script) {
  return {.arguments = {"/bin/sh", "-c", script}};
}

ChildProcess Started(const ChildOptions& options) {
  auto child = ChildProcess::Start(options);
  REQUIRE(child);
  return std::move(child).value();
}

/// Captures what a script writes to a passed descriptor.
class Answer {
 public:
  Answer() : file_(memfd_create("answer", MFD_CLOEXEC)) { REQUIRE(file_); }
  int fd() const { return file_.get(); }
  std::string Text() const {
    std::string text(4096, '\0');
    const ssize_t got = pread(file_.get(), text.data(), text.size(), 0);
    text.resize(static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    return text;
  }

 private:
  Descriptor file_;
};

bool Exists(pid_t process) {
  return kill(process, 0) == 0;
}

/// Whether the process ends soon; a zombie that init has not reaped yet counts as ended.
bool Vanishes(pid_t process) {
  for (int wait = 0; wait < 500 && Exists(process); ++wait) {
    const std::string stat = "/proc/" + std::to_string(process) + "/stat";
    const Descriptor file(open(stat.c_str(), O_RDONLY | O_CLOEXEC));
    char text[512] = "";
    if (file && read(file.get(), text, sizeof text - 1) > 0 && std::strstr(text, ") Z ")) {
      return true;
    }
    SleepSeconds(0.01);
  }
  return !Exists(process);
}

}  // namespace

TEST_CASE("the exit code or signal of a child is reported once", "[os]") {
  ChildProcess good = Started(Shell("exit 0")), bad = Started(Shell("exit 3"));
  ChildProcess killed = Started(Shell("kill -TERM $$"));
  CHECK(good.End(10).ok());
  CHECK_FALSE(good.started());
  CHECK_FALSE(good.Poll());
  CHECK(bad.End(10).exit_code == 3);
  const ExitStatus end = killed.End(10);
  CHECK_FALSE(end.exit_code);
  CHECK(end.signal == SIGTERM);
}

TEST_CASE("nothing is reported while a child runs; the destructor kills it", "[os]") {
  pid_t pid = -1;
  {
    ChildProcess child = Started(Shell("exec sleep 60"));
    pid = child.pid();
    CHECK_FALSE(child.Poll());
    ChildProcess owner = std::move(child);
    CHECK_FALSE(child.started());
    CHECK(owner.pid() == pid);
    CHECK(Exists(pid));
  }
  CHECK_FALSE(Exists(pid));
}

TEST_CASE("End() waits for a child that handles the signal, and kills one that does not", "[os]") {
  ChildProcess obeys = Started(Shell("trap 'exit 5' TERM; while :; do sleep 0.01; done"));
  ChildProcess ignores = Started(Shell("trap '' TERM; while :; do sleep 0.01; done"));
  SleepSeconds(0.3);
  CHECK(obeys.End(10, SIGTERM).exit_code == 5);
  const double from_s = MonotonicSeconds();
  CHECK(ignores.End(0.2, SIGTERM).signal == SIGKILL);
  CHECK(MonotonicSeconds() - from_s >= 0.2);
}

TEST_CASE("a program that cannot be executed has a distinct exit code", "[os]") {
  ChildProcess child = Started({.arguments = {"/nonexistent/program"}});
  CHECK(child.End(10).exit_code == ExitStatus::kNotRun);
}

TEST_CASE("a child has the passed descriptors, at their numbers, and no others", "[os]") {
  const Answer answer;
  Descriptor low(open("/dev/zero", O_RDONLY | O_CLOEXEC));
  // Swapped: each has the number that the other must get.
  const Descriptor seven(fcntl(low.get(), F_DUPFD, 7));
  ChildOptions options = Shell("ls -l /proc/self/fd/ | sed -n 's/.* \\([0-9]* -> .*\\)/\\1/p'");
  const Descriptor not_passed(open("/dev/full", O_RDONLY));  // inherited by a plain exec
  options.descriptors = {{STDOUT_FILENO, answer.fd()}, {5, seven.get()}, {seven.get(), low.get()}};
  CHECK(Started(options).End(10).ok());
  const std::string text = answer.Text();
  CAPTURE(text);
  CHECK_THAT(text, Contains("0 -> /dev/null"));
  CHECK_THAT(text, Contains("2 -> /dev/null"));
  CHECK_THAT(text, Contains("5 -> /dev/zero"));
  CHECK_THAT(text, Contains(std::to_string(seven.get()) + " -> /dev/zero"));
  CHECK_THAT(text, !Contains("/dev/full"));
  CHECK_THAT(text, !Contains("\n4 ->"));
}

TEST_CASE("a child starts with its priority, without blocked or ignored signals", "[os]") {
  const Answer answer;
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  const auto pipe_before = signal(SIGPIPE, SIG_IGN);
  ChildOptions options =
      Shell("nice; grep -E '^Sig(Blk|Ign)' /proc/self/status; echo \"$PLUMBLINE_OS_TEST\"");
  options.descriptors = {{STDOUT_FILENO, answer.fd()}};
  options.nice = 7;
  setenv("PLUMBLINE_OS_TEST", "inherited", 1);
  const ExitStatus end = Started(options).End(10);
  signal(SIGPIPE, pipe_before);
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  CHECK(end.ok());
  std::istringstream lines(answer.Text());
  std::string nice, word, blocked, ignored, environment;
  lines >> nice >> word >> blocked >> word >> ignored >> environment;
  CHECK(nice == "7");
  CHECK(std::stoull(blocked, nullptr, 16) == 0);
  CHECK((std::stoull(ignored, nullptr, 16) & (1U << (SIGPIPE - 1))) == 0);
  CHECK(environment == "inherited");
}

TEST_CASE("a process group is killed as a whole", "[os]") {
  const Answer answer;
  ChildOptions options = Shell("sleep 60 & echo $!; wait");
  options.descriptors = {{STDOUT_FILENO, answer.fd()}};
  options.own_group = true;
  ChildProcess child = Started(options);
  for (int wait = 0; wait < 500 && answer.Text().empty(); ++wait) SleepSeconds(0.01);
  const pid_t grandchild = std::atoi(answer.Text().c_str());
  REQUIRE(grandchild > 0);
  CHECK(Exists(grandchild));
  SECTION("by its owner") {
    CHECK(child.End().signal == SIGKILL);
  }
  SECTION("when its first process ends") {
    kill(child.pid(), SIGTERM);
    CHECK(child.End(10).signal == SIGTERM);
  }
  CHECK(Vanishes(grandchild));
}

TEST_CASE("a child ends with the process that started it, however that ends", "[os]") {
  const Answer answer;
  const pid_t starter = fork();
  if (starter == 0) {
    auto child = ChildProcess::Start({.arguments = {"/bin/sleep", "60"}});
    dprintf(answer.fd(), "%d", child ? child.value().pid() : -1);
    kill(getpid(), SIGKILL);  // no destructor runs
  }
  REQUIRE(waitpid(starter, nullptr, 0) == starter);
  const pid_t child = std::atoi(answer.Text().c_str());
  REQUIRE(child > 0);
  CHECK(Vanishes(child));
}

TEST_CASE("a child ends with the thread that started it", "[os]") {
  const Answer answer;
  ChildProcess child;
  std::thread([&child, &answer] {
    ChildOptions options = Shell("echo here; exec sleep 60");
    options.descriptors = {{STDOUT_FILENO, answer.fd()}};
    child = Started(options);
    for (int wait = 0; wait < 500 && answer.Text().empty(); ++wait) SleepSeconds(0.01);
  }).join();
  const double from_s = MonotonicSeconds();
  CHECK(child.End(30).signal == SIGKILL);
  CHECK(MonotonicSeconds() - from_s < 20);  // before End() would have killed it
}

TEST_CASE("a program is found in PATH, or by its path", "[os]") {
  CHECK_THAT(FindProgram("sh"), Catch::EndsWith("/sh"));
  CHECK(FindProgram("/bin/sh") == "/bin/sh");
  CHECK(FindProgram("/bin/none").empty());
  CHECK(FindProgram("plumbline-no-such-program").empty());
}

TEST_CASE("a program gets its complete input, and its outputs are collected separately", "[os]") {
  const std::string input(1 << 20, 'x');  // exceeds the capacity of a pipe
  const auto run = RunProgram({"/bin/sh", "-c", "echo told >&2; cat; exit 4"}, input);
  REQUIRE(run);
  CHECK(run->end.exit_code == 4);
  CHECK(run->output == input);
  CHECK(run->errors == "told\n");
}

TEST_CASE("a program that does not read is no error, and sends no SIGPIPE", "[os]") {
  const auto run =
      RunProgram({"/bin/sh", "-c", "exec < /dev/null; echo here"}, std::string(1 << 20, 'x'));
  REQUIRE(run);
  CHECK(run->end.ok());
  CHECK(run->output == "here\n");
  sigset_t pending;
  sigpending(&pending);
  CHECK(sigismember(&pending, SIGPIPE) == 0);
}

TEST_CASE("a program that exceeds a limit is killed", "[os]") {
  const double from_s = MonotonicSeconds();
  const auto slow = RunProgram({"/bin/sleep", "60"}, "", {.time_s = 0.3});
  REQUIRE_FALSE(slow);
  CHECK(slow.error() == "did not end within 0.3 s");
  const auto long_winded =
      RunProgram({"/bin/cat", "/dev/zero"}, "", {.time_s = 60, .output_bytes = 1 << 20});
  REQUIRE_FALSE(long_winded);
  CHECK(long_winded.error() == "wrote more than 1 MiB");
  CHECK(MonotonicSeconds() - from_s < 30);
}

}  // namespace plumbline::child_process_test
