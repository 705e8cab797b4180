// Verdict on the first page of the report: what was found, what it rests on, and reservations.
#pragma once

#include <string>

#include "app/measure/diagnosis/diagnosis.h"

namespace plumbline::measure {

/// HTML; of several reservations, the first and the number of the others.
std::string VerdictBanner(const Diagnosis& diagnosis, const model::CellModel& cell);

}  // namespace plumbline::measure
