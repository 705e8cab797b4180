#include "app/doctor/computer.h"

#include <fmt/format.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>

#include "app/config/utc_text.h"
#include "app/service/utc_clock.h"

namespace plumbline {
namespace {

constexpr double kGiB = 1024.0 * 1024.0 * 1024.0;
constexpr double kTight_GiB = 1.0, kFull_GiB = 0.1;
constexpr double kEarliest_s = 1735689600;  ///< 2025-01-01: no clock of this program is before it

bool InPath(const std::string& program) {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "/usr/bin:/bin");
  for (std::string file; std::getline(folders, file, ':');) {
    file.append("/").append(program);
    if (access(file.c_str(), X_OK) == 0) return true;
  }
  return false;
}

}  // namespace

CheckedThing LookAtClock() {
  const double now_s = ComputerUtcSeconds();
  const std::string when = TextFromUtc(now_s);
  if (now_s < kEarliest_s) {
    return {Health::kFault, "clock", when + ": it was never set",
            "set it, and have a time service keep it: systemctl enable --now systemd-timesyncd"};
  }
  timex state{};
  if (adjtimex(&state) == TIME_ERROR || (state.status & STA_UNSYNC) != 0) {
    return {Health::kWarning, "clock", when + ", kept by no time service",
            "effects of time need it: systemctl enable --now systemd-timesyncd (or chrony)"};
  }
  return {Health::kGood, "clock", when + ", kept by a time service", {}};
}

CheckedThing LookAtState(const std::string& directory, const Account& account) {
  const auto fault = [](const std::string& told, const std::string& remedy) {
    return CheckedThing{Health::kFault, "state directory", told, remedy};
  };
  std::error_code unknown;
  if (!std::filesystem::is_directory(directory, unknown)) {
    return fault(directory + " is not there",
                 "the service makes it at its first start; started by hand: mkdir, or another "
                 "state_directory");
  }
  if (const std::string why = WhyNoAccess(account, directory, true); !why.empty()) {
    return fault(why, fmt::format("chown -R {} {}", account.name,
                                  std::filesystem::absolute(directory).string()));
  }
  struct statvfs disk {};
  if (statvfs(directory.c_str(), &disk) != 0) {
    return fault(fmt::format("{}: {}", directory, std::strerror(errno)), "look after the disk");
  }
  if ((disk.f_flag & ST_RDONLY) != 0) {
    return fault(directory + " is on a read-only file system",
                 "a disk that fails is mounted so: see dmesg; else mount it writable");
  }
  const double free_GiB =
      static_cast<double>(disk.f_bavail) * static_cast<double>(disk.f_frsize) / kGiB;
  CheckedThing found{Health::kGood,
                     "state directory",
                     fmt::format("{}, {:.1f} GiB free", directory, free_GiB),
                     {}};
  if (disk.f_favail == 0 && disk.f_files > 0)
    return fault(directory + ": no inode is free", "delete files there");
  if (free_GiB < kTight_GiB) {
    found.health = free_GiB < kFull_GiB ? Health::kFault : Health::kWarning;
    found.remedy = "make room: probes are refused (code 12) when it is full";
  }
  return found;
}

CheckedThing LookAtJournal(const std::string& persistent) {
  std::error_code unknown;
  if (std::filesystem::is_directory(persistent, unknown)) {
    return {Health::kGood, "system journal", "kept over restarts in " + persistent, {}};
  }
  return {Health::kWarning, "system journal", "forgotten at every restart of the computer",
          fmt::format("mkdir {} && systemctl restart systemd-journald", persistent)};
}

CheckUp LookAtPrograms(const DaemonConfig& config, const std::string& beside) {
  CheckUp found;
  if (!config.overlay.objects_file.empty()) {
    const std::string reader = beside + "/plumbline-mesh";
    if (access(reader.c_str(), X_OK) == 0) {
      found.push_back({Health::kGood, "plumbline-mesh", reader, {}});
    } else {
      found.push_back({Health::kFault, "plumbline-mesh", reader + " is not there",
                       "install the whole package: meshes are read by it"});
    }
  }
  if (config.loop.enabled && config.loop.diagnose) {
    if (InPath("gnuplot")) {
      found.push_back({Health::kGood, "gnuplot", "reports have pictures", {}});
    } else {
      found.push_back({Health::kWarning, "gnuplot", "not installed: reports have tables only",
                       "apt install gnuplot-nox"});
    }
  }
  return found;
}

}  // namespace plumbline
