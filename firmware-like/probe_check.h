// Plausibility check of a probe against the arm's reach and the model's prediction.
#pragma once

#include <cstdint>

#include "firmware-like/correction/correct.h"

namespace plumbline {

/// Reason for refusing a probe. The numbers are those of the register map.
enum class ProbeFault : std::uint8_t {
  kNone = 0,
  kZero = 1,         ///< 0, 0, 0: the registers were not filled
  kInMetres = 2,     ///< multiplied by 1000, it would be near the predicted tip
  kBeyondReach = 3,  ///< farther from the base than the total length of arm and tool
  kRobotMoving = 4,  ///< the joints at the time of the measurement are unknown
};

struct ProbeBounds {
  double reach_m = 0;          ///< largest distance of the tip from the base origin
  double contradiction_m = 0;  ///< largest plausible distance from the predicted tip
};

/// Bounds for the probes of a cell.
///
/// Reach: the stretched-out length of links and tool plus 10 %, because the declared base position
/// may be wrong and the measured point need not be the declared tip.
///
/// Contradiction: the sum of
///   - the largest correction that the cell allows ([correction] max_translation_mm); with a larger
///     model error, every corrected point would be refused, and
///   - kUndeclaredTurn_rad times the reach: half a degree, typical of a joint that lost its zero
///     when its motor was replaced, and several times the wind-up of an arm that declares no
///     compliance (1 to 3 mrad at rated load).
/// The sum of the plausible ranges of all effects in the catalogue would amount to metres: each
/// range is wide enough for its effect to act alone, and the effects never all reach their limits
/// at once.
ProbeBounds ProbeBoundsOf(const deflection::LoadedArm& arm,
                          const correction::CorrectionLimits& limits);

inline constexpr double kUndeclaredTurn_rad = 0.01;

/// True if the probe contradicts the model by more than any plausible effect. Positions in W [m].
bool Contradicts(const ProbeBounds& bounds, const Vec3& measured_W, const Vec3& predicted_W);

/// Checks whether the tip can have been measured at this position at all. The unit is assumed to be
/// metres if the probe contradicts the model and 1000 times its position lies within a tenth of the
/// reach from the predicted tip. Positions in W [m].
ProbeFault CheckProbe(const deflection::LoadedArm& arm, const ProbeBounds& bounds,
                      const Vec3& measured_W, const Vec3& predicted_W);

/// True if the position of a pose command is empty, or was given in metres instead of millimetres:
/// it lies within a thousandth of the reach from the base origin. If the first joint is revolute,
/// the tip cannot be there, because that position is inside the arm's own base. If the first joint
/// is prismatic (gantry, track), the origin may be reachable, and the result is always false.
/// @param p_B  position in the base frame [m]
bool IsZeroOrInMetres(const model::Robot& robot, const ProbeBounds& bounds, const Vec3& p_B);

}  // namespace plumbline
