// Advisory lock on a file, which the kernel releases when its process ends.
#pragma once

#include <functional>
#include <string>
#include <utility>

#include "drivers/os/descriptor.h"
#include "firmware-like/result.h"

namespace plumbline::files {

/// Advisory lock on a file, held as long as the object exists; released by the kernel however the
/// process ends.
class FileLock {
 public:
  /// How long to wait for a lock that another process holds.
  struct WaitPolicy {
    double timeout_s = 10;  ///< after which taking the lock fails
    double report_s = 1;    ///< after which `report` is called, once
    std::function<void(const std::string& what)> report = {};
  };
  /// Takes the lock; creates the file if it is missing, and fails if it is a symbolic link. If
  /// another process holds the lock for too long, the error names that process if the kernel
  /// reports it.
  static Result<FileLock> Take(const std::string& path, const WaitPolicy& policy);

 private:
  explicit FileLock(os::Descriptor file) : file_(std::move(file)) {}
  os::Descriptor file_;
};

}  // namespace plumbline::files
