#include "app/model_store/daemon_signal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstring>
#include <filesystem>

#include "app/config/text_file.h"

namespace plumbline {
namespace {

std::string PidFile(const std::string& state_directory) {
  return state_directory + "/daemon.pid";
}

}  // namespace

Result<FileLock> AnnounceDaemon(const std::string& state_directory) {
  std::error_code ignored;  // told by the lock that cannot be taken
  std::filesystem::create_directories(state_directory, ignored);
  Result<FileLock> lock = FileLock::Take(PidFile(state_directory), FileLock::Wait::kNo);
  if (lock && !lock->Write(fmt::format("{}\n", getpid()))) {
    return Error{
        fmt::format("{}: cannot be written: {}", PidFile(state_directory), std::strerror(errno))};
  }
  return lock;
}

Result<Notified> NotifyDaemon(const std::string& state_directory) {
  const std::string path = PidFile(state_directory);
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return Notified::kNoDaemon;
  const bool free = flock(fd, LOCK_SH | LOCK_NB) == 0;
  close(fd);
  if (free) return Notified::kNoDaemon;
  const Result<std::string> text = ReadTextFile(path);
  pid_t pid = 0;
  if (text) std::from_chars(text->data(), text->data() + text->size(), pid);
  if (pid <= 1) return Notified::kNoDaemon;  // it is just starting, and reads the store itself
  if (kill(pid, SIGHUP) != 0) {
    return Error{
        fmt::format("the daemon (process {}) could not be told: {}", pid, std::strerror(errno))};
  }
  return Notified::kYes;
}

}  // namespace plumbline
