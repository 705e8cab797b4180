// Steps of KRL routines: motions, tools, bases and loads, and the control flow between them.
#pragma once

#include <vector>

#include "app/programs/brands/krl_names.h"

namespace plumbline::programs::krl {

/// The rotation Rz(A) Ry(B) Rx(C) and position of X, Y, Z [mm], A, B, C [deg]; nullopt if one of
/// them is missing.
std::optional<Pose> PoseOfNumbers(const PoseNumbers& numbers);

/// A motion statement: where its parts are.
struct MotionStatement {
  MotionKind kind = MotionKind::kJoint;
  bool relative = false;
  bool has_angle = false;  ///< CA: the circle does not end at its end point
  std::vector<std::pair<std::size_t, std::size_t>> targets;  ///< token ranges: [auxiliary,] end
  std::size_t behind_targets = 0;  ///< approximation, WITH and what else follows
  bool passes_by = false;
  std::optional<std::size_t> with;  ///< index of WITH
};
/// nullopt if the statement is no motion.
std::optional<MotionStatement> MotionIn(const Statement& statement);

/// Fills tools, bases, loads and the steps of all routines.
void ReadRoutines(Reading& reading, Names& names, const std::vector<LineIndex>& lines);

}  // namespace plumbline::programs::krl
