// Postures as RAPID's confdata states them.
//
//   cf1, cf4, cf6  quarter turn of axis 1, 4, 6: floor(q / 90 deg), so 0..90 deg is 0, 0..-90 is -1
//   cfx            0..7 = 4 b1 + 2 b2 + b3, of an arm with six axes and a wrist centre:
//                  b1 the wrist centre lies behind axis 1, b2 behind the lower arm, b3 axis 5 < 0
// [ABB, Technical reference manual - RAPID, confdata; tables of the robots in question]. What cfx
// means differs between types of arms: others count the quarter turns of a further axis in it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/programs/program.h"
#include "firmware-like/kinematics/chain.h"

namespace plumbline::programs::rapid {

/// cfx of a posture by the definition above; nullopt for an arm that it does not apply to.
/// @param q  [rad], shape (n)
std::optional<int> CfxOf(const kinematics::Chain& chain, const model::JointVector& q);

/// Whether a posture is the one that cf1, cf4, cf6 and cfx state. A posture whose cfx differs
/// counts if cf1, cf4 and cf6 alone single it out among all postures of the same flange pose: the
/// file then means another definition of cfx.
bool AgreesWithConfdata(const Configuration& stated, const kinematics::Chain& chain,
                        const model::JointVector& q);

/// See Brand::ConfigurationOf.
std::vector<std::string> ConfdataOf(const Configuration& stated, const kinematics::Chain& chain,
                                    const model::JointVector& q);

}  // namespace plumbline::programs::rapid
