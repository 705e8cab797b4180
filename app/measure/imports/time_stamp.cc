#include "app/measure/imports/time_stamp.h"

#include <array>
#include <chrono>
#include <utility>
#include <vector>

namespace plumbline::measure {
namespace {

/// The numbers of a stamp and the characters that follow them.
struct StampParts {
  std::vector<double> numbers;
  std::vector<char> after;
};

std::optional<StampParts> PartsOfStamp(std::string_view text) {
  StampParts parts;
  std::size_t i = 0;
  while (i < text.size() && parts.numbers.size() < 7) {
    double number = 0;
    std::size_t digits = 0;
    for (; i < text.size() && text[i] >= '0' && text[i] <= '9' && digits < 9; ++i, ++digits) {
      number = 10 * number + (text[i] - '0');
    }
    if (digits == 0) return std::nullopt;
    // The seventh number is the fraction of the second.
    if (parts.numbers.size() == 6) {
      for (; digits > 0; --digits) number /= 10;
    }
    parts.numbers.push_back(number);
    parts.after.push_back(i < text.size() ? text[i] : '\0');
    if (i < text.size()) ++i;
    while (i < text.size() && text[i] == ' ') ++i;
    if (i < text.size() && (text[i] == 'A' || text[i] == 'P')) break;
  }
  return parts;
}

}  // namespace

std::optional<double> SecondsOfTimeStamp(std::string_view text, DateOrder slash_order) {
  while (!text.empty() && (text.front() == '\'' || text.front() == ' ')) text.remove_prefix(1);
  const bool afternoon = text.ends_with("PM"), morning = text.ends_with("AM");
  const auto parts = PartsOfStamp(text);
  if (!parts || parts->numbers.size() < 5) return std::nullopt;
  std::vector<double> n = parts->numbers;
  n.resize(7);
  const char date_sign = parts->after[0];
  double year = n[2], month = n[1], day = n[0];
  if (date_sign == '-' && n[0] > 31) year = n[0], day = n[2];
  if (date_sign == '/' && slash_order == DateOrder::kMonthFirst) std::swap(month, day);
  if (date_sign != '.' && date_sign != '-' && date_sign != '/') return std::nullopt;
  if (afternoon && n[3] < 12) n[3] += 12;
  if (morning && n[3] == 12) n[3] = 0;
  const std::chrono::year_month_day date{std::chrono::year(static_cast<int>(year)),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  if (year < 1970 || year > 9999 || !date.ok() || n[3] > 23 || n[4] > 59 || n[5] > 60) {
    return std::nullopt;
  }
  const auto days = static_cast<double>(std::chrono::sys_days(date).time_since_epoch().count());
  return 86400 * days + 3600 * n[3] + 60 * n[4] + n[5] + n[6];
}

bool HasSlashDate(std::string_view text) {
  while (!text.empty() && (text.front() == '\'' || text.front() == ' ')) text.remove_prefix(1);
  return text.substr(0, text.find_first_of(" T")).find('/') != std::string_view::npos &&
         (SecondsOfTimeStamp(text, DateOrder::kMonthFirst) ||
          SecondsOfTimeStamp(text, DateOrder::kDayFirst));
}

std::optional<EpochTime> EpochTimeOf(double number) {
  struct Unit {
    double per_second;
    std::string_view name;
  };
  constexpr std::array kUnits = {Unit{1, "seconds"}, Unit{1e3, "milliseconds"},
                                 Unit{1e6, "microseconds"}, Unit{1e9, "nanoseconds"}};
  constexpr double kFrom_s = 1e8, kTo_s = 1e10;
  for (const Unit& unit : kUnits) {
    const double seconds = number / unit.per_second;
    if (seconds >= kFrom_s && seconds < kTo_s) return EpochTime{seconds, unit.name};
  }
  return std::nullopt;
}

}  // namespace plumbline::measure
