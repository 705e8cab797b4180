// The corrected cell: the declared one, its text untouched, with what the diagnosis adds.
#pragma once

#include <string>
#include <string_view>

#include "app/diagnosis/diagnosis.h"
#include "firmware-like/result.h"

namespace plumbline {

/// Where a diagnosis took its numbers from.
struct DataOrigin {
  std::string file;  ///< as named in the model, without its folder
  int rows = 0;
  std::string date;  ///< YYYY-MM-DD
};

/// Appends the findings as [[effect]] (those that stand there stay: values add up), the estimated
/// frames as [[session]] and the range of the data as [domain], with the model's fingerprint: an
/// edit of the text afterwards makes its radius an assumed one. A [domain] or [[session]] in the
/// original, wherever it stands, gives way to a new one, with the comments inside it; all else of
/// the original stays, byte by byte, save an inline `effect = [..]`, which is written as
/// [[effect]]. The text is read back before it is given: what is returned is a valid cell.
/// @param original  text of a cell that CellFromText accepts
/// @param cell      that cell
/// @return          the text, or why the corrected model is no valid cell
Result<std::string> CorrectedCellText(std::string_view original, const CellModel& cell,
                                      const Diagnosis& diagnosis, const DataOrigin& origin);

}  // namespace plumbline
