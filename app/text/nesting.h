// How deeply a TOML or JSON text nests, found before a parser reads it.
//
// The parsers build a tree and walk or free it by recursion: a header of 100,000 dotted keys, or
// as many brackets, would use up the stack of the thread that reads the file. Pure functions of
// the text; constant memory, one pass.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace plumbline {

/// Levels of tables and lists that a file may have: the parts of a table's header, those of a
/// dotted key and the brackets around a value, together. Files of this product have 6 at most.
inline constexpr int kDeepestNesting = 32;

/// The line (from 1) where a TOML text nests deeper than kDeepestNesting; nothing where it never
/// does. Brackets and dots inside strings and comments do not count. Exact for every text up to
/// its first error, which is where a parser stops.
std::optional<int> LineNestedTooDeepInToml(std::string_view text);

/// The same of a JSON text.
std::optional<int> LineNestedTooDeepInJson(std::string_view text);

/// What is wrong with such a text, and what to do.
std::string NestedTooDeepText();

}  // namespace plumbline
