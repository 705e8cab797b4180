// References that contradict the rest of the data.
#pragma once

#include <functional>
#include <vector>

#include "app/diagnosis/diagnosis.h"
#include "app/diagnosis/identify.h"

namespace plumbline::diagnosis {

/// The references that contradict the identified model, by deletion residuals: with e the whitened
/// residual of a reference's equation and h its leverage in the fit of frames, places and named
/// effects,
///   z = e / sqrt(1 - h),   declared - predicted from all else = sd e / (1 - h)
///   [D. A. Belsley, E. Kuh, R. E. Welsch, Regression Diagnostics, Wiley 1980, section 2.1]
/// A reference contradicts if |z| of one of its equations exceeds the normal quantile for a
/// probability of 0.1 %, shared by all equations. An equation that nothing else determines (1 - h
/// near 0) cannot be tested.
/// @return  the largest |z| first
std::vector<Contradiction> ContradictionsIn(const Identified& found);

/// Adds the contradictions and the check `contradictions` of the whole answer. A model with
/// findings that contradicts a reference is not explained: each finding is doubtful.
void CheckContradictions(const Identified& found, Diagnosis& diagnosis);

/// Diagnoses with `attempt`, and sets references aside that contradict, the largest |z| first, as
/// long as they are at most a quarter of all references. If more contradict, or if a residual
/// remains `unknown` without them, the model may be at fault instead, so that all are kept and named
/// in a note.
Result<Diagnosis> SetAsideContradictions(
    const model::CellModel& cell,
    const std::function<Result<Diagnosis>(const model::CellModel&)>& attempt);

}  // namespace plumbline::diagnosis
