// The terminal's summary of a diagnosis.
#pragma once

#include <string>

#include "app/diagnosis/diagnosis.h"

namespace plumbline {

/// What a commissioning engineer reads: verdict, error before and after, parameters, rivals, what
/// to measure next, outliers, what was not recorded. At most 25 lines; what is left out is counted.
std::string SummaryText(const Diagnosis& diagnosis, const CellModel& cell);

}  // namespace plumbline
