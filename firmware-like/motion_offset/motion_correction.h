// The offset that the model demands for a posture of the running motion, or why there is none.
#pragma once

#include <cstdint>
#include <optional>

#include "firmware-like/correction/correct.h"
#include "firmware-like/motion_offset/motion_offset.h"

namespace plumbline::motion_offset {

/// Frame in which the controller expects the offset.
enum class OffsetFrame : std::uint8_t { kBase, kTool };

/// What is demanded of a correction, and how it is expressed.
struct CorrectionRules {
  OffsetFrame frame = OffsetFrame::kBase;
  Mat3 R_frame = Mat3::Identity();  ///< axes of the controller's frame in B or T
  bool rotates = false;             ///< the orientation is corrected, too
  double widest_radius_m = 0.001;
  model::RadiusBasis weakest_basis = model::RadiusBasis::kMeasured;

  bool operator==(const CorrectionRules&) const = default;
};

/// The PLC's permission. Once its heartbeat was lost, a bit that is still set permits nothing: a
/// PLC that starts again may only beat. It must be cleared and set again.
class MotionSwitch {
 public:
  /// Once per cycle. @return  motions may be corrected
  bool Update(bool requested, bool plc_alive) {
    if (was_alive_ && !plc_alive) armed_ = false;
    if (!requested) armed_ = true;
    was_alive_ = plc_alive;
    return armed_ && requested;
  }

 private:
  bool armed_ = true, was_alive_ = false;
};

/// An older report means that the cycle stands still.
inline constexpr double kOldestReport_s = 0.25;
/// Longest control cycle whose reports are never too old.
inline constexpr double kLongestCycle_s = 0.1;

/// What the control cycle knows, once per cycle.
struct CycleReport {
  double now_s = 0;              ///< monotonic; 0: no cycle yet
  std::uint64_t generation = 0;  ///< of the configuration, see MotionModel
  bool enabled = false;          ///< by the PLC
  bool plc_alive = false;        ///< its heartbeat changes
  bool robot_trusted = false;
  bool compensated_twice = false;  ///< by the controller and by the cell
  model::JointVector q;            ///< of the robot link [rad] or [m]
  double q_s = 0;                  ///< monotonic; nothing of q was read earlier
  std::optional<loads::Payload> payload;
  effects::Conditions conditions;
  model::StatedRadius radius;  ///< at q
};

/// The corrector of one configuration, as the motion link uses it.
struct MotionModel {
  std::uint64_t generation = 0;  ///< reports of another configuration are not used with it
  correction::Corrector corrector;
};

/// The order for a packet with joints `q`. `applied` is the offset of the last answer: the packet's
/// posture contains it, so the target is that posture without it, and the correction is
///   wanted = command(target) - target,   target = FK(q) - applied
/// Exact once the offset has settled; the correction changes by about 0.3 % of a displacement of
/// its own size. The joints of a controller do not contain the deflection: nothing is fed back.
/// Bounded work; does not allocate.
/// @param q      [rad] or [m]; may be empty, of another size, or not finite
/// @param now_s  monotonic
MotionOffset::Order OrderFor(const CycleReport& report, const MotionModel* model,
                             const CorrectionRules& rules, const model::JointVector& q,
                             const Offset& applied, double now_s);

}  // namespace plumbline::motion_offset
