// Order in which planned postures are visited.
#pragma once

#include <functional>
#include <vector>

#include "firmware-like/model/cell_model.h"

namespace plumbline::measure {

/// Cost of a joint move: the largest displacement of a joint [rad] or [m]; with speeds [rad/s] or
/// [m/s], one per joint, the time of the slowest joint [s]. The acceleration is not considered.
double MoveCost(const model::JointVector& from, const model::JointVector& to,
                const model::JointVector& speeds);

/// A short path through all postures, from any first to any last one: nearest neighbours, then
/// reversals of parts of the path while one makes it shorter (2-opt) [Croes 1958]. The nearest
/// neighbour is chosen among those that can be reached by a move for which `is_free` is true, if
/// there are any; a reversal adds no other move.
/// @param speeds  if empty, displacements count
/// @return        indices into `postures`; deterministic
std::vector<std::size_t> VisitOrder(
    const std::vector<model::JointVector>& postures, const model::JointVector& speeds,
    const std::function<bool(std::size_t from, std::size_t to)>& is_free);

/// Sum of the move costs along a path.
double PathCost(const std::vector<model::JointVector>& postures,
                const std::vector<std::size_t>& order, const model::JointVector& speeds);

}  // namespace plumbline::measure
