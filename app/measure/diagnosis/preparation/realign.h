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

/// Variance per axis of the tip of a tool in a session that did not measure it [m^2]: the scatter
/// of the tips that were measured in several sessions (0 if none was), since a reflector may be
/// seated anew; or (50 mm)^2 if no session measured the tool, as FramePrior has it.
double TipVarianceElsewhere(const model::CellModel& cell, int tool);

/// Whether a session states the tip of a tool, or it need not, because tips are known.
bool StatesTip(const model::CellModel& cell, const model::SessionFrames& session, int tool);

struct Realignment {
  model::CellModel cell;
  FrameCovariances covariance;  ///< empty if nothing was free
  std::vector<std::string>
      notes;  ///< directions that the rows did not determine, and what was assumed
};

/// Re-estimates from these rows the frames that [measurement] leaves free (instrument pose, tip),
/// with the cell's effects active, and returns the cell with one [[session]] for each session of
/// the rows. Returns the cell unchanged if nothing is free. Directions and tools that the rows do
/// not determine stay as in the cell's sessions, or as declared (alignment.h).
/// @return  an error if the rows do not determine the frames
Result<Realignment> Realign(const model::CellModel& cell, const MeasuredTable& measured,
                            int threads);

}  // namespace plumbline::measure
