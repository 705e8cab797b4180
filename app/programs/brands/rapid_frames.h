// Values of tooldata, wobjdata and loaddata.
//
//   tooldata [robhold, tframe, tload], wobjdata [robhold, ufprog, ufmec, uframe, oframe]
//   loaddata [mass, cog, axes of moment, ix, iy, iz], pose [[x, y, z], [q1, q2, q3, q4]]
// mm, kg; quaternions with the scalar first. The centre of gravity of a tool is given in the flange
// frame, that of a gripped part in the tool frame [ABB, RAPID Reference Manual, loaddata].
#pragma once

#include <optional>

#include "app/programs/brands/rapid_declarations.h"
#include "app/programs/program.h"

namespace plumbline::programs::rapid {

struct FrameOf {
  FrameValue value;         ///< `changes` says what is wrong with it
  bool stationary = false;  ///< a tool that is fixed in the cell, a work object held by the robot
};

std::optional<Pose> PoseOf(const Value& value);
std::optional<LoadValue> LoadOf(const Value& value);
FrameOf ToolOf(const Value& value);
FrameOf WorkObjectOf(const Value& value);

}  // namespace plumbline::programs::rapid
