// Prediction of the loaded tip at each row of a table, with its 95 % radius.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "app/measure/diagnosis/preparation/realign.h"
#include "app/measure/table/csv.h"
#include "firmware-like/deflection/landing_uncertainty.h"
#include "firmware-like/result.h"

namespace plumbline::cli {

/// Predicted tip of the loaded arm at one row's pose.
struct Prediction {
  Vec3 p_WT;                   ///< in the measurement frame [m]
  model::StatedRadius radius;  ///< 95 % radius
  bool extrapolated = false;
  std::vector<deflection::DomainExit> exits{};  ///< why it is, where an input is the reason
  bool tip_elsewhere = false;    ///< the session did not measure this tool's tip, which is unknown
  bool rests_on_growth = false;  ///< the radius, beyond the fitted rows; see LandingUncertainty
  std::string beyond_linear{};   ///< what linear beam theory does not describe; empty if nothing
};

/// Predicts every row with the frames of its session (CellOfSession). Without a payload column the
/// payload is 0; the rows then count as extrapolated if the cell has a [payload] and was not fitted
/// to such rows. An effect whose column is missing (a time, a temperature) adds nothing; the rows
/// then count as extrapolated, and the radius includes what the effect can do.
/// @param deviation  uncertainty of the declared values
/// @param frames     covariances of session frames that were just re-estimated; they widen the
///                   radius
/// @param done       called from time to time with the number of rows predicted; may be empty
/// @return           one prediction per row, or why the cell's tip cannot be predicted
Result<std::vector<Prediction>> Predict(const model::CellModel& cell,
                                        const measure::MeasuredTable& poses,
                                        const model::DeclaredDeviation& deviation,
                                        const measure::FrameCovariances& frames = {},
                                        const std::function<void(std::size_t)>& done = {});

/// True if the deflection depends on a payload that the rows do not contain, unless the cell was
/// fitted to such rows.
bool PayloadNotRecorded(const model::CellModel& cell, const measure::MeasuredTable& poses);

}  // namespace plumbline::cli
