// Splitting of a TOML text into statements, for removing tables without changing the other text.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace plumbline::measure {

/// A section of a TOML text. The concatenation of all sections is the text.
struct TomlStatement {
  enum class Kind {
    kHeader,    ///< [key] or [[key]], including the rest of the line
    kKeyValue,  ///< key = value, including all lines of the value
    kOther,     ///< a blank line or a comment line
  };
  Kind kind = Kind::kOther;
  std::string first_key;  ///< first part of the dotted key, without quotes
  std::string_view text;  ///< including the newline
};

/// Splits a text that a TOML parser has accepted. Handles all four kinds of strings, and arrays
/// over several lines with comments in them.
std::vector<TomlStatement> TomlStatements(std::string_view text);

/// The text without the tables and root keys of one name and their contents. Comments directly
/// before the next header are kept, since they belong to that header.
std::string WithoutTable(std::string_view text, std::string_view name);

}  // namespace plumbline::measure
