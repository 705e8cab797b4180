// HTML escaping, number formatting and tables.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace plumbline::measure {

/// The text with invalid UTF-8 bytes replaced by U+FFFD.
std::string ValidUtf8(std::string_view text);

/// Escapes a text for use between tags and in attributes.
std::string Escape(std::string_view text);

/// Formats "5.1e-07" as 5.1 x 10^-7 in HTML; escapes any other text.
std::string NumberHtml(const std::string& number);

/// A list of plain texts; empty without items.
std::string ListHtml(const std::vector<std::string>& items);

/// A table with HTML cells, kept on one page in print if it is short. Columns in `text_columns`
/// (0-based) are left-aligned; all others are right-aligned, their numbers at the decimal point.
class HtmlTable {
 public:
  HtmlTable(std::vector<std::string> headers, std::vector<std::size_t> text_columns);
  /// @param strong  emphasise the row
  void AddRow(const std::vector<std::string>& cells, bool strong = false);
  /// A row with one cell and a text across all other columns.
  void AddNote(const std::string& cell, const std::string& note);
  bool empty() const { return rows_.empty(); }
  std::string Html() const;
  /// A long table with short rows in two or three parts beside each other, repeated down the page;
  /// on a narrow page, all parts are below each other.
  std::string HtmlAcross(std::size_t parts) const;

 private:
  struct Row {
    std::vector<std::string> cells;
    bool strong, note;
  };
  bool IsText(std::size_t column) const;
  std::string PartHtml(std::size_t first, std::size_t end) const;
  std::vector<std::string> AlignedColumn(std::size_t column) const;

  std::vector<std::string> headers_;
  std::vector<std::size_t> text_columns_;
  std::vector<Row> rows_;
};

}  // namespace plumbline::measure
