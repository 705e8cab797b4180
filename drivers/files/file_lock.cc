#include "drivers/files/file_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <sstream>
#include <thread>

#include "drivers/files/open_failure.h"

namespace plumbline::files {
namespace {

Error LockFailure(const std::string& path, std::string_view what) {
  const int error = errno;
  return Error{
      fmt::format("{}: {}: {}{}", path, what, std::strerror(error), files::WriteRemedy(path))};
}

/// The process that holds the lock on this file, from a line in /proc/locks such as
/// "3: FLOCK  ADVISORY  WRITE 1234 fd:01:5678 0 EOF"; waiting processes have "->" after the number.
std::string HolderText(int fd) {
  struct stat about {};
  std::ifstream locks("/proc/locks");
  if (fstat(fd, &about) != 0) return "another process";
  const std::string inode = fmt::format(":{}", about.st_ino);
  for (std::string line; std::getline(locks, line);) {
    std::istringstream words(line);
    std::string number, kind, manner, access, file;
    long process = 0;
    words >> number >> kind >> manner >> access >> process >> file;
    if (!words || kind != "FLOCK" || !file.ends_with(inode) || process <= 0) continue;
    std::string name;
    std::getline(std::ifstream(fmt::format("/proc/{}/comm", process)) >> std::ws, name);
    return name.empty() ? fmt::format("process {}", process)
                        : fmt::format("process {} ({})", process, name);
  }
  return "another process";
}

}  // namespace

Result<FileLock> FileLock::Take(const std::string& path, const WaitPolicy& policy) {
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::milliseconds kPoll{20};
  FileLock lock(
      os::Descriptor(open(path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0644)));
  const int fd = lock.file_.get();
  if (fd < 0) return LockFailure(path, "cannot be opened");
  const Clock::time_point start = Clock::now();
  bool reported = false;
  while (flock(fd, LOCK_EX | LOCK_NB) != 0) {
    if (errno == EINTR) continue;
    if (errno != EWOULDBLOCK) return LockFailure(path, "cannot be locked");
    const double waited_s = std::chrono::duration<double>(Clock::now() - start).count();
    if (waited_s >= policy.timeout_s) {
      return Error{fmt::format(
          "{}: waited {:g} s for the lock, which {} now holds. Nothing was changed. Wait until it "
          "has finished, or stop it, then try again (`fuser -v {}` lists the processes that have "
          "the file open)",
          path, policy.timeout_s, HolderText(fd), path)};
    }
    if (!reported && waited_s >= policy.report_s && policy.report) {
      policy.report(fmt::format("waiting for {}, which holds {}", HolderText(fd), path));
      reported = true;
    }
    std::this_thread::sleep_for(kPoll);
  }
  return lock;
}

}  // namespace plumbline::files
