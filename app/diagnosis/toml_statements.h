// A TOML text in its statements, so that one can be taken out and the rest stays as it was.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace plumbline {

/// A stretch of a TOML text. All stretches together are the text.
struct TomlStatement {
  enum class Kind {
    kHeader,    ///< [key] or [[key]], with the rest of its line
    kKeyValue,  ///< key = value, all lines of the value
    kOther,     ///< a blank line or a comment that has a line of its own
  };
  Kind kind = Kind::kOther;
  std::string first_key;  ///< of the dotted key, without quotes; `q_deg` of `q_deg = [..]`
  std::string_view text;  ///< with its newline
};

/// Splits a text that a TOML parser has accepted. Knows strings of all four kinds, arrays over
/// several lines, and comments in them.
std::vector<TomlStatement> TomlStatements(std::string_view text);

/// The text without the tables and root keys of one name, with what stands in those tables.
/// Comments before the next header stay: they speak of that one.
std::string WithoutTable(std::string_view text, std::string_view name);

}  // namespace plumbline
