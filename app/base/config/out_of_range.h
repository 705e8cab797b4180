// Text for a point that lies outside the range that its model was fitted to.
#pragma once

#include <string>

#include "firmware-like/correction/correct.h"

namespace plumbline::config {

/// Names each input of a corrected point that the fitted rows did not cover: "q5 carries -31.2 N m,
/// measured: -2.1 to 88 N m". Empty if all were covered, or if there is no correction.
std::string OutOfRangeText(const model::CellModel& cell, const deflection::LoadedArm& arm,
                           const correction::Correction& correction, const loads::Payload& payload,
                           const effects::Conditions& conditions);

/// Names one input beyond the fitted rows.
/// @param tool, item  of the point: index of the tool, number of the payload item
std::string ExitText(const model::CellModel& cell, const deflection::DomainExit& exit, int tool,
                     int item);

}  // namespace plumbline::config
