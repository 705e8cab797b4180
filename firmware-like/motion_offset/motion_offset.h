// Offset of a running motion, one value for each packet of the controller: bounded in size and
// rate, and without a jump whatever happens to the packets.
#pragma once

#include <cstdint>
#include <optional>

#include "firmware-like/geometry/pose.h"
#include "firmware-like/motion_offset/packet_sequence.h"

namespace plumbline::motion_offset {

/// Translation and rotation of the tool point, in the frame that the controller expects.
struct Offset {
  Vec3 translation = Vec3::Zero();  ///< [m]
  Vec3 rotation = Vec3::Zero();     ///< rotation vector [rad]

  bool zero() const { return translation.isZero(0) && rotation.isZero(0); }
};

/// Why the offset is zero, or on its way there. The numbers are those of the register map.
enum class Obstacle : std::uint16_t {
  kNone = 0,
  kOff = 1,            ///< [motion] is not enabled in the configuration
  kNoPackets = 2,      ///< the controller sends nothing
  kNotAnswered = 3,    ///< the stream was interrupted, or ran before this program did
  kStopping = 4,       ///< the program or the configuration ends the correction
  kNotEnabled = 5,     ///< the PLC's coil is 0
  kHeartbeatLost = 6,  ///< the PLC's heartbeat does not change
  kNotRunning = 7,     ///< the controller says that the correction is not active
  kNoJoints = 8,       ///< the packet has no usable joint values
  kNoCycle = 9,        ///< the control cycle has not reported for too long
  kRobotNotTrusted = 10,
  kJointsDisagree = 11,  ///< the packet's joints are not those of the robot link
  kPayloadUnknown = 12,
  kRefused = 13,  ///< the corrector has no correction here
  kRadiusTooWide = 14,
  kBasisTooWeak = 15,
  kTooLarge = 16,          ///< the offset would exceed its largest size
  kWrongCycle = 17,        ///< the packets do not come once per configured cycle
  kCompensatedTwice = 18,  ///< the controller compensates what the cell corrects
};
inline constexpr Obstacle kLastObstacle = Obstacle::kCompensatedTwice;

/// Short description for log, status and documents.
const char* Describe(Obstacle obstacle);
/// What to do; "" if nothing.
const char* RemedyOf(Obstacle obstacle);

/// Settings of the offset; see FaultOf().
struct OffsetLimits {
  double max_translation_m = 0.002;
  double max_rotation_rad = 0;  ///< 0: the orientation is not corrected
  double rate_m_per_s =
      0.001;                   ///< of the translation; the rotation has the same share of its limit
  double max_jump_m = 0.0005;  ///< largest change from one cycle of the controller to the next
  double max_jump_rad = 8.7266462599716e-4;  ///< the same of the rotation: 0.05 degrees
  double cycle_s = 0.012;                    ///< time between two packets of the controller
  /// The controller stops by itself when it has had no answer for this long.
  double timeout_s = 0;
  double ramp_s = 1;    ///< at least this long from nothing to the whole offset, and back
  double hold_s = 0.2;  ///< how long an offset is kept when its data are missing
  /// Packets in a row, by their numbers or by time; after more, nothing is answered until the
  /// stream ends.
  int max_lost = 5;
  bool holds_last = true;  ///< what the controller does without an answer; false: it takes 0

