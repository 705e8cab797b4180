// How a command finds the daemon of a state directory.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "drivers/os/descriptor.h"
#include "firmware-like/result.h"

namespace plumbline {

/// The daemon's mark on its state directory: `daemon.pid`, under a record lock (fcntl) of its
/// process, held as long as the object lives and freed by the kernel however the process ends. The
/// kernel tells whose lock it is; the process id in the file is for people, and the file is empty
/// where no daemon runs. No other code of the process may open the file: closing it would free the
/// lock.
class StateDirectoryLock {
 public:
  StateDirectoryLock(StateDirectoryLock&&) = default;
  StateDirectoryLock& operator=(StateDirectoryLock&&) = delete;
  ~StateDirectoryLock();

 private:
  friend Result<StateDirectoryLock> LockStateDirectory(const std::string& state_directory, bool* taken);
  explicit StateDirectoryLock(Descriptor file) : file_(std::move(file)) {}
  Descriptor file_;
};

/// Taken by the daemon for its whole life, after it blocked SIGHUP: it may be told at once.
/// The lock is what counts: a full disk that takes no process id leaves the mark valid.
/// @param taken  becomes true where another daemon has the mark, false where the file failed
/// @return       the mark, or why there is none; where another daemon has it the bare cause,
///               "another plumblined (process 812) uses it", without directory and remedy
Result<StateDirectoryLock> LockStateDirectory(const std::string& state_directory, bool* taken = nullptr);

/// Which other process has the daemon's mark on that directory: "another plumblined (process 812)
/// uses it"; nothing where none has. Asked before this process takes the mark, never afterwards: it
/// opens the file, and closing it would free the lock.
std::optional<std::string> FindOtherDaemon(const std::string& state_directory);

enum class Notified { kYes, kNoDaemon };
/// Sends SIGHUP to the daemon of that directory; takes no lock, so that a daemon may start at the
/// same moment. @return whether there is one, or why it could not be told (another user's)
Result<Notified> NotifyDaemon(const std::string& state_directory);

}  // namespace plumbline
