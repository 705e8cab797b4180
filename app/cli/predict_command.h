// plumbline predict: where the loaded tip is at each pose of a file.
#pragma once

#include <cstddef>
#include <functional>
#include <ostream>
#include <vector>

#include "app/diagnosis/realign.h"
#include "app/table/csv.h"
#include "firmware-like/deflection/landing_uncertainty.h"
#include "firmware-like/result.h"

namespace CLI {
class App;
}

namespace plumbline {

void AddPredictCommand(CLI::App& app, int& exit_code);

/// Where the tip of the loaded arm is at one row's pose.
struct Prediction {
  Vec3 p_WT;            ///< [m]
  StatedRadius radius;  ///< holds 95 %
  bool extrapolated = false;
};

/// Predicts every row with the frames of its session (CellOfSession). Rows without a payload
/// column carry nothing, and are extrapolated where the cell has a [payload] and was not fitted to
/// such rows.
/// @param deviation  of what the cell declares
/// @param frames     of sessions that were just aligned: widens the radius by what the rows leave
///                   open of them
/// @param done       called with the number of rows predicted so far, now and then; may be empty
/// @return           one prediction a row, or why the cell cannot be predicted
Result<std::vector<Prediction>> Predict(const CellModel& cell, const MeasuredTable& poses,
                                        const DeclaredDeviation& deviation,
                                        const FrameCovariances& frames = {},
                                        const std::function<void(std::size_t)>& done = {});

}  // namespace plumbline
