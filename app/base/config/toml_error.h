// Explanation of a syntax error in a TOML text: what is wrong, where, and what to write.
#pragma once

#include <string>
#include <string_view>

namespace plumbline::config {

/// Place and text of an error.
struct TomlError {
  int line = 0, column = 0;  ///< 1-based; the column in characters
  std::string what;          ///< what is wrong; what to write
};

/// Explains why a text is not TOML. A repair is only suggested if the parser accepts the repaired
/// line; otherwise the parser's words and the line are quoted. Values of tokens and passwords are
/// not repeated. Pure; never fails, also for arbitrary bytes.
/// @param line, column  where the parser stopped
/// @param words         the parser's description
TomlError ExplainTomlError(std::string_view text, int line, int column, std::string_view words);

}  // namespace plumbline::config
