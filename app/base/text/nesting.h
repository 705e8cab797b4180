// Nesting check of TOML and JSON texts, run before they are parsed.
//
// The parsers build a tree and traverse and free it recursively: 100,000 dotted keys or brackets
// would overflow the stack of the reading thread. Pure functions; constant memory, one pass.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace plumbline::text {

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

}  // namespace plumbline::text
