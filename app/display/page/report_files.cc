#include "app/display/page/report_files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "drivers/os/descriptor.h"

namespace plumbline::display {
namespace {

namespace fs = std::filesystem;

/// Folder of a kind of report, below the state directory.
const char* FolderOf(ReportKind kind) {
  return kind == ReportKind::kModel       ? "/models"
         : kind == ReportKind::kDiagnosis ? "/diagnosis"
                                          : "/alarms";
}

/// File name of a report; differs from its name on the page for the newest diagnosis only.
std::string FileOf(ReportKind kind, const std::string& name) {
  return kind == ReportKind::kDiagnosis ? "report.html" : name;
}

void AddReports(const std::string& state_directory, ReportKind kind,
                std::vector<ReportFile>& reports) {
  std::vector<ReportFile> found;
  std::error_code error;
  for (fs::directory_iterator at(state_directory + FolderOf(kind), error), end; !error && at != end;
       at.increment(error)) {
    std::string name = at->path().filename().string();
    if (kind == ReportKind::kDiagnosis) {
      if (name != FileOf(kind, "")) continue;
      name = "diagnosis.html";
    }
    struct stat file {};
    if (ReportKindOf(name) != kind || lstat(at->path().c_str(), &file) != 0) continue;
    if (!S_ISREG(file.st_mode)) continue;
    found.push_back({name, kind, static_cast<std::uint64_t>(file.st_size),
                     static_cast<double>(file.st_mtim.tv_sec)});
  }
  // Names of one kind increase with time.
  std::sort(found.begin(), found.end(),
            [](const ReportFile& a, const ReportFile& b) { return a.name > b.name; });
  found.resize(std::min(found.size(), kMaxReports));
  reports.insert(reports.end(), found.begin(), found.end());
}

}  // namespace

std::vector<ReportFile> ListReports(const std::string& state_directory) {
  std::vector<ReportFile> reports;
  for (const ReportKind kind :
       {ReportKind::kDiagnosis, ReportKind::kModel, ReportKind::kAlarmPicture}) {
    AddReports(state_directory, kind, reports);
  }
  return reports;
}

Result<std::string> ReadReport(const std::string& state_directory, const std::string& name) {
  const ReportKind kind = ReportKindOf(name);
  if (kind == ReportKind::kNone) return Error{"no such report"};
  const std::string path = state_directory + FolderOf(kind) + "/" + FileOf(kind, name);
  const os::Descriptor opened(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  const int fd = opened.get();
  if (!opened) return Error{"no such report"};
  struct stat file {};
  std::string bytes;
  bool whole = false;
  if (fstat(fd, &file) == 0 && S_ISREG(file.st_mode) &&
      file.st_size <= static_cast<off_t>(kMaxReportBytes)) {
    bytes.resize(static_cast<std::size_t>(file.st_size));
    std::size_t got = 0;
    for (ssize_t n = 1; n > 0 && got<bytes.size(); got += n> 0 ? static_cast<std::size_t>(n) : 0) {
      n = read(fd, bytes.data() + got, bytes.size() - got);
    }
    whole = got == bytes.size();
  }
  if (!whole) {
    return Error{
        "the report cannot be read: it is being replaced or too large. Reload the list and try "
        "again"};
  }
  return bytes;
}

}  // namespace plumbline::display
