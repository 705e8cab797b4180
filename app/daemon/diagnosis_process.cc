#include "app/daemon/diagnosis_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include "drivers/files/open_failure.h"
#include "drivers/files/program_beside.h"

namespace plumbline {
namespace {

/// The last line of a file that is not empty.
std::string LastLine(const std::string& file) {
  std::ifstream input(file);
  std::string line, last;
  while (std::getline(input, line)) {
    if (!line.empty()) last = line;
  }
  return last.substr(0, 300);
}

/// In the child between fork and exec: system calls only.
[[noreturn]] void BecomeProgram(char* const* arguments, int output, pid_t parent) {
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(127);  // it ended before the line above
  setpriority(PRIO_PROCESS, 0, 19);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  const int nothing = open("/dev/null", O_RDONLY);
  dup2(nothing, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  dup2(output, STDERR_FILENO);
  close_range(3, ~0U, 0);  // sockets of the PLC side must not outlive the daemon
  execv(arguments[0], arguments);
  static constexpr char kFailed[] = "cannot be run\n";
  [[maybe_unused]] const ssize_t told = write(STDERR_FILENO, kFailed, sizeof kFailed - 1);
  _exit(127);
}

}  // namespace

Result<DiagnosisProcess> DiagnosisProcess::Start(const std::vector<std::string>& arguments,
                                                 const std::string& output_file) {
  std::vector<char*> pointers;
  pointers.reserve(arguments.size() + 1);
  for (const std::string& argument : arguments) {
    pointers.push_back(const_cast<char*>(argument.c_str()));  // execv writes nothing
  }
  pointers.push_back(nullptr);
  const int output = open(output_file.c_str(),
                          O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_NOFOLLOW | O_CLOEXEC, 0644);
  if (output < 0)
    return Error{
        fmt::format("{}: {}", output_file, CannotBeWritten(output_file, std::strerror(errno)))};
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid == 0) BecomeProgram(pointers.data(), output, parent);
  close(output);
  if (pid < 0) return Error{fmt::format("no process: {}", std::strerror(errno))};
  setpgid(pid, pid);  // whoever is first; a kill of the group must find it
  return DiagnosisProcess(pid, output_file);
}

DiagnosisProcess::DiagnosisProcess(DiagnosisProcess&& other) noexcept
    : pid_(other.pid_), output_file_(std::move(other.output_file_)) {
  other.pid_ = -1;
}

std::optional<std::string> DiagnosisProcess::Poll() {
  if (pid_ < 0) return "was ended";
  int status = 0;
  const pid_t ended = waitpid(pid_, &status, WNOHANG);
  if (ended == 0 || (ended < 0 && errno == EINTR)) return std::nullopt;
  killpg(pid_, SIGKILL);  // what it may have left behind
  pid_ = -1;
  if (ended > 0 && WIFEXITED(status) && WEXITSTATUS(status) == 0) return std::string();
  std::string how = "lost";
  if (ended > 0) {
    how = WIFEXITED(status) ? fmt::format("exit code {}", WEXITSTATUS(status))
                            : fmt::format("signal {}", WTERMSIG(status));
  }
  const std::string said = LastLine(output_file_);
  return said.empty() ? how : fmt::format("{}: {}", how, said);
}

void DiagnosisProcess::Kill() {
  if (pid_ < 0) return;
  killpg(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
  pid_ = -1;
}

std::string PlumblineProgram() {
  if (const char* named = std::getenv("PLUMBLINE_PROGRAM")) return named;
  return ProgramBeside("plumbline");
}

}  // namespace plumbline
