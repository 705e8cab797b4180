#include "drivers/files/text_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "drivers/files/replace_file.h"
#include "drivers/os/descriptor.h"
#include "drivers/os/file_writing.h"

namespace plumbline::files {
namespace {

namespace fs = std::filesystem;

/// Longest silence of a program that writes into a pipe. Short, since a daemon thread waits too.
constexpr int kPipeTimeout_ms = 1500;

/// The file that a path refers to after following links; a dangling link refers to itself.
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

Error SystemError() {
  return Error{std::strerror(errno)};
}

/// @param size  of the file, if it is known
Error TooLarge(std::optional<std::size_t> size, const SizeLimit& limit) {
  const auto megabytes = [](std::size_t bytes) { return 1e-6 * static_cast<double>(bytes); };
  const double most = megabytes(limit.bytes);
  const std::string how_large =
      size ? fmt::format("{:.1f} MB", megabytes(*size)) : fmt::format("more than {:.0f} MB", most);
  return Error{fmt::format("it has {}, but {} has at most {:.0f} MB. {}", how_large, limit.kind,
                           most, limit.remedy)};
}

Result<void> WriteSpecial(const fs::path& file, std::string_view text) {
  const os::Descriptor opened(open(file.c_str(), O_WRONLY | O_CLOEXEC));
  if (!opened || !os::WriteAll(opened.get(), text)) return SystemError();
  return {};
}

}  // namespace

Result<std::string> ReadFileUpTo(const SizeLimit& limit, const std::string& path) {
  const os::Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  if (!file) return SystemError();
  std::string text;
  struct stat about {};
  if (fstat(file.get(), &about) == 0 && S_ISREG(about.st_mode)) {
    const auto size = static_cast<std::size_t>(about.st_size);
    if (size > limit.bytes) return TooLarge(size, limit);
    text.reserve(size);
  }
  char buffer[65536];
  while (true) {
    const ssize_t count = read(file.get(), buffer, sizeof buffer);
    if (count == 0) return text;
    if (count > 0) {
      text.append(buffer, static_cast<std::size_t>(count));
      if (text.size() > limit.bytes) return TooLarge(std::nullopt, limit);
      continue;
    }
    if (errno == EINTR) continue;
    if (errno != EAGAIN) return SystemError();
    pollfd waiting{file.get(), POLLIN, 0};
    if (poll(&waiting, 1, kPipeTimeout_ms) == 0)
      return Error{
          "is a pipe that delivered no data for 1.5 s; check the program that writes to it"};
  }
}

Result<std::string> ReadTextFile(const std::string& path) {
  return ReadFileUpTo(kConfigurationSize, path);
}

Result<void> WriteTextFile(const std::string& path, std::string_view text) {
  // The shell may have redirected it to a file that other programs write to as well.
  if (path == "/dev/stdout") {
    if (!os::WriteAll(STDOUT_FILENO, text)) return SystemError();
    return {};
  }
  const fs::path file = TargetOf(path);
  if (IsSpecial(file)) return WriteSpecial(file, text);
  return files::ReplaceFile(file, text);
}

Result<void> CheckWritable(const std::string& path) {
  const fs::path file = TargetOf(path);
  std::error_code unknown;
  if (fs::is_directory(file, unknown)) return Error{std::strerror(EISDIR)};
  const bool writable = IsSpecial(file) ? access(file.c_str(), W_OK) == 0
                                        : access(FolderOf(file).c_str(), W_OK | X_OK) == 0;
  if (!writable) return SystemError();
  return {};
}

}  // namespace plumbline::files
