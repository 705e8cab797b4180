// Complete writes to a descriptor, and fsync of files and folders.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <string_view>

#include "drivers/os/descriptor.h"

namespace plumbline::os {

/// Writes all of `text`, repeating partial writes. @return  false with errno set on failure
inline bool WriteAll(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = write(fd, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

/// Waits until the file's content is on the disk. @return  false with errno set on failure
inline bool SyncFile(const std::string& path) {
  const Descriptor file(open(path.c_str(), O_RDWR | O_CLOEXEC));
  return file && fsync(file.get()) == 0;
}

/// Waits until the folder's entries (created, renamed, removed files) are on the disk.
inline bool SyncFolder(const std::string& path) {
  const Descriptor folder(open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  return folder && fsync(folder.get()) == 0;
}

}  // namespace plumbline::os
