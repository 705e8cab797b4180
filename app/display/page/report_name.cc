#include "app/display/page/report_name.h"

#include <algorithm>

namespace plumbline::display {
namespace {

constexpr std::size_t kMaxNameLength = 100;

bool IsDecimalDigit(char c) {
  return c >= '0' && c <= '9';
}

bool IsAsciiLetter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

}  // namespace

ReportKind ReportKindOf(std::string_view name) {
  constexpr std::string_view kPage = ".html", kPicture = ".png", kAlarm = "alarm-";
  if (name == "diagnosis.html") return ReportKind::kDiagnosis;
  if (name.size() > kMaxNameLength) return ReportKind::kNone;
  if (name.ends_with(kPage)) {
    const std::string_view number = name.substr(0, name.size() - kPage.size());
    const bool is_number = number.size() >= 4 && number.size() <= 9 &&
                           std::all_of(number.begin(), number.end(), IsDecimalDigit);
    return is_number ? ReportKind::kModel : ReportKind::kNone;
  }
  if (!name.ends_with(kPicture) || !name.starts_with(kAlarm)) return ReportKind::kNone;
  const std::string_view middle =
      name.substr(kAlarm.size(), name.size() - kPicture.size() - kAlarm.size());
  const bool plain = !middle.empty() && std::all_of(middle.begin(), middle.end(), [](char c) {
    return IsAsciiLetter(c) || IsDecimalDigit(c) || c == '-';
  });
  return plain ? ReportKind::kAlarmPicture : ReportKind::kNone;
}

}  // namespace plumbline::display
