// Re-estimation of a cell's frames for new sessions.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "app/measure/diagnosis/linear/alignment.h"
#include "app/measure/table/csv.h"
#include "firmware-like/result.h"

namespace plumbline::measure {

/// Covariance of the frames by session id, for each tool of the cell.
using FrameCovariances = std::map<std::string, std::vector<FrameCovariance>>;

struct Realignment {
  model::CellModel cell;
  FrameCovariances covariance;  ///< empty if nothing was free
  std::vector<std::string>
      notes;  ///< directions that the rows did not determine, and what was assumed
};

/// Re-estimates from these rows the frames that [measurement] leaves free (instrument pose, tip),
/// with the cell's effects active, and returns the cell with one [[session]] for each session of
/// the rows. Returns the cell unchanged if nothing is free. Directions that the rows do not
/// determine stay as in the cell's last session, or as declared (alignment.h).
/// @return  an error if the rows do not determine the frames
Result<Realignment> Realign(const model::CellModel& cell, const MeasuredTable& measured,
                            int threads);

}  // namespace plumbline::measure
