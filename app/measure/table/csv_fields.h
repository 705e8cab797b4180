// Fields of a line of a CSV file.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace plumbline::measure {

/// Without blanks, tabs and carriage returns at either end.
std::string_view Trimmed(std::string_view text);

/// Removes the text before `separator` from the front of `rest` and returns it; all of it if there
/// is no separator.
std::string_view TakeUntil(char separator, std::string_view& rest);

/// Splits a line at its commas into trimmed fields, which refer to `line`.
void SplitFields(std::string_view line, std::vector<std::string_view>& fields);

/// A field for display in a message: quoted, shortened, without unprintable characters.
std::string Shown(std::string_view field);

/// A column's name for display in a message: likewise, without quotes.
std::string ShownName(std::string_view name);

}  // namespace plumbline::measure
