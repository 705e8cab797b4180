// Table headers of a TOML text, also those that are commented out.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace plumbline::config {

/// A line that consists of a table header, perhaps behind `#` in the first column, and a comment.
struct HeaderLine {
  int line = 0;             ///< 1-based
  bool commented = false;   ///< "# [page]"
  std::string header;       ///< "[page]", "[[point]]"
  std::size_t begin = 0;    ///< offset of the line in the text
  std::size_t bracket = 0;  ///< offset of the header
};

/// The headers of a text in order. Lines inside multi-line strings and arrays are not excluded.
/// Pure; never fails.
std::vector<HeaderLine> HeaderLines(std::string_view text);

/// The text in which a commented-out header is one, all other offsets unchanged.
std::string WithHeader(std::string_view text, const HeaderLine& header);

}  // namespace plumbline::config
