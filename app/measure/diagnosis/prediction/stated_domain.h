// The frames of a written model, the domain that it was validated in, and the errors stated there.
#pragma once

#include "app/measure/diagnosis/search/identify.h"
#include "app/measure/diagnosis/validation/diagnosis_stages.h"

namespace plumbline::measure {

/// Adds the frames and the domain in which the written model was validated.
void AddDomain(const Task& task, const Identified& found, const FittedModel& declared,
               const FitOfAllRows& fit, const CorrectedModel& corrected, Diagnosis& diagnosis);

}  // namespace plumbline::measure
