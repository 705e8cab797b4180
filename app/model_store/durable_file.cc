#include "app/model_store/durable_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "drivers/files/open_failure.h"

namespace plumbline {
namespace {

Error Failed(const std::string& path, std::string_view what) {
  const int error = errno;
  return Error{fmt::format("{}: {}: {}{}", path, what, std::strerror(error), WriteRemedy(path))};
}

bool WriteAll(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = write(fd, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

}  // namespace

Result<bool> WriteDurably(const std::string& path, std::string_view content, unsigned mode) {
  const std::string temporary = path + ".new";
  unlink(temporary.c_str());  // of a write that was cut short; it may be read-only
  const int fd = open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
  if (fd < 0) return Failed(temporary, "cannot be created");
  const bool written = WriteAll(fd, content) && fsync(fd) == 0;
  if (close(fd) != 0 || !written) return Failed(temporary, "cannot be written");
  if (std::rename(temporary.c_str(), path.c_str()) != 0) return Failed(path, "cannot be replaced");
  const std::string directory = std::filesystem::path(path).parent_path().string();
  const int folder = open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return Failed(directory, "cannot be opened");
  const bool kept = fsync(folder) == 0;
  close(folder);
  if (!kept) return Failed(directory, "cannot be synced");
  return true;
}

Result<FileLock> FileLock::Take(const std::string& path, Wait wait) {
  const int fd = open(path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0644);
  if (fd < 0) return Failed(path, "cannot be opened");
  FileLock lock(fd);
  while (flock(fd, LOCK_EX | (wait == Wait::kNo ? LOCK_NB : 0)) != 0) {
    if (errno == EINTR) continue;
    return Failed(path, errno == EWOULDBLOCK ? "is held by another process: end that one first"
                                             : "cannot be locked");
  }
  return lock;
}

FileLock::~FileLock() {
  if (fd_ >= 0) close(fd_);
}

}  // namespace plumbline
