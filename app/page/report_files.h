// The reports and alarm pictures of a state directory, to read.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/page/request_parts.h"
#include "firmware-like/result.h"

namespace plumbline {

struct ReportFile {
  std::string name;  ///< as ReportKindOf() knows it
  ReportKind kind = ReportKind::kNone;
  std::uint64_t bytes = 0;
  double utc_s = 0;  ///< when it was last changed
};

/// The newest first; at most kMostReports of each kind. What cannot be read is left out.
inline constexpr std::size_t kMostReports = 100;
std::vector<ReportFile> ReportsIn(const std::string& state_directory);

/// Opens no link and nothing but a regular file of at most kLargestReport bytes.
/// @param name  from outside  @return  its bytes, or why there are none
inline constexpr std::size_t kLargestReport = 32U << 20U;
Result<std::string> ReadReport(const std::string& state_directory, const std::string& name);

}  // namespace plumbline
