// The tool that was mounted when a point was taught.
#pragma once

#include "firmware-like/correction/assembly_point.h"
#include "firmware-like/deflection/loaded_arm.h"

namespace plumbline::correction {

/// Index of the tool whose unloaded point at the taught joints `near_q` is nearest to the target:
/// deflections are millimetres, tools differ by more. Ties: the first.
/// @return  0 if the arm has one tool; nullopt if it has several and the point has no `near_q`
std::optional<int> TaughtTool(const deflection::LoadedArm& arm, const AssemblyPoint& point);

}  // namespace plumbline::correction
