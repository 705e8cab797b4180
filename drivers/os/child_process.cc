#include "drivers/os/child_process.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <sstream>

#include "drivers/clock.h"

namespace plumbline::os {
namespace {

constexpr double kPollPeriod_s = 1e-3;

/// Everything that the child needs, allocated before the fork: between fork and exec, the child of
/// a multithreaded process may only call async-signal-safe functions [signal-safety(7)].
struct ExecPlan {
  std::vector<char*> arguments;
  std::vector<int> descriptors;  ///< indexed by their number in the child; -1: none
  int nice = 0;
  std::size_t memory_bytes = 0;
  bool own_group = false;
  pid_t parent = 0;
};

ExecPlan PlanOf(const ChildOptions& options) {
  ExecPlan plan;
  plan.arguments.reserve(options.arguments.size() + 1);
  for (const std::string& argument : options.arguments) {
    plan.arguments.push_back(const_cast<char*>(argument.c_str()));  // execv does not modify it
  }
  plan.arguments.push_back(nullptr);
  plan.descriptors.assign(STDERR_FILENO + 1, -1);
  for (const ChildOptions::PassedDescriptor& handed : options.descriptors) {
    const auto number = static_cast<std::size_t>(handed.number);
    if (plan.descriptors.size() <= number) plan.descriptors.resize(number + 1, -1);
    plan.descriptors[number] = handed.descriptor;
  }
  plan.nice = options.nice;
  plan.memory_bytes = options.memory_bytes;
  plan.own_group = options.own_group;
  plan.parent = getpid();
  return plan;
}

/// Uses raw descriptors: no destructors run in the child before exec.
void PlaceDescriptors(std::vector<int>& descriptors) {
  const int above = static_cast<int>(descriptors.size());
  const int nothing = fcntl(open("/dev/null", O_RDWR), F_DUPFD, above);
  // Move them out of the target range first, so that none overwrites another.
  for (int& descriptor : descriptors) {
    if (descriptor >= 0) descriptor = fcntl(descriptor, F_DUPFD, above);
  }
  for (int number = 0; number < above; ++number) {
    const int descriptor = descriptors[static_cast<std::size_t>(number)];
    if (descriptor >= 0) {
      dup2(descriptor, number);
    } else if (number <= STDERR_FILENO) {
      dup2(nothing, number);
    } else {
      close(number);
    }
  }
  close_range(static_cast<unsigned>(above), ~0U, 0);
}

[[noreturn]] void BecomeProgram(ExecPlan& plan) {
  if (plan.own_group) setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  // Detects a parent process that ended before prctl(); not a parent thread.
  if (getppid() != plan.parent) _exit(ExitStatus::kNotRun);
  if (plan.nice != 0) setpriority(PRIO_PROCESS, 0, plan.nice);
  if (plan.memory_bytes > 0) {
    const rlimit limit{plan.memory_bytes, plan.memory_bytes};
    setrlimit(RLIMIT_DATA, &limit);
  }
  signal(SIGPIPE, SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  PlaceDescriptors(plan.descriptors);
  execv(plan.arguments[0], plan.arguments.data());
  _exit(ExitStatus::kNotRun);
}

/// @param flags  of waitpid()
/// @return  nullopt if a signal interrupted the wait or the child is still running
std::optional<ExitStatus> WaitFor(pid_t pid, int flags) {
  int status = 0;
  const pid_t waited = waitpid(pid, &status, flags);
  if (waited == 0 || (waited < 0 && errno == EINTR)) return std::nullopt;
  ExitStatus end;
  if (waited > 0 && WIFEXITED(status)) end.exit_code = WEXITSTATUS(status);
  if (waited > 0 && WIFSIGNALED(status)) end.signal = WTERMSIG(status);
  return end;
}

}  // namespace

Result<ChildProcess> ChildProcess::Start(const ChildOptions& options) {
  ExecPlan plan = PlanOf(options);
  const pid_t pid = fork();
  if (pid == 0) BecomeProgram(plan);
  if (pid < 0) return Error{std::strerror(errno)};
  if (options.own_group) setpgid(pid, pid);  // also set by the child; whichever runs first
  return ChildProcess(pid, options.own_group);
}

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
  if (this == &other) return *this;
  End();
  pid_ = std::exchange(other.pid_, -1);
  own_group_ = other.own_group_;
  return *this;
}

void ChildProcess::Kill() const {
  if (own_group_) {
    killpg(pid_, SIGKILL);
  } else {
    kill(pid_, SIGKILL);
  }
}

std::optional<ExitStatus> ChildProcess::Poll() {
  if (!started()) return std::nullopt;
  const std::optional<ExitStatus> end = WaitFor(pid_, WNOHANG);
  if (!end) return std::nullopt;
  if (own_group_) Kill();  // processes that it has left behind
  pid_ = -1;
  return end;
}

ExitStatus ChildProcess::End(double timeout_s, int signal) {
  constexpr ExitStatus kKilled{.exit_code = std::nullopt, .signal = SIGKILL};
  if (!started()) return kKilled;
  if (signal != 0) kill(pid_, signal);
  const double until_s = MonotonicSeconds() + timeout_s;
  for (;;) {
    if (const std::optional<ExitStatus> end = Poll()) return *end;
    if (MonotonicSeconds() >= until_s) break;
    SleepSeconds(kPollPeriod_s);
  }
  Kill();
  for (;;) {
    if (const std::optional<ExitStatus> end = WaitFor(pid_, 0)) {
      pid_ = -1;
      return *end;
    }
  }
}

std::string FindProgram(const std::string& name) {
  const auto runs = [](const std::string& path) { return access(path.c_str(), X_OK) == 0; };
  if (name.find('/') != std::string::npos) return runs(name) ? name : "";
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "/usr/bin:/bin");
  for (std::string folder; std::getline(folders, folder, ':');) {
    std::string candidate = (folder.empty() ? "." : folder) + "/" + name;
    if (runs(candidate)) return candidate;
  }
  return "";
}

}  // namespace plumbline::os
