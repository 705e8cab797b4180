// Writing a whole text to a descriptor, and having files and folders reach the disk.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <string_view>

#include "drivers/os/descriptor.h"

namespace plumbline {

/// Writes all of `text`, however many calls it takes. @return false with errno set
inline bool WriteAll(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = write(fd, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

/// Waits until what was written to the file is on the disk. @return false with errno set
inline bool SyncFile(const std::string& path) {
  const Descriptor file(open(path.c_str(), O_RDWR | O_CLOEXEC));
  return file && fsync(file.get()) == 0;
}

/// The same for the names in a folder: new, renamed, removed ones.
inline bool SyncFolder(const std::string& path) {
  const Descriptor folder(open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  return folder && fsync(folder.get()) == 0;
}

}  // namespace plumbline
