// Functions of the URScript language, by what they do to the robot.
#pragma once

#include <array>
#include <string_view>

#include "app/programs/program.h"

namespace plumbline::programs::urscript {

enum class FunctionKind {
  kMotion,
  kSetting,   ///< of the tool or the load
  kShift,     ///< begins or ends a displacement of all targets
  kHarmless,  ///< moves nothing
  kMoves,     ///< moves the robot to where the file does not say
  kOther,     ///< none of the language: a routine that was not given
};

FunctionKind KindOf(std::string_view function);

struct MotionFunction {
  std::string_view name;
  MotionKind kind;
  std::array<std::string_view, 2> targets;  ///< argument names; a circle has the auxiliary first
  std::size_t blend;                        ///< position of `r`; 0: none
  std::string_view special;                 ///< why it does not end at its target
};
/// The motion of a name; nullptr: none.
const MotionFunction* FindMotion(std::string_view function);

struct ShiftFunctions {
  std::string_view begins, ends, what;
};
/// The displacement that a function begins or ends; nullptr: none.
const ShiftFunctions* FindShift(std::string_view function);

}  // namespace plumbline::programs::urscript
