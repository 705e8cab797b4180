// Writer of the corrected cell: the original text with the result of a diagnosis appended.
#pragma once

#include <string>
#include <string_view>

#include "app/measure/diagnosis/diagnosis.h"
#include "firmware-like/result.h"

namespace plumbline::measure {

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
