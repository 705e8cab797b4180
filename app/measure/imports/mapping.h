// Mapping file: how the columns of one kind of file are to be read.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/base/config/fault.h"
#include "app/base/text/delimited_text.h"
#include "app/measure/imports/column_meaning.h"

namespace plumbline::measure {

/// One entry: a column of the file by name, or by number where it has no name or shares it.
struct MappedColumn {
  std::string from;  ///< empty: by number
  int number = 0;    ///< from 1
  std::string to;    ///< column of measured.csv or auxiliary one; empty: ignored
  std::string unit;  ///< empty: as the file states it
};

/// Decisions that a person made once for a kind of file. They outrank what the file's names say.
struct Mapping {
  text::LayoutHints layout;
  std::vector<MappedColumn> columns;
};

/// Parses a mapping file:
///   schema = 1
///   separator = "semicolon"   # comma, semicolon, tab, blanks; absent: found from the text
///   decimal = "comma"         # comma, point
///   header_line = 3           # line of the column names; 0: none
///   [[column]]
///   from = "MX Coord."        # or number = 4, from 1; needed where two columns share a name
///   to = "x_mm"               # "ignore" leaves the column out
///   unit = "mm"
/// Pure. @return nullopt if there is a fault
std::optional<Mapping> MappingFromText(std::string_view text, const std::string& file,
                                       config::FaultList& faults);

/// The text of a mapping file.
std::string TextOfMapping(const Mapping& mapping);

/// Meanings of the columns of a file after the mapping. An entry whose column the file lacks, or
/// whose name several columns share, is a fault.
std::vector<ColumnMeaning> MeaningsWith(const Mapping& mapping, const text::DelimitedText& layout,
                                        const std::string& mapping_file, config::FaultList& faults);

}  // namespace plumbline::measure
