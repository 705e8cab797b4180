// Questions about columns that an import cannot understand by itself.
#pragma once

#include <iosfwd>

#include "app/measure/imports/import_table.h"

namespace plumbline::measure {

/// Asks on `out` for the meaning of each column that is not understood, and for each unit that is
/// not stated, and reads the answers from `in`, one a line: a column of measured.csv, or an empty
/// line to ignore the column. An answer that is not allowed is asked again, at most three times.
/// @return  the mapping with layout and every column of the file, so that the next such file needs
///          no question; nullopt if `in` ends first
std::optional<Mapping> AskMapping(const UnderstoodFile& file, std::istream& in, std::ostream& out);

/// The same without questions: what is understood already; other columns are ignored.
Mapping MappingOf(const UnderstoodFile& file);

}  // namespace plumbline::measure
