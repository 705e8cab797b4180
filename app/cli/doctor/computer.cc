#include "app/cli/doctor/computer.h"

#include <fmt/format.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>

#include "app/base/service/utc_clock.h"
#include "app/base/text/utc_text.h"
#include "app/cell/journal/journal.h"

namespace plumbline::cli {
namespace {

constexpr double kGiB = 1024.0 * 1024.0 * 1024.0;
constexpr double kLow_GiB = 1.0, kFull_GiB = 0.1;
constexpr double kEarliest_s = 1735689600;  ///< 2025-01-01; an earlier time was never set

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

CheckResult CheckClock() {
  const double now_s = service::SystemUtcSeconds();
  const std::string when = text::TextFromUtc(now_s);
  if (now_s < kEarliest_s) {
    return {Health::kFault, "clock", when + ": the clock was never set",
            "set it and enable time synchronisation: systemctl enable --now systemd-timesyncd"};
  }
  timex state{};
  if (adjtimex(&state) == TIME_ERROR || (state.status & STA_UNSYNC) != 0) {
    return {Health::kWarning, "clock", when + ", not synchronised",
            "effects of time need a correct clock: systemctl enable --now systemd-timesyncd (or "
            "chrony)"};
  }
  return {Health::kGood, "clock", when + ", synchronised", {}};
}

CheckResults CheckJournal(const std::string& state_directory) {
  const std::string file = state_directory + "/journal.sqlite";
  std::error_code unknown;
  if (!std::filesystem::exists(file, unknown)) return {};
  constexpr const char* kSubject = "journal";
  Result<cell::Journal> journal = cell::Journal::OpenForReading(file);
  if (!journal) {
    return {{Health::kFault, kSubject, journal.error(),
             "run `plumbline journal check` to see what is damaged"}};
  }
  const cell::IntegrityReport report = journal.value().Check();
  if (!report.intact()) {
    return {{Health::kFault, kSubject, fmt::format("{}: {}", file, DamageText(report)),
             "plumbline journal salvage, which saves the intact rows; or restore the backup"}};
  }
  return {{Health::kGood, kSubject, fmt::format("{} rows intact", report.rows), ""}};
}

CheckResult CheckStateDirectory(const std::string& directory, const Account& account) {
  const auto fault = [](const std::string& finding, const std::string& remedy) {
    return CheckResult{Health::kFault, "state directory", finding, remedy};
  };
  std::error_code unknown;
  if (!std::filesystem::is_directory(directory, unknown)) {
    return fault(directory + " does not exist",
                 "the service creates it at its first start; without the service, create it with "
                 "mkdir or set another state_directory");
  }
  if (const std::string why = AccessProblem(account, directory, true); !why.empty()) {
    return fault(why, fmt::format("chown -R {} {}", account.name,
                                  std::filesystem::absolute(directory).string()));
  }
  struct statvfs disk {};
  if (statvfs(directory.c_str(), &disk) != 0) {
    return fault(fmt::format("{}: {}", directory, std::strerror(errno)), "check the disk");
  }
  if ((disk.f_flag & ST_RDONLY) != 0) {
    return fault(directory + " is on a read-only file system",
                 "the kernel remounts a failing disk read-only: check dmesg; otherwise mount it "
                 "writable");
  }
  const double free_GiB =
      static_cast<double>(disk.f_bavail) * static_cast<double>(disk.f_frsize) / kGiB;
  CheckResult found{Health::kGood,
                    "state directory",
                    fmt::format("{}, {:.1f} GiB free", directory, free_GiB),
                    {}};
  if (disk.f_favail == 0 && disk.f_files > 0)
    return fault(directory + ": the file system has no free inode", "delete files on it");
  if (free_GiB < kLow_GiB) {
    found.health = free_GiB < kFull_GiB ? Health::kFault : Health::kWarning;
    found.remedy = "free some space: probes are refused (code 19) when the disk is full";
  }
  return found;
}

CheckResult CheckSystemJournal(const std::string& persistent) {
  std::error_code unknown;
  if (std::filesystem::is_directory(persistent, unknown)) {
    return {Health::kGood, "system journal", "persistent, in " + persistent, {}};
  }
  return {Health::kWarning, "system journal",
          "not persistent: lost at every restart of the computer",
          fmt::format("mkdir {} && systemctl restart systemd-journald", persistent)};
}

CheckResults CheckPrograms(const config::DaemonConfig& config,
                           const std::string& program_directory) {
  CheckResults found;
  if (!config.overlay.objects_file.empty()) {
    const std::string reader = program_directory + "/plumbline-mesh";
    if (access(reader.c_str(), X_OK) == 0) {
      found.push_back({Health::kGood, "plumbline-mesh", reader, {}});
    } else {
      found.push_back({Health::kFault, "plumbline-mesh", reader + " is missing",
                       "reinstall the package: mesh files are read by this program"});
    }
  }
  if (config.monitoring.enabled && config.monitoring.diagnose) {
    if (InPath("gnuplot")) {
      found.push_back({Health::kGood, "gnuplot", "installed: reports have plots", {}});
    } else {
      found.push_back({Health::kWarning, "gnuplot",
                       "not installed: reports have tables but no plots",
                       "apt install gnuplot-nox"});
    }
  }
  return found;
}

}  // namespace plumbline::cli
