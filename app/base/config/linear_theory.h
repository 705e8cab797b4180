// Text on a tool that is loaded beyond linear beam theory.
#pragma once

#include <string>

#include "firmware-like/deflection/loaded_arm.h"

namespace plumbline::config {

/// Says by how much the tip deflection exceeds the range of linear theory (linear_range.h), or that
/// the material yields, and what to do. Empty if neither.
/// @param state  converged state of `arm`, which is that of `cell`
std::string BeyondLinearTheory(const model::CellModel& cell, const deflection::LoadedArm& arm,
                               const deflection::LoadedState& state);

}  // namespace plumbline::config
