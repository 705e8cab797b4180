// Reports and alarm pictures in the state directory, for reading.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/display/page/request_parts.h"
#include "firmware-like/result.h"

namespace plumbline::display {

struct ReportFile {
  std::string name;  ///< as ReportKindOf() accepts it
  ReportKind kind = ReportKind::kNone;
  std::uint64_t bytes = 0;
  double utc_s = 0;  ///< time of the last change
};

/// Lists reports, newest first, at most kMaxReports of each kind. Unreadable files are left out.
inline constexpr std::size_t kMaxReports = 100;
std::vector<ReportFile> ListReports(const std::string& state_directory);

/// Reads a regular file of at most kMaxReportBytes; follows no symbolic link.
/// @param name  untrusted
/// @return      its bytes, or why it cannot be read
inline constexpr std::size_t kMaxReportBytes = 32U << 20U;
Result<std::string> ReadReport(const std::string& state_directory, const std::string& name);

}  // namespace plumbline::display
