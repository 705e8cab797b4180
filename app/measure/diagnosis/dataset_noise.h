// Noise of a data set: from the cell, the rows' own uncertainties, replicates, and the resolution
// of the joint readings.
#pragma once

#include "app/measure/diagnosis/dataset.h"

namespace plumbline::measure {

/// Sets sigma_m (one axis) and its origin: the median over the rows if any row states its own (rows
/// that do not have the declared one), otherwise as declared, otherwise from replicates, otherwise
/// 0, so that the residual determines it. Sets the covariances
/// of rows with their own sigma and of orientations, and adds the error of the joint resolution.
/// Rows, conditions, loads and clusters must be set.
void SetNoise(Dataset& data);

}  // namespace plumbline::measure
