// The step of joint readings, found in the readings themselves.
#pragma once

#include <optional>
#include <vector>

#include "app/table/csv.h"

namespace plumbline {

/// A step that every joint reading of a table is a multiple of.
struct JointStep {
  double step_rad = 0;
  bool as_written = false;  ///< it is the last decimal of the file, whatever the controller gives
  double log10_chance = 0;  ///< of agreeing by chance; 0 where `as_written`
  int readings = 0;         ///< distinct ones, zeros apart
};

/// The coarsest usual step (1, 2, 5 times a power of ten in deg or mrad, or a turn over a power of
/// two) that all revolute joints' readings are multiples of, to the last decimal written. A reading
/// of unlimited resolution written in steps p is on a multiple of s by chance in p / s of all
/// cases; over n distinct readings and m steps tried, by chance with a probability of
///   P = m (p / s)^n,
/// and a step is named where P < 1e-6. The step of the last decimal itself needs no such proof.
/// @return  nothing where no step was found, or one beyond 0.2 deg: no controller reads that
///          coarsely, the poses were chosen so; or the decimals are not known
std::optional<JointStep> JointStepOf(const MeasuredTable& table, const std::vector<Joint>& joints);

}  // namespace plumbline
