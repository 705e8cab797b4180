// Names of reports and alarm pictures in requests. Pure function, fuzzed.
#pragma once

#include <string_view>

namespace plumbline::display {

/// Kind of a report below /reports/, which determines its folder.
enum class ReportKind { kNone, kModel, kDiagnosis, kAlarmPicture };

/// Recognises `0007.html` (model version, at least four digits), `diagnosis.html` and
/// `alarm-*.png`. Names contain only letters, digits, '-' and single dots, so that they cannot
/// leave the folder.
ReportKind ReportKindOf(std::string_view name);

}  // namespace plumbline::display
