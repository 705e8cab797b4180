// Instructions of RAPID and its options that move the robot, and those that do not.
#pragma once

#include <array>
#include <string_view>

#include "app/programs/program.h"

namespace plumbline::programs::rapid {

/// An instruction that moves the robot to a robtarget or jointtarget.
struct MotionInstruction {
  std::string_view name;  ///< lower case
  MotionKind kind;
  int target = 0;  ///< which required argument is the target (of a circle: the auxiliary point)
  int tool = 3;    ///< which one is the tool, unless one is declared as tooldata; -1: the last
  std::string_view special = "";  ///< as Motion::special
  bool calls_procedure = false;   ///< at its end: that of its last required argument
};

/// @param name  lower case; null if it is not known to move the robot to a target
const MotionInstruction* FindMotion(std::string_view name);

/// A pair of instructions between which the robot does not go where its targets say.
struct Shift {
  std::string_view begins, ends;  ///< lower case
  std::string_view what;
};
inline constexpr std::array kShifts = {
    Shift{"pdispon", "pdispoff", "displaces all targets"},
    Shift{"pdispset", "pdispoff", "displaces all targets"},
    Shift{"eoffson", "eoffsoff", "displaces all targets"},
    Shift{"eoffsset", "eoffsoff", "displaces all targets"},
    Shift{"softact", "softdeact", "makes an axis softer than the model (soft servo)"},
};
/// @param side  &Shift::begins or &Shift::ends; null if the instruction is no such side
const Shift* FindShift(std::string_view name, std::string_view Shift::*side);

/// True for an instruction of the language after which the robot is where it was.
/// @param name  lower case
bool StaysInPlace(std::string_view name);

/// True for an instruction that stores what it finds in its tool, work object or load.
bool ChangesArguments(std::string_view name);

}  // namespace plumbline::programs::rapid
