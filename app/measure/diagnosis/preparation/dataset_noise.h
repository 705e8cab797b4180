// Noise of a data set: from the cell, the rows' own uncertainties, replicates, and the resolution
// of the joint readings.
#pragma once

#include <optional>
#include <vector>

#include "app/measure/diagnosis/data/dataset.h"
#include "app/measure/table/csv.h"

namespace plumbline::measure {

// Detection of the resolution (step) of joint readings.

/// Step of which every joint reading of a table is a multiple.
struct JointStep {
  double step_rad = 0;
  bool as_written = false;  ///< the last decimal of the file; the controller may be finer
  double log10_chance = 0;  ///< probability of a chance agreement; 0 if `as_written`
  int readings = 0;         ///< number of distinct non-zero readings
};

/// Finds the coarsest usual step (1, 2 or 5 times a power of ten in deg or mrad, or a turn divided
/// by a power of two) of which all readings of revolute joints are multiples, to the last decimal
/// written. A continuous reading written in steps p is a multiple of s with probability p / s; for
/// n distinct readings and m steps tried, the probability of a chance agreement is
///   P = m (p / s)^n.
/// A step is reported if P < 1e-6. The step of the last decimal needs no such evidence.
/// @return  nullopt if no step was found, if it exceeds 0.2 deg (then the poses were commanded at
///          round values, since no controller reads that coarsely), or if the decimals are unknown
std::optional<JointStep> JointStepOf(const MeasuredTable& table,
                                     const std::vector<model::Joint>& joints);

/// Sets sigma_m (one axis) and its origin: the median over the rows if any row states its own (rows
/// that do not have the declared one), otherwise as declared, otherwise from replicates, otherwise
/// 0, so that the residual determines it. Sets the covariances
/// of rows with their own sigma and of orientations, and adds the error of the joint resolution.
/// Rows, conditions, loads and clusters must be set.
void SetNoise(Dataset& data);

}  // namespace plumbline::measure
