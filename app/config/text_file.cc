#include "app/config/text_file.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "drivers/os/descriptor.h"
#include "drivers/os/file_writing.h"

namespace plumbline {
namespace {

namespace fs = std::filesystem;

/// Between two parts of what a program writes into a pipe; the daemon's threads wait as long.
constexpr int kPipePatience_ms = 1500;

/// Where a path leads in the end; a link to nothing leads to itself.
fs::path TargetOf(const std::string& path) {
  std::error_code unknown;
  fs::path target = fs::canonical(path, unknown);
  return unknown ? fs::path(path) : target;
}

fs::path FolderOf(const fs::path& file) {
  return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

bool IsSpecial(const fs::path& file) {
  std::error_code unknown;
  return fs::exists(file, unknown) && !fs::is_regular_file(file, unknown);
}

Error Why() {
  return Error{std::strerror(errno)};
}

Result<void> WriteSpecial(const fs::path& file, std::string_view text) {
  const Descriptor opened(open(file.c_str(), O_WRONLY | O_CLOEXEC));
  if (!opened || !WriteAll(opened.get(), text)) return Why();
  return {};
}

/// A file that goes away again unless it was renamed.
class TemporaryFile {
 public:
  explicit TemporaryFile(const fs::path& beside)
      : name_(beside.string() + ".XXXXXX"), fd_(mkostemp(name_.data(), O_CLOEXEC)) {}
  ~TemporaryFile() {
    if (created() && !renamed_) unlink(name_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  bool created() const { return static_cast<bool>(fd_); }

  bool Fill(std::string_view text) const {
    const mode_t mask = umask(0);
    umask(mask);
    return fchmod(fd_.get(), 0666 & ~mask) == 0 && WriteAll(fd_.get(), text) &&
           fsync(fd_.get()) == 0;
  }

  bool RenameTo(const fs::path& file) {
    renamed_ = std::rename(name_.c_str(), file.c_str()) == 0;
    return renamed_;
  }

 private:
  std::string name_;
  Descriptor fd_;
  bool renamed_ = false;
};

/// Puts a new file in the place of whatever has that name.
Result<void> ReplaceFile(const fs::path& file, std::string_view text) {
  TemporaryFile temporary(file);
  if (!temporary.created() || !temporary.Fill(text) || !temporary.RenameTo(file)) return Why();
  // The new name survives a power cut once its folder is synced; a file system that cannot do so
  // (some network shares) has still renamed the file.
  SyncFolder(FolderOf(file));
  return {};
}

}  // namespace

Result<std::string> ReadTextFile(const std::string& path) {
  const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  if (!file) return Why();
  std::string text;
  char buffer[65536];
  while (true) {
    const ssize_t count = read(file.get(), buffer, sizeof buffer);
    if (count == 0) return text;
    if (count > 0) {
      text.append(buffer, static_cast<std::size_t>(count));
      if (text.size() > kLargestTextFile)
        return Error{"larger than 256 MiB, which no table or configuration is; check the name"};
      continue;
    }
    if (errno == EINTR) continue;
    if (errno != EAGAIN) return Why();
    pollfd waiting{file.get(), POLLIN, 0};
    if (poll(&waiting, 1, kPipePatience_ms) == 0)
      return Error{"is a pipe, and nothing came for 1.5 s; check the program that writes it"};
  }
}

Result<void> WriteTextFile(const std::string& path, std::string_view text) {
  // It may stand for a file that others write to as well.
  if (path == "/dev/stdout") {
    if (!WriteAll(STDOUT_FILENO, text)) return Why();
    return {};
  }
  const fs::path file = TargetOf(path);
  if (IsSpecial(file)) return WriteSpecial(file, text);
  return ReplaceFile(file, text);
}

Result<void> WriteStateFile(const std::string& path, std::string_view text) {
  return ReplaceFile(path, text);
}

std::optional<Error> WhyNotWritable(const std::string& path) {
  const fs::path file = TargetOf(path);
  std::error_code unknown;
  if (fs::is_directory(file, unknown)) return Error{std::strerror(EISDIR)};
  if (IsSpecial(file)) return access(file.c_str(), W_OK) == 0 ? std::nullopt : std::optional(Why());
  if (access(FolderOf(file).c_str(), W_OK | X_OK) != 0) return Why();
  return std::nullopt;
}

}  // namespace plumbline
