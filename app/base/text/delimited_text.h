// Layout of a delimited text file: separator, decimal sign, header, records.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace plumbline::text {

/// Properties of a layout that a user may state; the others are determined from the text.
struct LayoutHints {
  std::optional<char> separator;   ///< ',' ';' '\t', or ' ' for runs of blanks
  std::optional<char> decimal;     ///< '.' or ','
  std::optional<int> header_line;  ///< line of the column names, from 1; 0 for none
};

/// One line of data, split into trimmed fields without quotes. A quoted field ends with its line.
struct Record {
  int line = 0;  ///< from 1
  std::vector<std::string> fields;
};

struct DelimitedText {
  char separator = ',';
  char decimal = '.';
  /// True if nothing in the text decides the decimal sign: every comma that could be one is
  /// followed by three digits.
  bool decimal_assumed = false;
  int header_line = 0;                ///< 0 if the file has no column names
  std::vector<std::string> names;     ///< of the columns; empty names where there is no header
  std::vector<std::string> units;     ///< of a line of units below the names; else empty
  std::vector<std::string> preamble;  ///< lines before the names, or before the data
  std::vector<Record> records;        ///< every later line that is not empty, in order
};

/// Splits a text. The separator is the one that gives most lines the same number of fields and most
/// fields a number; the decimal sign follows from all fields, not from the separator. Quoted fields
/// may contain the separator, unless it is blanks, and doubled quotes, but no line break. Pure;
/// every input gives a layout, if need be with one column.
DelimitedText LayoutOf(std::string_view text, const LayoutHints& hints);

/// A number with the given decimal sign. Accepted: a sign, an exponent, groups of three digits
/// separated by the other sign, the first of which does not start with a zero, and a leading
/// apostrophe.
std::optional<double> NumberIn(std::string_view field, char decimal);

}  // namespace plumbline::text
