// Terminal summary of a diagnosis.
#pragma once

#include <string>

#include "app/measure/diagnosis/diagnosis.h"

namespace plumbline::measure {

/// Verdict, error before and after, parameters, rivals, doubts, poses to measure next, outliers,
/// signals that were not recorded, and notes. Long lists are cut and the number of omitted entries
/// is given, so that the text usually fits 25 lines.
std::string SummaryText(const Diagnosis& diagnosis, const model::CellModel& cell);

}  // namespace plumbline::measure
