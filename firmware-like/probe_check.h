// Plausibility of a probe: can the tip have been measured there, and can the model be that wrong?
#pragma once

#include <cstdint>

#include "firmware-like/correction/correct.h"

namespace plumbline {

/// Why a probe is refused. The numbers are those of the register map.
enum class ProbeFault : std::uint8_t {
  kNone = 0,
  kZero = 1,         ///< 0, 0, 0: the registers were not filled
  kInMetres = 2,     ///< a thousand times as large it would be where the model has the tip
  kBeyondReach = 3,  ///< farther from the base than the arm with its tool is long
  kRobotMoving = 4,  ///< the joints of that moment are not known
};

struct ProbeBounds {
  double reach_m = 0;          ///< of the tip, from the base's origin
  double contradiction_m = 0;  ///< largest plausible distance from where the model has the tip
};

/// Reach: the arm's links and the tool stretched out, and a tenth more: the base's declared place
/// may be off, and the measured point need not be the declared tip.
///
/// Contradiction: the sum of
///   - the largest correction that the cell allows ([correction] max_translation_mm): a model that
///     was wrong by more would have every corrected point refused, and
///   - kUndeclaredTurn_rad over the reach: half a degree, as a joint has whose zero was lost with
///     its motor, and several times the wind-up of an arm that does not declare its compliances
///     (1 to 3 mrad at rated load).
/// The sum of the plausible ranges of all effects in the catalogue would be metres: they are wide
/// so that none is excluded when it acts alone, and never act all at once at their ends.
ProbeBounds ProbeBoundsOf(const LoadedArm& arm, const CorrectionLimits& limits);

inline constexpr double kUndeclaredTurn_rad = 0.01;

/// Whether the probe contradicts the model by more than any plausible effect.
bool Contradicts(const ProbeBounds& bounds, const Vec3& measured_W, const Vec3& predicted_W);

/// Whether a tip can have been measured there at all. Taken for metres where the probe contradicts
/// the model and, a thousand times as large, lies within a tenth of the reach of the predicted tip.
ProbeFault JudgeProbe(const LoadedArm& arm, const ProbeBounds& bounds, const Vec3& measured_W,
                      const Vec3& predicted_W);

/// Whether the position of a pose command was not filled in, or was given in metres where
/// millimetres are expected: it lies within a thousandth of the reach from the base's origin. No
/// tip can be there where the first joint turns: that is inside the arm's own base. Where the first
/// joint slides (a gantry, a track) the origin may be free, and nothing is refused.
/// @param p_B  in the base frame [m]
bool IsZeroOrInMetres(const Robot& robot, const ProbeBounds& bounds, const Vec3& p_B);

}  // namespace plumbline
