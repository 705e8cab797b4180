#include "drivers/files/replace_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <deque>
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

std::string NewNameBeside(const std::string& path) {
  static std::atomic<unsigned> writes{0};
  return fmt::format("{}.{}-{}", path, getpid(), writes++);
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

  /// Writes, syncs and closes it. @return  false with errno set on failure
  bool Write(std::string_view content) {
    return exists_ && os::WriteAll(file_.get(), content) && fsync(file_.get()) == 0 &&
           file_.CloseWritten();
  }
  /// Renames it. @return  false with errno set on failure
  bool Become(const std::string& path) {
    if (std::rename(name_.c_str(), path.c_str()) != 0) return false;
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
  TemporaryFile temporary(NewNameBeside(path), 0666);
  if (!temporary.Write(content) || !temporary.Become(path)) return SystemReason();
  // A file system that cannot sync a folder (some network shares) has still renamed the file.
  os::SyncFolder(FolderOf(path));
  return {};
}

Result<void> ReplaceFiles(std::span<const NewFile> files) {
  const auto failure = [](const std::string& path) {
    return Error{path + ": " + SystemReason().message};
  };
  std::deque<TemporaryFile> written;
  for (const NewFile& file : files) {
    std::error_code unknown;
    if (std::filesystem::is_directory(file.path, unknown)) {
      return Error{file.path + ": is a folder"};
    }
    if (!written.emplace_back(NewNameBeside(file.path), 0666).Write(file.content)) {
      return failure(file.path);
    }
  }
  for (std::size_t k = 0; k < files.size(); ++k) {
    if (!written[k].Become(files[k].path)) return failure(files[k].path);
  }
  for (const NewFile& file : files) os::SyncFolder(FolderOf(file.path));
  return {};
}

Result<void> ReplaceFileDurably(const std::string& path, std::string_view content, unsigned mode) {
  TemporaryFile temporary(path + ".new", mode);
  if (temporary.Write(content) && temporary.Become(path) && os::SyncFolder(FolderOf(path)))
    return {};
  const Error reason = SystemReason();
  return Error{fmt::format("{}: {}", path, WriteErrorText(path, reason.message))};
}

}  // namespace plumbline::files
