#include "app/daemon/boot_counter.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace plumbline {
namespace {

Error Failed(const std::string& path, std::string_view what) {
  return Error{fmt::format("{}: {}: {}", path, what, std::strerror(errno))};
}

/// Writes a small file so that its name never stands for half of it.
Result<bool> WriteAtomically(const std::string& directory, const std::string& path,
                             const std::string& content) {
  const std::string temporary = path + ".new";
  const int fd = open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd < 0) return Failed(temporary, "cannot be created");
  const bool written =
      write(fd, content.data(), content.size()) == static_cast<ssize_t>(content.size()) &&
      fsync(fd) == 0;
  if (close(fd) != 0 || !written) return Failed(temporary, "cannot be written");
  if (std::rename(temporary.c_str(), path.c_str()) != 0) return Failed(path, "cannot be replaced");
  const int folder = open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return Failed(directory, "cannot be opened");
  const bool kept = fsync(folder) == 0;
  close(folder);
  if (!kept) return Failed(directory, "cannot be synced");
  return true;
}

}  // namespace

Result<std::uint16_t> RaiseBootCounter(const std::string& directory) {
  std::error_code ignored;  // told below, by the file that cannot be created
  std::filesystem::create_directories(directory, ignored);
  const std::string path = directory + "/boot_count";
  std::uint16_t count = 0;
  std::string text;
  if (std::ifstream file(path); std::getline(file, text)) {
    std::from_chars(text.data(), text.data() + text.size(), count);
  }
  ++count;
  const Result<bool> kept = WriteAtomically(directory, path, fmt::format("{}\n", count));
  if (!kept) return Error{kept.error()};
  return count;
}

}  // namespace plumbline
