// Files that a power cut leaves whole: the old content or the new one.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "drivers/os/descriptor.h"
#include "firmware-like/result.h"

namespace plumbline {

/// Writes `content` beside `path`, syncs it, renames it to `path`, syncs the folder. At every
/// moment `path` stands for its whole old content (or for nothing) or its whole new one. No link is
/// followed: one of that name is replaced.
/// @param mode  permissions, 0444 for what is never written again
Result<void> WriteDurably(const std::string& path, std::string_view content, unsigned mode = 0644);

/// An advisory lock on a file, held as long as the object lives; freed by the kernel when the
/// process ends, however it ends.
class FileLock {
 public:
  /// How long to wait for a lock that another process holds.
  struct Patience {
    double longest_s = 10;  ///< then it is an error
    double report_s = 1;    ///< then `report` is called, once
    std::function<void(const std::string& what)> report = {};
  };
  /// Makes the file where there is none. A link in its place is an error. An error that is due to
  /// another process names it, where the kernel does.
  static Result<FileLock> Take(const std::string& path, const Patience& patience);

 private:
  explicit FileLock(Descriptor file) : file_(std::move(file)) {}
  Descriptor file_;
};

}  // namespace plumbline
