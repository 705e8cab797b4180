// Lock by which the daemon owns its state directory, and notification of the daemon by commands.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "drivers/os/descriptor.h"
#include "firmware-like/result.h"

namespace plumbline::cell {

/// The daemon's lock on its state directory: a record lock (fcntl) on `daemon.pid`, held as long as
/// the object exists and released by the kernel however the process ends. The kernel reports who
/// holds it; the process id in the file is for people, and the file is empty if no daemon runs. No
/// other code of the process may open the file: closing it would release the lock.
class StateDirectoryLock {
 public:
  StateDirectoryLock(StateDirectoryLock&&) = default;
  StateDirectoryLock& operator=(StateDirectoryLock&&) = delete;
  ~StateDirectoryLock();

 private:
  friend Result<StateDirectoryLock> LockStateDirectory(const std::string& state_directory,
                                                       bool* in_use);
  explicit StateDirectoryLock(os::Descriptor file) : file_(std::move(file)) {}
  os::Descriptor file_;
};

/// Locks the state directory for this process. The daemon must have blocked SIGHUP before, because
/// commands may notify it from now on. The lock is valid even if a full disk prevents writing the
/// process id.
/// @param in_use  set to true if another daemon holds the lock, false if the file cannot be opened
///                or locked
/// @return        why it cannot be locked; if another daemon holds it, only "another plumblined
///                (process 812) uses it", without directory and remedy
Result<StateDirectoryLock> LockStateDirectory(const std::string& state_directory,
                                              bool* in_use = nullptr);

/// Another process that holds the daemon's lock on that directory: "another plumblined (process
/// 812) uses it"; nullopt if there is none. Must not be called while this process holds the lock:
/// it opens the file, and closing it would release the lock.
std::optional<std::string> FindOtherDaemon(const std::string& state_directory);

enum class Notified { kYes, kNoDaemon };
/// Sends SIGHUP to the daemon of that directory. Takes no lock, so that a daemon can start at the
/// same time. @return  whether there is a daemon, or why it cannot be notified (it runs as another
/// user)
Result<Notified> NotifyDaemon(const std::string& state_directory);

}  // namespace plumbline::cell