  bool operator==(const OffsetLimits&) const = default;
};

enum class LimitsFault : std::uint8_t {
  kNone,
  kTimeoutTooShort,   ///< shorter than one cycle
  kJumpsToZero,       ///< without an answer the whole offset is a jump
  kJumpsAfterLosses,  ///< the steps in lost answers add up to a jump
  kTurnsToZero,       ///< as kJumpsToZero, of the rotation
  kTurnsAfterLosses,  ///< as kJumpsAfterLosses, of the rotation
  kReturnsTooLate,    ///< the way back to 0 takes longer than kLongestReturn_s
};
/// A program that ends has this long to bring the offset back to 0 [s].
inline constexpr double kLongestReturn_s = 8;
/// Rate of the rotation [rad/s]: it has the translation's share of its own limit.
double RotationRate(const OffsetLimits& limits);
/// Why these limits cannot prevent a jump.
/// An answer may be lost, and the next one that arrives contains all steps since. If the controller
/// keeps the last value, at most timeout / cycle steps are missed before it stops:
///   rate (timeout + cycle) <= max_jump
/// If it takes 0 instead, the whole offset is a jump: max_translation <= max_jump. The rotation
/// must satisfy the same with its own rate and limits. The way back to 0 must be short enough for a
/// stop:
///   max(ramp, max_translation / rate) <= kLongestReturn_s
LimitsFault FaultOf(const OffsetLimits& limits);

/// State machine of one link. Time is an input. Does not allocate. Not thread-safe.
///
/// An offset other than 0 is only given on a stream that began after the controller had certainly
/// stopped the previous one, because only then is the controller's own offset known: it starts at
/// 0. A stream that was running when this program started, or whose packets were lost for too long,
/// is not answered: the controller then stops by its own timeout, and the next stream is answered.
class MotionOffset {
 public:
  /// @param now_s  begin of the listening
  MotionOffset(const OffsetLimits& limits, double now_s);

  struct Packet {
    double received_s = 0;  ///< monotonic
    std::uint64_t number = 0;
    bool running = true;  ///< the controller applies what is answered
  };
  /// What the model says for the posture of this packet.
  struct Order {
    Obstacle obstacle = Obstacle::kNone;
    Offset wanted;  ///< valid with kNone
  };
  struct Acceptance {
    bool accepted = false;  ///< false: it must not be answered
    PacketOrder order = PacketOrder::kNew;
  };
  /// To be called for each packet of the controller, in the order of arrival.
  Acceptance Accept(const Packet& packet);
  /// The accepted packet that is not answered yet, the newest one. A stream that ends or is barred
  /// takes it along: it must not be answered any more.
  const std::optional<Packet>& unanswered() const { return unanswered_; }
  /// The offset to answer that packet with; nullopt if there is none.
  std::optional<Offset> Next(const Order& order);
  /// Ends a stream that has been silent. To be called at least every 0.1 s.
  void Idle(double now_s);

  /// The offset of the last answer; 0 without a stream.
  const Offset& offset() const { return offset_; }
  Obstacle obstacle() const { return obstacle_; }
  bool answering() const { return phase_ == Phase::kAnswering; }
  std::uint64_t lost() const { return lost_; }  ///< packets, since the start
  std::uint64_t streams() const { return streams_; }

 private:
  enum class Phase : std::uint8_t { kNoStream, kAnswering, kBarred };

  bool SilentFor(double now_s) const;
  void Begin();
  void Bar();
  /// Compares the packets' rhythm with the configured cycle. @param step  since the previous packet
  void ObserveRhythm(double step_s, std::uint32_t lost);
  void StepTowards(const Offset& target, double elapsed_s);

  OffsetLimits limits_;
  PacketSequence sequence_;
  Phase phase_ = Phase::kNoStream;
  bool listened_ = false;  ///< a silence was observed since the start
  double last_packet_s_;   ///< of any order
  std::optional<double> last_answer_s_;
  std::optional<double> last_good_s_;  ///< of an order without obstacle
  bool was_running_ = true;
  bool paused_with_offset_ = false;  ///< the controller stopped applying an offset other than 0
  std::optional<Packet> unanswered_;
  bool wrong_cycle_ = false;
  int slow_steps_ = 0;         ///< in a row
  std::uint32_t counted_ = 0;  ///< cycles in counted_s_
  double counted_s_ = 0;
  double ramp_ = 0;  ///< 0..1
  Offset wanted_, offset_;
  Obstacle obstacle_ = Obstacle::kNoPackets;
  std::uint64_t lost_ = 0, streams_ = 0;
};

}  // namespace plumbline::motion_offset
