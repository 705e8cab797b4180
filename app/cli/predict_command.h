// plumbline predict: predicts the position of the loaded tip at each pose of a file.
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

namespace plumbline::cli {

void AddPredictCommand(CLI::App& app, int& exit_code);

/// Predicted tip of the loaded arm at one row's pose.
struct Prediction {
  Vec3 p_WT;                   ///< in the measurement frame [m]
  model::StatedRadius radius;  ///< 95 % radius
  bool extrapolated = false;
};

/// Predicts every row with the frames of its session (CellOfSession). Without a payload column the
/// payload is 0; the rows then count as extrapolated if the cell has a [payload] and was not fitted
/// to such rows.
/// @param deviation  uncertainty of the declared values
/// @param frames     covariances of session frames that were just re-estimated; they widen the
///                   radius
/// @param done       called from time to time with the number of rows predicted; may be empty
/// @return           one prediction per row, or why the cell's tip cannot be predicted
Result<std::vector<Prediction>> Predict(const model::CellModel& cell,
                                        const table::MeasuredTable& poses,
                                        const model::DeclaredDeviation& deviation,
                                        const diagnosis::FrameCovariances& frames = {},
                                        const std::function<void(std::size_t)>& done = {});

}  // namespace plumbline::cli
