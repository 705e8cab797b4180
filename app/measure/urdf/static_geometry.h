// The part of a corrected cell that is fixed geometry: offsets and dimensions of the links.
#pragma once

#include <string>
#include <vector>

#include "firmware-like/model/cell_model.h"

namespace plumbline::measure {

/// A model's effects, split into those that only change the table by constants, and all others.
struct StaticGeometry {
  model::Robot robot;                 ///< the declared robot with the constants added to its table
  std::vector<std::string> included;  ///< ids of those effects
  std::vector<std::string> left_out;  ///< ids of the others
};

/// An effect is included if its influence is the same at random positions, moves, loads, times and
/// temperatures, and acts on joint deflections, a, d, alpha and beta only. A constant deflection
/// s_i becomes sign_i s_i of theta_offset_i (of d_i for a prismatic joint). An mdh table is
/// returned as such.
StaticGeometry StaticGeometryOf(const model::CellModel& cell);

}  // namespace plumbline::measure
