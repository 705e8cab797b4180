// What a written model states of its rows: the sessions' frames and the range that they cover.
#pragma once

#include "app/diagnosis/diagnosis.h"
#include "app/diagnosis/fit_problem.h"
#include "app/diagnosis/linearisation.h"

namespace plumbline {

/// Sessions' frames where they were estimated, and the range that the rows cover which were not
/// rejected.
void AddFramesAndDomain(const FitProblem& problem, const Model& model, Diagnosis& diagnosis);

}  // namespace plumbline
