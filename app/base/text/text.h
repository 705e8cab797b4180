// Text for people and from outside: suggestions, nesting limits, decimals, UTC times, visible text.
#pragma once

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace plumbline::text {

// Nesting check of TOML and JSON texts, run before they are parsed.
//
// The parsers build a tree and traverse and free it recursively: 100,000 dotted keys or brackets
// would overflow the stack of the reading thread. Pure functions; constant memory, one pass.

/// Largest allowed depth of tables and lists: the parts of a table header, those of a dotted key
/// and the brackets around a value, added up. Files of this product have at most 6.
inline constexpr int kMaxNestingDepth = 32;

/// The line (1-based) where a TOML text is nested deeper than kMaxNestingDepth, or nullopt.
/// Brackets and dots inside strings and comments do not count. Exact up to the first syntax error,
/// which is where the parser stops.
std::optional<int> LineNestedTooDeepInToml(std::string_view text);

/// The same for a JSON text.
std::optional<int> LineNestedTooDeepInJson(std::string_view text);

/// Error message for such a text, with the remedy.
std::string NestedTooDeepText();

// Number of decimals for printing a value with its standard deviation.

/// Number of decimals that shows each of these deviations with at least two significant digits, so
/// that none is printed as 0.00: 0.0042 needs 4. A deviation of 0 was not estimated and is ignored.
/// @param least  minimum number of decimals
inline int DecimalsFor(std::initializer_list<double> deviations, int least) {
  constexpr int kMost = 9;
  int decimals = least;
  for (const double deviation : deviations) {
    if (!(deviation > 0) || !std::isfinite(deviation)) continue;
    decimals = std::max(decimals, 1 - static_cast<int>(std::floor(std::log10(deviation))));
  }
  return std::min(decimals, kMost);
}

// UTC timestamps as text, ISO 8601.

/// "2026-11-21T07:30:00Z" from seconds since 1970, rounded down to a full second.
std::string TextFromUtc(double utc_s);

/// The same for the current time.
std::string TextOfUtcNow();

/// Seconds since 1970, or nullopt if the text does not have this form.
std::optional<double> UtcFromText(const std::string& text);

// Text from files and devices, made harmless for terminals and logs.

/// The text with every character that a terminal would execute or reorder by written as \u001b:
/// control characters except tab and line feed, DEL, C1 controls, line and paragraph separators,
/// and bidirectional overrides and isolates. Bytes that are not valid UTF-8 become \x9b. Inside a
/// JSON string the meaning does not change. Other text stays as it is.
std::string Visible(std::string_view text);

/// The nearest of `known` by edit distance; a missing or different unit suffix counts as one edit
/// ("sigma" or "sigma_m" for "sigma_mm").
/// @param share  largest edit distance as a share of the word's length; two edits are always
///               allowed
/// @return       empty if no word is near
std::string NearestWord(std::string_view word, const std::vector<std::string>& known, double share);

}  // namespace plumbline::text
