// The model that a diagnosis writes: validated by held-out rows, with a discrepancy model where it
// helps, or withheld.
#pragma once

#include "app/measure/diagnosis/diagnosis_stages.h"
#include "app/measure/diagnosis/identify.h"

namespace plumbline::measure {

/// Validates the model by held-out rows and decides which parts of it are written.
Result<CorrectedModel> Validated(const Task& task, const Identified& found, const FitOfAllRows& fit,
                                 Diagnosis& diagnosis);

/// Removes the correction if it must not be written.
void Withhold(const FittedModel& declared, CorrectedModel& corrected, Diagnosis& diagnosis);

}  // namespace plumbline::measure
