#include "firmware-like/motion_offset/motion_offset.h"

#include <algorithm>
#include <cmath>
#include <utility>

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
     "set coil 1002 while motions may be corrected; after a lost heartbeat clear it first"},
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
    {Obstacle::kWrongCycle, "the packets do not come once per cycle_ms",
     "set cycle_ms to the time between two packets: 4 or 12 with RSI, SampleRate with EGM"},
    {Obstacle::kCompensatedTwice, "the controller compensates what the cell corrects",
     "see the log and `plumbline identify-controller`; remove one of both corrections"},
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

// What shows that cycle_s is wrong: packets that never come within kSlow cycles, or so many of them
// that a burst after a pause does not explain it.
constexpr double kSlow = 1.5, kFast = 0.6;
constexpr int kSlowSteps = 16;
constexpr std::uint32_t kFastCount = 256;

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
  const double missed_s = limits.timeout_s + limits.cycle_s;
  const double jump_m =
      limits.holds_last ? limits.rate_m_per_s * missed_s : limits.max_translation_m;
  const double jump_rad =
      limits.holds_last ? RotationRate(limits) * missed_s : limits.max_rotation_rad;
  if (!(jump_m <= limits.max_jump_m)) {
    return limits.holds_last ? LimitsFault::kJumpsAfterLosses : LimitsFault::kJumpsToZero;
  }
  if (!(jump_rad <= limits.max_jump_rad)) {
    return limits.holds_last ? LimitsFault::kTurnsAfterLosses : LimitsFault::kTurnsToZero;
  }
  const double return_s = std::max(limits.ramp_s, limits.max_translation_m / limits.rate_m_per_s);
  return return_s <= kLongestReturn_s ? LimitsFault::kNone : LimitsFault::kReturnsTooLate;
}

double RotationRate(const OffsetLimits& limits) {
  return limits.rate_m_per_s / limits.max_translation_m * limits.max_rotation_rad;
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
  unanswered_.reset();
  offset_ = wanted_ = {};
  ramp_ = 0;
  obstacle_ = Obstacle::kNoPackets;
}

void MotionOffset::Begin() {
  phase_ = Phase::kAnswering;
  sequence_.Restart();
  last_answer_s_.reset();
  last_good_s_.reset();
  unanswered_.reset();
  was_running_ = true;
  paused_with_offset_ = wrong_cycle_ = false;
  slow_steps_ = 0;
  counted_ = 0;
  counted_s_ = 0;
  ++streams_;
}

void MotionOffset::Bar() {
  phase_ = Phase::kBarred;
  unanswered_.reset();
  offset_ = wanted_ = {};
  ramp_ = 0;
  obstacle_ = wrong_cycle_ ? Obstacle::kWrongCycle : Obstacle::kNotAnswered;
}

void MotionOffset::ObserveRhythm(double step_s, std::uint32_t lost) {
  const std::uint32_t cycles = 1 + lost;
  slow_steps_ = step_s > kSlow * cycles * limits_.cycle_s ? slow_steps_ + 1 : 0;
  counted_ += cycles;
  counted_s_ += step_s;
  if (slow_steps_ >= kSlowSteps) wrong_cycle_ = true;
  if (counted_ < kFastCount) return;
  const bool fast = counted_s_ < kFast * counted_ * limits_.cycle_s;
  wrong_cycle_ = fast || slow_steps_ >= kSlowSteps;
  counted_ = 0;
  counted_s_ = 0;
}

MotionOffset::Acceptance MotionOffset::Accept(const Packet& packet) {
  Idle(packet.received_s);
  // A program that switches the interface off and on may continue the numbers: then only the time
  // shows that the controller has begun at 0 again.
  const double step_s = std::max(0.0, packet.received_s - last_packet_s_);
  const bool paused = step_s > (limits_.max_lost + 2) * limits_.cycle_s;
  last_packet_s_ = std::max(last_packet_s_, packet.received_s);
  const bool first = phase_ == Phase::kNoStream;
  if (first && listened_) Begin();
  if (phase_ != Phase::kAnswering || (paused && !first)) {
    if (!first) ObserveRhythm(step_s, 0);
    Bar();
    return {};
  }
  const PacketSequence::Check check = sequence_.Next(packet.number);
  if (check.order == PacketOrder::kRenumbered) Bar();
  if (check.order != PacketOrder::kNew) return {false, check.order};
  lost_ += check.lost;
  if (!first) ObserveRhythm(step_s, check.lost);
  // A controller that starts to apply corrections again begins at 0 or where it was: not known,
  // however long ago that was.
  if (!packet.running && was_running_) paused_with_offset_ = !offset_.zero();
  const bool resumes = packet.running && !was_running_ && paused_with_offset_;
  was_running_ = packet.running;
  if (check.lost <= static_cast<std::uint32_t>(limits_.max_lost) && !resumes) {
    unanswered_ = packet;
    return {true};
  }
  Bar();
  return {};
}

std::optional<Offset> MotionOffset::Next(const Order& order) {
  if (!unanswered_) return std::nullopt;
  const Packet packet = *std::exchange(unanswered_, std::nullopt);
  const double elapsed_s =
      last_answer_s_ ? std::clamp(packet.received_s - *last_answer_s_, 0.0, limits_.cycle_s) : 0;
  last_answer_s_ = packet.received_s;
  Obstacle obstacle = wrong_cycle_ ? Obstacle::kWrongCycle : order.obstacle;
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
  offset_.translation =
      Stepped(offset_.translation, target.translation, step_m, limits_.max_translation_m);
  offset_.rotation = Stepped(offset_.rotation, target.rotation, RotationRate(limits_) * elapsed_s,
                             limits_.max_rotation_rad);
}

}  // namespace plumbline::motion_offset
