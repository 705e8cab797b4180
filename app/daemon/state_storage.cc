#include "app/daemon/state_storage.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "app/daemon/boot_counter.h"
#include "drivers/os/descriptor.h"

namespace plumbline {
namespace {

/// Enough to need room of its own on every file system: some keep a few bytes in the inode.
constexpr std::size_t kTrialBytes = 8192;

std::string RemedyOf(int code, const std::string& directory) {
  switch (code) {
    case ENOSPC:
    case EDQUOT:
    case EFBIG:
      return "make room on its disk (`df -h`, `df -i`); the daemon goes on by itself";
    case EROFS:
      return "its file system is read-only: see `dmesg` for why, then mount it writable; the "
             "daemon goes on by itself";
    case EACCES:
    case EPERM:
      return fmt::format(
          "give it to the daemon's user (`chown`, `ls -ld {}`); the daemon goes on by itself",
          directory);
    default:
      return "see `dmesg` and `plumbline doctor`; the daemon goes on by itself once it works";
  }
}

std::string FaultText(int code, const std::string& directory) {
  return fmt::format("{}: {}; {}", directory, std::strerror(code), RemedyOf(code, directory));
}

/// 0, or errno of what failed.
int TryToWrite(const std::string& file) {
  const Descriptor fd(
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

/// Costs no write: where it is true a trial tells.
bool LooksUnwritable(const std::string& directory) {
  struct statvfs about {};
  if (statvfs(directory.c_str(), &about) != 0) return true;
  const auto free_bytes = static_cast<std::uint64_t>(about.f_bavail) * about.f_frsize;
  const bool no_inode = about.f_files > 0 && about.f_favail == 0;  // 0 of 0: it does not count them
  return (about.f_flag & ST_RDONLY) != 0 || free_bytes < kTrialBytes || no_inode;
}

}  // namespace

std::optional<std::string> WhyNotStorable(const std::string& directory) {
  std::error_code failed;
  std::filesystem::create_directories(directory, failed);
  if (failed) return FaultText(failed.value(), directory);
  const std::string file = directory + "/storage-check";
  const int code = TryToWrite(file);
  unlink(file.c_str());
  return code == 0 ? std::nullopt : std::optional(FaultText(code, directory));
}

StateStorage::StateStorage(std::string directory, LogSink sink)
    : directory_(std::move(directory)), sink_(std::move(sink)) {}

std::optional<std::string> StateStorage::Take() {
  bool taken = false;
  Result<DaemonMark> mark = AnnounceDaemon(directory_, &taken);
  if (!mark && taken) return mark.error();
  if (mark) mark_.emplace(std::move(mark).value());
  Check();
  return std::nullopt;
}

void StateStorage::KeepBootCount(std::uint16_t count) {
  boot_count_ = count;
  if (works_) Check();
  if (boot_count_) {
    sink_({Event::kBootCounter, "boot counter not kept until the state directory can be written"});
  }
}

/// What it could not do, in words; nothing where everything is kept.
std::optional<std::string> StateStorage::Try() {
  if (auto why = WhyNotStorable(directory_)) return why;
  if (!mark_) {
    bool taken = false;
    Result<DaemonMark> mark = AnnounceDaemon(directory_, &taken);
    if (!mark && !taken) return mark.error();
    if (!mark) {
      return fmt::format("{}: {}; end it, or give each daemon a state_directory of its own",
                         directory_, mark.error());
    }
    mark_.emplace(std::move(mark).value());
  }
  if (boot_count_) {
    if (const auto kept = plumbline::KeepBootCount(directory_, *boot_count_); !kept) {
      return kept.error();
    }
    boot_count_.reset();
  }
  return std::nullopt;
}

bool StateStorage::Check() {
  const std::optional<std::string> fault = Try();
  const bool back = !fault && !fault_.empty();
  works_ = !fault;
  if (fault && fault_ != *fault) {
    sink_({Event::kStorageLost,
           fmt::format("state directory cannot be written: {}. Corrected points are served; probes "
                       "are refused (code 19), and no model is kept",
                       *fault)});
  }
  if (back) sink_({Event::kStorageBack, "state directory can be written again"});
  fault_ = fault.value_or("");
  if (back && on_works_) on_works_();
  return works_;
}

bool StateStorage::Watch() {
  const bool worked = works_;
  if (!worked || LooksUnwritable(directory_)) Check();
  return works_ && !worked;
}

}  // namespace plumbline
