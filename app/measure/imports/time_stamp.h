// Parser of the time stamps in exports of instruments and robots.
#pragma once

#include <optional>
#include <string_view>

namespace plumbline::measure {

/// Order of day and month in dates with slashes.
enum class DateOrder { kMonthFirst, kDayFirst };

/// Seconds since 1970, for differences only (no time zone): "08.11.2022 16:17:28.353",
/// "2022-11-08T16:17:28", "11/08/2022 04:17:28 PM" (`slash_order`), each with or without a leading
/// apostrophe. nullopt if it is no such stamp.
std::optional<double> SecondsOfTimeStamp(std::string_view text,
                                         DateOrder slash_order = DateOrder::kMonthFirst);

/// A number of seconds, milliseconds, microseconds or nanoseconds since 1970, for years from 1973
/// to 2286.
struct EpochTime {
  double seconds = 0;
  std::string_view unit{};  ///< "seconds", "milliseconds", ..
};
/// Seconds of these years lie between 1e8 and 1e10, a factor of 100, and each unit is a thousandth
/// of the one before: the size of the number determines the unit. nullopt for any other number.
std::optional<EpochTime> EpochTimeOf(double number);

/// True if the text is a time stamp whose date has slashes, in either order.
bool HasSlashDate(std::string_view text);

}  // namespace plumbline::measure
