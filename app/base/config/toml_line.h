// One line of a TOML text with a syntax error, and the repair that makes it TOML.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace plumbline::config {

/// Without spaces, tabs and carriage returns at both ends.
std::string_view Trimmed(std::string_view text);

/// Offset of the comment: the first # outside quotes; the size of the line if there is none. If a
/// closing quote is missing, the first # after a space.
std::size_t CommentAt(std::string_view line);

/// The parts of `key = value  # comment`; their sequence is the line.
struct TomlLine {
  std::string head;   ///< up to the value; without "=" only the indentation
  std::string value;  ///< without spaces at its ends
  std::string rest;   ///< spaces and comment

  explicit TomlLine(std::string_view line);
  bool assigns() const { return head.find('=') != std::string::npos; }
  std::string With(std::string_view changed) const { return head + std::string(changed) + rest; }
};

/// A repaired line, and what was wrong.
struct TomlRepair {
  std::string line, what;
};

/// The likeliest repair after which the line is TOML: of one mistake, or of two. Pure.
std::optional<TomlRepair> RepairOf(std::string_view line);

}  // namespace plumbline::config
