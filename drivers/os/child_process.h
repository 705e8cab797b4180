// Child process with explicitly passed descriptors, killed when its owner ends.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware-like/result.h"

namespace plumbline::os {

/// Options for starting a program. The program inherits only the environment and the listed
/// descriptors from this process; no signals are blocked.
struct ChildOptions {
  struct PassedDescriptor {
    int number;      ///< descriptor number in the child
    int descriptor;  ///< of this process, which continues to own it
  };
  std::vector<std::string> arguments;  ///< the program's path first
  /// Standard streams that are not listed are connected to /dev/null.
  std::vector<PassedDescriptor> descriptors = {};
  int nice = 0;  ///< 0: unchanged
  /// Limit on its writable memory (RLIMIT_DATA); allocations beyond it fail. 0: unchanged.
  std::size_t memory_bytes = 0;
  bool own_group = false;  ///< kill it together with the processes it has started
};

/// Exit status of a child.
struct ExitStatus {
  /// Exit code of a child whose program could not be executed.
  static constexpr int kNotRun = 127;

  std::optional<int> exit_code;  ///< nullopt if killed by a signal
  int signal = 0;                ///< that killed it; 0 if unknown, because other code has reaped it

  bool ok() const { return exit_code == 0; }
};

/// One running program, or none. The destructor kills it, and so does the kernel when the thread
/// that started it ends for any reason. Must be used by that thread only.
class ChildProcess {
 public:
  ChildProcess() = default;  ///< none
  /// Returns without waiting for the program; if the program cannot be executed, the child exits
  /// with kNotRun.
  static Result<ChildProcess> Start(const ChildOptions& options);
  ChildProcess(ChildProcess&& other) noexcept
      : pid_(std::exchange(other.pid_, -1)), own_group_(other.own_group_) {}
  ChildProcess& operator=(ChildProcess&& other) noexcept;
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  ~ChildProcess() { End(); }

  bool started() const { return pid_ > 0; }  ///< and not reaped yet
  pid_t pid() const { return pid_; }         ///< -1: none

  /// Its exit status, once; nullopt while it runs, or if there is no child.
  std::optional<ExitStatus> Poll();
  /// Sends `signal` (none if 0), waits at most `timeout_s` for the child to exit, then kills it.
  /// @return  its exit status; if there is no child, that of a killed one
  ExitStatus End(double timeout_s = 0, int signal = 0);

 private:
  ChildProcess(pid_t pid, bool own_group) : pid_(pid), own_group_(own_group) {}
  void Kill() const;

  pid_t pid_ = -1;
  bool own_group_ = false;
};

/// Path of a program; a name without a slash is searched in PATH. Empty if not found.
std::string FindProgram(const std::string& name);

}  // namespace plumbline::os
