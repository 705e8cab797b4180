// Verdict of a diagnosis: explained, ambiguous, unknown or no effect.
#pragma once

#include "app/measure/diagnosis/diagnosis.h"
#include "app/measure/diagnosis/diagnosis_stages.h"
#include "app/measure/diagnosis/identify.h"

namespace plumbline::measure {

/// Adds all recorded signals, each with the p-value that the residual of the identified model
/// follows it (by sign flips of clusters), and the spectrum of the residual along each joint angle.
/// @param all  every row; supplies the reported values. The p-values are of the searched rows only.
void AddSignals(const Dataset& all, const Identified& found, Diagnosis& diagnosis);

/// Number of parameters fitted to the rows: of the named effects, free frames and positions of
/// artefacts, minus what is known about the positions.
double ParametersOf(const Identified& found, const Dataset& data);

/// Sets the verdict before the checks of the explanation (explanation_checks.h), the driver signals
/// of an unknown cause, and whether the declared noise is too small; adds the check `lack_of_fit`.
/// Requires `rivals` and `signals`.
void SetVerdict(const Identified& found, const FitOfAllRows& fit, Diagnosis& diagnosis);

}  // namespace plumbline::measure
