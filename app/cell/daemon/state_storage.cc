#include "app/cell/daemon/state_storage.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "drivers/files/replace_file.h"
#include "drivers/os/descriptor.h"

namespace plumbline::cell {
namespace {

std::string CounterFile(const std::string& directory) {
  return directory + "/boot_count";
}

}  // namespace

std::uint16_t NextBootCount(const std::string& directory) {
  std::uint16_t count = 0;
  std::string text;
  if (std::ifstream file(CounterFile(directory)); std::getline(file, text)) {
    std::from_chars(text.data(), text.data() + text.size(), count);
  }
  return ++count;
}

Result<void> StoreBootCount(const std::string& directory, std::uint16_t count) {
  std::error_code ignored;  // reported below by the file that cannot be created
  std::filesystem::create_directories(directory, ignored);
  return files::ReplaceFileDurably(CounterFile(directory), fmt::format("{}\n", count));
}

namespace {

/// Large enough to need a block on every file system: some store a few bytes in the inode.
constexpr std::size_t kTrialBytes = 8192;

std::string RemedyOf(int code, const std::string& directory) {
  switch (code) {
    case ENOSPC:
    case EDQUOT:
    case EFBIG:
      return "make room on its disk (`df -h`, `df -i`); the daemon recovers by itself";
    case EROFS:
      return "its file system is read-only: see `dmesg` for why, then mount it writable; the "
             "daemon recovers by itself";
    case EACCES:
    case EPERM:
      return fmt::format(
          "give it to the daemon's user (`chown`, `ls -ld {}`); the daemon recovers by itself",
          directory);
    default:
      return "see `dmesg` and `plumbline doctor`; the daemon recovers by itself once it is fixed";
  }
}

std::string FaultText(int code, const std::string& directory) {
  return fmt::format("{}: {}; {}", directory, std::strerror(code), RemedyOf(code, directory));
}

/// @return  0, or the errno of the call that failed
int TryToWrite(const std::string& file) {
  const os::Descriptor fd(
      open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0600));
  if (!fd) return errno;
  const std::array<char, kTrialBytes> bytes{};
  int code = 0;
  for (std::size_t done = 0; done < bytes.size() && code == 0;) {
    const ssize_t written = write(fd.get(), bytes.data() + done, bytes.size() - done);
    if (written > 0) done += static_cast<std::size_t>(written);
    if (written == 0) code = ENOSPC;
    if (written < 0 && errno != EINTR) code = errno;
  }
  if (code == 0 && fsync(fd.get()) != 0) code = errno;
  return code;
}

/// Cheap check without a write; if true, only a trial write gives certainty.
bool LooksUnwritable(const std::string& directory) {
  struct statvfs about {};
  if (statvfs(directory.c_str(), &about) != 0) return true;
  const auto free_bytes = static_cast<std::uint64_t>(about.f_bavail) * about.f_frsize;
  const bool no_inode =
      about.f_files > 0 && about.f_favail == 0;  // 0 of 0: the file system does not count them
  return (about.f_flag & ST_RDONLY) != 0 || free_bytes < kTrialBytes || no_inode;
}

}  // namespace

std::optional<std::string> StorageFault(const std::string& directory) {
  std::error_code failed;
  std::filesystem::create_directories(directory, failed);
  if (failed) return FaultText(failed.value(), directory);
  const std::string file = directory + "/storage-check";
  const int code = TryToWrite(file);
  unlink(file.c_str());
  return code == 0 ? std::nullopt : std::optional(FaultText(code, directory));
}

StateStorage::StateStorage(std::string directory, log::LogSink sink)
    : directory_(std::move(directory)), sink_(std::move(sink)) {}

std::optional<std::string> StateStorage::Acquire() {
  bool in_use = false;
  Result<StateDirectoryLock> lock = LockStateDirectory(directory_, &in_use);
  if (!lock && in_use) return lock.error();
  if (lock) lock_.emplace(std::move(lock).value());
  Check();
  return std::nullopt;
}

void StateStorage::StoreBootCount(std::uint16_t count) {
  boot_count_ = count;
  if (writable_) Check();
  if (boot_count_) {
    sink_({log::Event::kBootCounter,
           "boot counter not stored: the state directory cannot be written. It is stored as soon "
           "as it can"});
  }
}

/// @return  why the directory cannot be used, or something cannot be stored there; nullopt if all
///          is well
std::optional<std::string> StateStorage::Try() {
  if (auto why = StorageFault(directory_)) return why;
  if (!lock_) {
    bool in_use = false;
    Result<StateDirectoryLock> lock = LockStateDirectory(directory_, &in_use);
    if (!lock && !in_use) return lock.error();
    if (!lock) {
      return fmt::format("{}: {}; stop it, or give each daemon its own state_directory", directory_,
                         lock.error());
    }
    lock_.emplace(std::move(lock).value());
  }
  if (boot_count_) {
    if (const auto stored = plumbline::cell::StoreBootCount(directory_, *boot_count_); !stored) {
      return stored.error();
    }
    boot_count_.reset();
  }
  return std::nullopt;
}

bool StateStorage::Check() {
  const std::optional<std::string> fault = Try();
  const bool recovered = !fault && !fault_.empty();
  writable_ = !fault;
  if (fault && fault_ != *fault) {
    sink_({log::Event::kStorageLost,
           fmt::format("state directory cannot be written: {}. Corrected points are still served; "
                       "probes are refused (code 19), and models are not stored",
                       *fault)});
  }
  if (recovered) sink_({log::Event::kStorageRestored, "state directory can be written again"});
  fault_ = fault.value_or("");
  if (recovered && on_writable_) on_writable_();
  return writable_;
}

bool StateStorage::Poll() {
  const bool was_writable = writable_;
  if (!was_writable || LooksUnwritable(directory_)) Check();
  return writable_ && !was_writable;
}

}  // namespace plumbline::cell
