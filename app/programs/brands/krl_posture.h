// Postures of KRL: status S and turn T.
#pragma once

#include <cstdint>
#include <optional>

#include "firmware-like/kinematics/chain.h"

namespace plumbline::programs::krl {

/// Status and turn of a six-axis arm whose joints are counted as the controller does, with B =
/// $ROBROOT [KUKA's definition as in Beckhoff TF5200 "Status & Turn", the same text as ISG's; for
/// bit 0 the expert programming manual, quoted in robot-forum thread 7173]:
///   S bit 0  x < 0 of the wrist centre in the frame that turns with axis 1 and equals B at A1 = 0
///   S bit 1  the wrist centre is in front of the line through axes 2 and 3, seen along axis 2
///   S bit 2  A5 < 0 (or above 180)
///   T bit i  axis i + 1 is negative
struct Posture {
  std::int64_t status = 0, turn = 0;
  /// Bits whose criterion is so near to its limit that rounding decides.
  std::int64_t open_status = 0, open_turn = 0;
};
/// nullopt for an arm that has not six revolute axes.
std::optional<Posture> PostureOf(const kinematics::Chain& chain, const model::JointVector& q);

}  // namespace plumbline::programs::krl
