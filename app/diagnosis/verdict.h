// What an answer says of the rows as a whole: explained, ambiguous, unknown, or nothing there.
#pragma once

#include "app/diagnosis/diagnosis.h"
#include "app/diagnosis/identify.h"

namespace plumbline {

/// Signals that the residual of the identified model still follows, each with its p-value by sign
/// flips of clusters, and its spectrum along each joint's angle.
/// @param all  every row; its values are reported, those that were searched decide
void AddSignals(const Dataset& all, const Identified& found, Diagnosis& diagnosis);

/// The verdict before it is checked (explanation_checks.h), drivers of what is unknown, and whether
/// the declared noise is too small. Needs rivals and signals.
/// @param residual_sigma_m  robust scatter of what remains, one axis
void SetVerdict(const Dataset& data, const Identified& found, double residual_sigma_m,
                Diagnosis& diagnosis);

}  // namespace plumbline
