// A cell's frames for a new session.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "app/diagnosis/alignment.h"
#include "app/table/csv.h"
#include "firmware-like/result.h"

namespace plumbline {

/// Covariance of each session's frames: base shift in W [m], base turn in W [rad], tip in F [m].
using FrameCovariances = std::map<std::string, Eigen::Matrix<double, 9, 9>>;

struct Realignment {
  CellModel cell;
  FrameCovariances covariance;     ///< empty where nothing was free
  std::vector<std::string> notes;  ///< what the rows did not determine, and what became of it
};

/// The cell with the frames that its [measurement] leaves free (instrument's pose, tip) estimated
/// anew from these rows, one [[session]] each; its effects act and stay as they are. The cell
/// itself where it leaves nothing free. Directions that the rows do not determine stay as in the
/// cell's last session, or as declared (alignment.h).
/// @return  an error where the rows cannot hold the frames
Result<Realignment> Realigned(const CellModel& cell, const MeasuredTable& measured, int threads);

}  // namespace plumbline
