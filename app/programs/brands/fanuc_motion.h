// Motion statements of FANUC TP programs.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/programs/brands/fanuc_positions.h"
#include "app/programs/program.h"

namespace plumbline::programs::fanuc {

/// The letter of a motion, `[JLCAS] P[` or `PR[`; nullopt for another statement.
std::optional<char> MotionLetter(std::string_view statement);

/// Name of the program in what follows CALL.
std::string_view CalledName(std::string_view text);

struct MotionStatement {
  Motion motion;                          ///< without `statement`
  std::vector<std::string> calls;         ///< TB .., CALL X: programs that run near its end
  std::optional<std::string> skipped_to;  ///< Skip,LBL[n]: n
  bool may_be_any_point = false;          ///< P[R[1]]
};

/// A motion with its options, all its lines joined.
MotionStatement ReadMotion(char letter, std::string_view text, const PointNumbers& points);

}  // namespace plumbline::programs::fanuc
