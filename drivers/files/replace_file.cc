#include "drivers/files/replace_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <utility>

#include "drivers/files/open_failure.h"
#include "drivers/os/descriptor.h"
#include "drivers/os/file_writing.h"

namespace plumbline::files {
namespace {

Error SystemReason() {
  return Error{std::strerror(errno)};
}

std::string FolderOf(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  return folder.empty() ? "." : folder.string();
}

/// A file that is deleted unless it was renamed.
class TemporaryFile {
 public:
  /// Deletes a file of that name, which an interrupted write left, possibly read-only.
  TemporaryFile(std::string name, unsigned mode) : name_(std::move(name)) {
    unlink(name_.c_str());
    file_ = os::Descriptor(open(name_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode));
    exists_ = static_cast<bool>(file_);
  }
  ~TemporaryFile() {
    if (exists_) unlink(name_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  /// Writes, syncs, closes and renames it. @return  false with errno set on failure
  bool Become(const std::string& path, std::string_view content) {
    if (!exists_ || !os::WriteAll(file_.get(), content) || fsync(file_.get()) != 0 ||
        !file_.CloseWritten() || std::rename(name_.c_str(), path.c_str()) != 0) {
      return false;
    }
    exists_ = false;
    return true;
  }

 private:
  std::string name_;
  os::Descriptor file_;
  bool exists_ = false;
};

}  // namespace

Result<void> ReplaceFile(const std::string& path, std::string_view content) {
  static std::atomic<unsigned> writes{0};
  TemporaryFile temporary(fmt::format("{}.{}-{}", path, getpid(), writes++), 0666);
  if (!temporary.Become(path, content)) return SystemReason();
  // A file system that cannot sync a folder (some network shares) has still renamed the file.
  os::SyncFolder(FolderOf(path));
  return {};
}

Result<void> ReplaceFileDurably(const std::string& path, std::string_view content, unsigned mode) {
  TemporaryFile temporary(path + ".new", mode);
  if (temporary.Become(path, content) && os::SyncFolder(FolderOf(path))) return {};
  const Error reason = SystemReason();
  return Error{fmt::format("{}: {}", path, WriteErrorText(path, reason.message))};
}

}  // namespace plumbline::files
