// Errors of the rows by kind of observation.
#pragma once

#include "app/measure/diagnosis/dataset.h"
#include "app/measure/diagnosis/diagnosis.h"

namespace plumbline::measure {

/// RMS errors of each kind of observation over the rows that are not outliers, the kind with the
/// most rows first. Errors of different kinds are not comparable: three axes of a point, one of a
/// plane.
std::vector<KindError> KindErrorsOf(const Dataset& data, const Diagnosis& diagnosis);

/// Sets `rms_by_kind`, and with several kinds, the overall figures to those of the first.
void AddKindErrors(const Dataset& data, Diagnosis& diagnosis);

}  // namespace plumbline::measure
