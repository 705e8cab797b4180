// Verdict on the first page of the report: what was found, what it rests on, and reservations.
#pragma once

#include <string>

#include "app/diagnosis/diagnosis.h"

namespace plumbline::report {

/// HTML; of several reservations, the first and the number of the others.
std::string VerdictBanner(const diagnosis::Diagnosis& diagnosis, const model::CellModel& cell);

}  // namespace plumbline::report
