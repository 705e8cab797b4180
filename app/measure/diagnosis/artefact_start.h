// Initial positions of artefacts, from the predicted TCP at their rows.
#pragma once

#include <optional>

#include "app/measure/diagnosis/linearisation.h"

namespace plumbline::measure {

/// Sets the constants that the cell does not declare, for every artefact that rows use:
///   point   the mean of the predicted TCPs, or by trilateration if only ranges were measured
///   sphere  |p|^2 = 2 c . p + (r^2 - |c|^2), linear in the unknowns
///   plane   the plane of least squares through them
///   gauge   the gradient of the readings
/// and the orientation of an unknown tool from the first measured pose of its session. Too few rows
/// leave what they do not determine at a placeholder.
/// @return  an error if a deflected posture does not converge
Result<void> StartPlaces(const Dataset& data, int threads, Model& model);

}  // namespace plumbline::measure
