// Validity domain of a corrected model and the frames of its sessions.
#pragma once

#include "app/measure/diagnosis/diagnosis.h"
#include "app/measure/diagnosis/fit_problem.h"
#include "app/measure/diagnosis/linearisation.h"

namespace plumbline::measure {

/// Adds to `diagnosis` the estimated frames of each session, if the cell leaves them free, and the
/// range covered by the rows that were not rejected.
void AddFramesAndDomain(const FitProblem& problem, const Model& model, Diagnosis& diagnosis);

}  // namespace plumbline::measure
