// Writer of the corrected cell: the original text with the result of a diagnosis appended.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "app/measure/diagnosis/result/diagnosis.h"
#include "firmware-like/result.h"

namespace plumbline::measure {

// Splitting of a TOML text into statements, for removing tables without changing the other text.

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

/// Data that a diagnosis was made from, as recorded in the model.
struct DataOrigin {
  std::string file;  ///< file name without folder
  int rows = 0;
  std::string date;  ///< YYYY-MM-DD
};

/// Appends the findings as [[effect]] (in addition to existing ones: their values add up), the
/// estimated frames as [[session]] and the range of the data as [domain], with the fingerprint of
/// the model: if the text is edited afterwards, the basis of its radius becomes "assumed". An
/// existing [domain] or [[session]] is replaced by a new one, including the comments inside it;
/// everything else is preserved byte by byte, except that an inline `effect = [..]` is rewritten as
/// [[effect]]. The text is read back before it is returned, so that it is always a valid cell.
/// @param original  text of a cell that CellFromText accepts
/// @param cell      that cell
/// @return          the text, or the reason why the corrected model is not a valid cell
Result<std::string> CorrectedCellText(std::string_view original, const model::CellModel& cell,
                                      const Diagnosis& diagnosis, const DataOrigin& origin);

}  // namespace plumbline::measure
