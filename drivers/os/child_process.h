// Child process: a program started with the descriptors it is given, which ends with its owner.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware-like/result.h"

namespace plumbline {

/// How a program is started. It inherits the environment and nothing else of this process: no
/// descriptor that is not handed over, no blocked signal.
struct ChildOptions {
  struct Handed {
    int number;      ///< in the child
    int descriptor;  ///< of this process, which keeps it
  };
  std::vector<std::string> arguments;  ///< the program's path first
  /// Standard streams that are not among them are /dev/null.
  std::vector<Handed> descriptors = {};
  int nice = 0;            ///< 0: as this process
  bool own_group = false;  ///< is ended with the processes it has started itself
};

/// How a child ended.
struct ChildEnd {
  /// Of a child whose program could not be run.
  static constexpr int kNotRun = 127;

  std::optional<int> exit_code;  ///< nothing: it was killed
  int signal = 0;                ///< that killed it; 0: nobody knows, somebody else waited for it

  bool ok() const { return exit_code == 0; }
};

/// One running program, or none. It is killed with this object, and by the kernel when the thread
/// that started it ends, however that happens. Used by that thread alone.
class ChildProcess {
 public:
  ChildProcess() = default;  ///< none
  /// Returns without waiting for the program; one that cannot be run exits with kNotRun.
  static Result<ChildProcess> Start(const ChildOptions& options);
  ChildProcess(ChildProcess&& other) noexcept
      : pid_(std::exchange(other.pid_, -1)), own_group_(other.own_group_) {}
  ChildProcess& operator=(ChildProcess&& other) noexcept;
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  ~ChildProcess() { End(); }

  bool started() const { return pid_ > 0; }  ///< and its end not taken yet
  pid_t pid() const { return pid_; }         ///< -1: none

  /// How it ended, once; nothing while it runs, or where there is none.
  std::optional<ChildEnd> Poll();
  /// Sends it `signal` (0: none), waits at most `patience_s` for its end, then kills it. @return
  /// how it ended; a killed child where there is none
  ChildEnd End(double patience_s = 0, int signal = 0);

 private:
  ChildProcess(pid_t pid, bool own_group) : pid_(pid), own_group_(own_group) {}
  void Kill() const;

  pid_t pid_ = -1;
  bool own_group_ = false;
};

/// The path of a program: a name without a slash is looked for in PATH. Empty: there is none.
std::string FindProgram(const std::string& name);

}  // namespace plumbline
