#include "firmware-like/motion_offset/motion_offset.h"

#include <algorithm>
#include <cmath>

namespace plumbline::motion_offset {
namespace {

struct ObstacleText {
  Obstacle obstacle;
  const char* what;
  const char* remedy;
};

constexpr ObstacleText kTexts[] = {
    {Obstacle::kNone, "correcting", ""},
    {Obstacle::kOff, "off", ""},
    {Obstacle::kNoPackets, "the controller sends no packets",
     "start the robot program that switches the sensor interface on; check address and port in "
     "the controller, and the cable"},
    {Obstacle::kNotAnswered, "not answered: the stream was interrupted or is older than the daemon",
     "let the controller stop by its timeout, then start the robot program again"},
    {Obstacle::kStopping, "stopping", ""},
    {Obstacle::kNotEnabled, "not enabled by the PLC",
     "set coil 1002 while motions may be corrected"},
    {Obstacle::kHeartbeatLost, "the PLC's heartbeat does not change",
     "write register 1030 at least every 2 s"},
    {Obstacle::kNotRunning, "the controller does not apply corrections",
     "start the motion that is corrected in the robot program"},
    {Obstacle::kNoJoints, "the packets have no usable joint values",
     "send the joint values from the controller: see docs/motion.md"},
    {Obstacle::kNoCycle, "the control cycle does not report",
     "see the log for the reason; the service manager restarts a daemon that is stuck"},
    {Obstacle::kRobotNotTrusted, "the robot input is not trusted",
     "see the robot's line in `plumbline status`"},
    {Obstacle::kJointsDisagree, "the packets' joints contradict the robot link",
     "compare the joint values of both on the teach pendant; check the profile of the robot link"},
    {Obstacle::kPayloadUnknown, "the payload is unknown", "see [payload] in plumbline.toml"},
    {Obstacle::kRefused, "no correction in this posture",
     "see the correction's limits and the robot's limits"},
    {Obstacle::kRadiusTooWide, "the stated radius is wider than allowed",
     "measure the cell and fit the model, or raise widest_radius_mm"},
    {Obstacle::kBasisTooWeak, "the basis of the radius is weaker than required",
     "measure the cell and fit the model, or lower weakest_basis"},
    {Obstacle::kTooLarge, "the offset would be larger than allowed",
     "check payload and model, or raise max_offset_mm together with the controller's own limit"},
};

const ObstacleText& TextOf(Obstacle obstacle) {
  for (const ObstacleText& text : kTexts) {
    if (text.obstacle == obstacle) return text;
  }
  return kTexts[0];
}

/// Moves `value` towards `target` by at most `step`, and never beyond `largest`.
Vec3 Stepped(const Vec3& value, const Vec3& target, double step, double largest) {
  const Vec3 way = target - value;
  const double length = way.norm();
  Vec3 next = length <= step ? target : Vec3(value + way * (step / length));
  const double size = next.norm();
  if (size > largest) next *= largest / size;
  return next;
}

/// Obstacles that may pass within moments; the others end the correction at once.
bool MayPass(Obstacle obstacle) {
  switch (obstacle) {
    case Obstacle::kNoJoints:
    case Obstacle::kNoCycle:
    case Obstacle::kRobotNotTrusted:
    case Obstacle::kPayloadUnknown:
    case Obstacle::kRefused:
      return true;
    default:
      return false;
  }
}

/// The silence must outlast the controller's timeout, in spite of its jitter and ours.
constexpr double kSilenceCycles = 3;

}  // namespace

const char* Describe(Obstacle obstacle) {
  return TextOf(obstacle).what;
}

const char* RemedyOf(Obstacle obstacle) {
  return TextOf(obstacle).remedy;
}

LimitsFault FaultOf(const OffsetLimits& limits) {
  if (!(limits.timeout_s >= limits.cycle_s)) return LimitsFault::kTimeoutTooShort;
  if (!limits.holds_last) {
    return limits.max_translation_m <= limits.max_jump_m ? LimitsFault::kNone
                                                         : LimitsFault::kJumpsToZero;
  }
  const double largest_m = limits.rate_m_per_s * (limits.timeout_s + limits.cycle_s);
  return largest_m <= limits.max_jump_m ? LimitsFault::kNone : LimitsFault::kJumpsAfterLosses;
}

MotionOffset::MotionOffset(const OffsetLimits& limits, double now_s)
    : limits_(limits), sequence_(limits.max_lost), last_packet_s_(now_s) {}

bool MotionOffset::SilentFor(double now_s) const {
  return now_s - last_packet_s_ >= limits_.timeout_s + kSilenceCycles * limits_.cycle_s;
}

void MotionOffset::Idle(double now_s) {
  if (!SilentFor(now_s)) return;
  phase_ = Phase::kNoStream;
  listened_ = true;
  offset_ = wanted_ = {};
  ramp_ = 0;
  obstacle_ = Obstacle::kNoPackets;
}

void MotionOffset::Begin() {
  phase_ = Phase::kAnswering;
  sequence_.Restart();
  last_answer_s_.reset();
  last_good_s_.reset();
  was_running_ = true;
  ++streams_;
}

void MotionOffset::Bar() {
  phase_ = Phase::kBarred;
  offset_ = wanted_ = {};
  ramp_ = 0;
  obstacle_ = Obstacle::kNotAnswered;
}

MotionOffset::Acceptance MotionOffset::Accept(const Packet& packet) {
  Idle(packet.received_s);
  // A program that switches the interface off and on may continue the numbers: then only the time
  // shows that the controller has begun at 0 again.
  const bool paused = packet.received_s - last_packet_s_ > (limits_.max_lost + 2) * limits_.cycle_s;
  last_packet_s_ = std::max(last_packet_s_, packet.received_s);
  if (phase_ == Phase::kNoStream && listened_)
    Begin();
  else if (phase_ != Phase::kAnswering || paused)
    Bar();
  if (phase_ != Phase::kAnswering) return {};
  const PacketSequence::Check check = sequence_.Next(packet.number);
  if (check.order == PacketOrder::kRenumbered) Bar();
  if (check.order != PacketOrder::kNew) return {false, check.order};
  lost_ += check.lost;
  // A controller that starts to apply corrections again begins at 0 or where it was: not known.
  const bool resumes = packet.running && !was_running_ && !offset_.zero();
  was_running_ = packet.running;
  if (check.lost <= static_cast<std::uint32_t>(limits_.max_lost) && !resumes) return {true};
  Bar();
  return {};
}

const Offset& MotionOffset::Next(const Packet& packet, const Order& order) {
  const double elapsed_s =
      last_answer_s_ ? std::clamp(packet.received_s - *last_answer_s_, 0.0, limits_.cycle_s) : 0;
  last_answer_s_ = packet.received_s;
  Obstacle obstacle = order.obstacle;
  if (obstacle == Obstacle::kNone && !packet.running) obstacle = Obstacle::kNotRunning;
  if (obstacle == Obstacle::kNone &&
      !(order.wanted.translation.norm() <= limits_.max_translation_m &&
        order.wanted.rotation.norm() <= limits_.max_rotation_rad)) {
    obstacle = Obstacle::kTooLarge;  // also if it is not a number
  }
  obstacle_ = obstacle;
  const double ramp_step = elapsed_s / limits_.ramp_s;
  if (obstacle == Obstacle::kNone) {
    wanted_ = order.wanted;
    last_good_s_ = packet.received_s;
    ramp_ = std::min(1.0, ramp_ + ramp_step);
  } else {
    const bool held =
        MayPass(obstacle) && last_good_s_ && packet.received_s - *last_good_s_ <= limits_.hold_s;
    if (!held) ramp_ = std::max(0.0, ramp_ - ramp_step);
  }
  StepTowards({ramp_ * wanted_.translation, ramp_ * wanted_.rotation}, elapsed_s);
  return offset_;
}

void MotionOffset::StepTowards(const Offset& target, double elapsed_s) {
  const double step_m = limits_.rate_m_per_s * elapsed_s;
  const double share = step_m / limits_.max_translation_m;
  offset_.translation =
      Stepped(offset_.translation, target.translation, step_m, limits_.max_translation_m);
  offset_.rotation = Stepped(offset_.rotation, target.rotation, share * limits_.max_rotation_rad,
                             limits_.max_rotation_rad);
}

}  // namespace plumbline::motion_offset
