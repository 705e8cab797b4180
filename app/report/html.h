// Text and tables for an HTML page.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace plumbline {

/// The text with bytes that are no UTF-8 replaced by U+FFFD.
std::string ValidUtf8(std::string_view text);

/// A text as it may stand between tags and in attributes.
std::string Escape(std::string_view text);

/// "5.1e-07" as 5.1 x 10^-7, set as mathematics; other texts escaped.
std::string NumberHtml(const std::string& number);

/// A table whose cells are HTML already. Columns named in `text_columns` (0-based) are set left,
/// all others right, as numbers.
class HtmlTable {
 public:
  HtmlTable(std::vector<std::string> headers, std::vector<std::size_t> text_columns);
  /// @param strong  a row that stands out
  void AddRow(const std::vector<std::string>& cells, bool strong = false);
  bool empty() const { return rows_.empty(); }
  std::string Html() const;

 private:
  std::string Class(std::size_t column) const;

  std::vector<std::string> headers_;
  std::vector<std::size_t> text_columns_;
  std::string rows_;
};

}  // namespace plumbline
