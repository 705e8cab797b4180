#include "app/cell/model_store/daemon_signal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <optional>

#include "drivers/files/open_failure.h"

namespace plumbline::cell {
namespace {

std::string PidFile(const std::string& state_directory) {
  return state_directory + "/daemon.pid";
}

struct flock WholeFile() {
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  return lock;
}

/// The process that holds the lock; nullopt if none does, 0 if it is in another container.
std::optional<pid_t> HolderOf(int fd) {
  struct flock lock = WholeFile();
  if (fcntl(fd, F_GETLK, &lock) != 0 || lock.l_type == F_UNLCK) return std::nullopt;
  return lock.l_pid;
}

/// "another plumblined (process 812) uses it".
std::string UsedBy(std::optional<pid_t> holder) {
  if (!holder) return "another plumblined uses it";  // it has just ended
  if (*holder <= 0) return "another plumblined (in another container) uses it";
  return fmt::format("another plumblined (process {}) uses it", *holder);
}

/// Uses the system call directly because Debian 12's <sys/pidfd.h> does not compile as C++.
os::Descriptor OpenProcess(pid_t pid) {
  return os::Descriptor(static_cast<int>(syscall(SYS_pidfd_open, pid, 0)));
}

}  // namespace

StateDirectoryLock::~StateDirectoryLock() {
  if (file_) static_cast<void>(ftruncate(file_.get(), 0) == 0);  // the lock is what counts
}

Result<StateDirectoryLock> LockStateDirectory(const std::string& state_directory, bool* in_use) {
  std::error_code ignored;  // reported below by the file that cannot be opened
  std::filesystem::create_directories(state_directory, ignored);
  const std::string path = PidFile(state_directory);
  const auto failed = [&path](const char* what) {
    const int error = errno;
    return Error{
        fmt::format("{}: {}: {}{}", path, what, std::strerror(error), files::WriteRemedy(path))};
  };
  if (in_use != nullptr) *in_use = false;
  os::Descriptor file(open(path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0644));
  const int fd = file.get();
  if (!file) return failed("cannot be opened");
  struct flock lock = WholeFile();
  if (fcntl(fd, F_SETLK, &lock) != 0) {
    const bool held = errno == EAGAIN || errno == EACCES;
    if (in_use != nullptr) *in_use = held;
    return held ? Error{UsedBy(HolderOf(fd))} : failed("cannot be locked");
  }
  StateDirectoryLock held_lock(std::move(file));
  const std::string text = fmt::format("{}\n", getpid());
  static_cast<void>(ftruncate(fd, 0) == 0);
  static_cast<void>(pwrite(fd, text.data(), text.size(), 0));
  return held_lock;
}

std::optional<std::string> FindOtherDaemon(const std::string& state_directory) {
  const os::Descriptor file(
      open(PidFile(state_directory).c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC));
  if (!file) return std::nullopt;
  const std::optional<pid_t> holder = HolderOf(file.get());
  if (!holder) return std::nullopt;
  return UsedBy(holder);
}

Result<Notified> NotifyDaemon(const std::string& state_directory) {
  const os::Descriptor file(
      open(PidFile(state_directory).c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC));
  if (!file) return Notified::kNoDaemon;
  const std::optional<pid_t> pid = HolderOf(file.get());
  const os::Descriptor process = pid.value_or(0) > 0 ? OpenProcess(*pid) : os::Descriptor();
  // Process ids are reused: the opened process is the holder only if it still holds the lock.
  if (!pid || HolderOf(file.get()) != pid) return Notified::kNoDaemon;
  if (*pid <= 0) return Error{"the daemon runs in another container and cannot be notified"};
  if (process && syscall(SYS_pidfd_send_signal, process.get(), SIGHUP, nullptr, 0) == 0) {
    return Notified::kYes;
  }
  const int why = errno;
  if (why == ESRCH) return Notified::kNoDaemon;  // it has just ended
  return Error{
      fmt::format("the daemon (process {}) could not be notified: {}", *pid, std::strerror(why))};
}

}  // namespace plumbline::cell
