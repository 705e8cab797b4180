#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>

#include "app/base/config/daemon_settings.h"
#include "app/base/config/limits.h"
#include "drivers/motion/rsi_codec.h"
#include "firmware-like/geometry/rotation.h"

namespace plumbline::config {
namespace {

using motion_offset::LimitsFault;
using motion_offset::OffsetFrame;

constexpr int kRsiPort = 59152, kEgmPort = 6510;

bool IsIpv4(const std::string& text) {
  in_addr address{};
  return inet_pton(AF_INET, text.c_str(), &address) == 1;
}

/// What can stand in an XML name and in an attribute's quotes.
void CheckXmlName(const TomlTable& table, const char* key, const std::string& name) {
  const bool plain = std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  });
  if (name.empty() || !plain || name.size() > motion_link::kLongestRsiName) {
    table.AddFault(key, fmt::format("must have 1..{} letters, digits or underscores, as in the "
                                    "controller's Ethernet configuration",
                                    motion_link::kLongestRsiName));
  }
}

void CheckLimits(const TomlTable& table, const motion_offset::OffsetLimits& limits) {
  switch (FaultOf(limits)) {
    case LimitsFault::kNone:
      return;
    case LimitsFault::kTimeoutTooShort:
      return table.AddFault("timeout_ms", "is less than cycle_ms");
    case LimitsFault::kJumpsToZero:
      return table.AddFault(
          "max_jump_mm",
          fmt::format(
              "is less than max_offset_mm = {:g}: without an answer this controller takes 0 "
              "(holds_last = false), and the whole offset is a jump. Lower max_offset_mm, "
              "or set HOLDON=\"1\" in the controller and holds_last = true here",
              kMmPerMetre * limits.max_translation_m));
    case LimitsFault::kJumpsAfterLosses:
      return table.AddFault(
          "max_jump_mm",
          fmt::format("is less than {:.3g}, what rate_mm_per_s = {:g} adds up to while {:g} ms of "
                      "answers are lost, before the controller stops. Lower rate_mm_per_s, or the "
                      "controller's timeout and timeout_ms",
                      kMmPerMetre * limits.rate_m_per_s * (limits.timeout_s + limits.cycle_s),
                      kMmPerMetre * limits.rate_m_per_s, limits.timeout_s / kSecondPerMs));
    case LimitsFault::kTurnsToZero:
      return table.AddFault(
          "max_jump_deg",
          fmt::format("is less than max_rotation_deg = {:g}: without an answer this controller "
                      "takes 0 (holds_last = false), and the whole rotation is a jump. Lower "
                      "max_rotation_deg",
                      kDegPerRad * limits.max_rotation_rad));
    case LimitsFault::kTurnsAfterLosses:
      return table.AddFault(
          "max_jump_deg",
          fmt::format("is less than {:.3g}, what the rotation adds up to while {:g} ms of answers "
                      "are lost: max_rotation_deg times rate_mm_per_s / max_offset_mm, times that "
                      "time. Lower max_rotation_deg or rate_mm_per_s",
                      kDegPerRad * RotationRate(limits) * (limits.timeout_s + limits.cycle_s),
                      limits.timeout_s / kSecondPerMs));
    case LimitsFault::kReturnsTooLate:
      return table.AddFault(
          limits.ramp_s > motion_offset::kLongestReturn_s ? "ramp_s" : "rate_mm_per_s",
          fmt::format("lets the way back to 0 take {:.3g} s (ramp_s, or max_offset_mm / "
                      "rate_mm_per_s); a stop of the daemon leaves {:g} s. Lower ramp_s or "
                      "max_offset_mm, or raise rate_mm_per_s",
                      std::max(limits.ramp_s, limits.max_translation_m / limits.rate_m_per_s),
                      motion_offset::kLongestReturn_s));
  }
}

/// What EGM does not have, or what would not be safe.
void CheckKind(const TomlTable& table, const MotionKeys& keys) {
  if (keys.kind == MotionKeys::Kind::kEgmGuidance) {
    table.AddFault("kind",
                   "replaces the robot program instead of correcting it: no programmed path is "
                   "beneath, and a lost link leaves the robot without a target. Use \"egm\", path "
                   "correction");
  }
  if (keys.relative) {
    table.AddFault("mode",
                   "adds each answer to the sum of all before: an answer that is lost or applied "
                   "twice shifts the path for good. Use RSI_ON(#ABSOLUTE) in the robot program");
  }
  if (keys.kind == MotionKeys::Kind::kRsi) return;
  if (keys.frame == OffsetFrame::kBase) {
    table.AddFault("frame",
                   "is not offered by EGM: its path corrections are relative to the tool. Use "
                   "\"tool\", with frame_rpy_deg if the sensor frame is turned against it");
  }
  if (keys.settings.limits.max_rotation_rad > 0) {
    table.AddFault("max_rotation_deg", "must be 0 with EGM: a path correction has no orientation");
  }
}

}  // namespace

motion_link::MotionSettings MotionFromToml(const TomlTable& table, const model::CellModel* cell,
                                           bool targets_corrected) {
  MotionKeys keys;
  ReadKeys(table, keys);
  motion_link::MotionSettings& settings = keys.settings;
  const bool rsi = keys.kind == MotionKeys::Kind::kRsi;
  settings.kind = rsi ? "rsi" : "egm";
  settings.port = keys.port.value_or(rsi ? kRsiPort : kEgmPort);
  settings.rules.frame = keys.frame.value_or(rsi ? OffsetFrame::kBase : OffsetFrame::kTool);
  settings.rules.R_frame = RotationFromRollPitchYaw(keys.frame_rpy_rad);
  settings.rules.rotates = settings.limits.max_rotation_rad > 0;
  if (settings.enabled && targets_corrected && !keys.only_taught_targets) {
    table.AddFault("only_taught_targets",
                   "must be true: this configuration also corrects targets ([push] or [[point]]), "
                   "and a motion to a corrected target must not be corrected again. Set it once "
                   "the PLC clears coil 1002 for such motions, and for corrected programs");
  }
  CheckKind(table, keys);
  CheckXmlName(table, "sen_type", settings.codec.rsi.sen_type);
  CheckXmlName(table, "joints_tag", settings.codec.rsi.joints_tag);
  CheckXmlName(table, "correction_tag", settings.codec.rsi.correction_tag);
  if (!IsIpv4(settings.listen)) table.AddFault("listen", "is not an IPv4 address");
  if (!settings.robot.empty() && !IsIpv4(settings.robot)) {
    table.AddFault("robot", "is not an IPv4 address such as 192.168.1.10");
  }
  if (settings.enabled && settings.robot.empty() && !table.Has("robot")) {
    table.AddMissing("robot", "the IPv4 address of the controller; other senders are ignored");
  }
  if (settings.enabled && !rsi && !table.Has("cycle_ms")) {
    table.AddMissing("cycle_ms",
                     "the time between two packets of the controller: SampleRate of EGMActMove");
  }
  if (keys.timeout_s) settings.limits.timeout_s = *keys.timeout_s;
  if (settings.enabled && !table.Has("timeout_ms")) {
    table.AddMissing("timeout_ms",
                     "after how long without an answer the controller stops: Timeout of RSI times "
                     "cycle_ms, or CommTimeout of EGM");
  }
  if (keys.timeout_s) CheckLimits(table, settings.limits);
  const bool prismatic =
      cell != nullptr && std::any_of(cell->robot.joints.begin(), cell->robot.joints.end(),
                                     [](const model::Joint& joint) {
                                       return joint.type == model::JointType::kPrismatic;
                                     });
  if (settings.enabled && prismatic) {
    table.AddFault("enabled",
                   "is not possible with a prismatic joint: the packets' joint values "
                   "are read as degrees");
  }
  return settings;
}

void ListKeys(Settings& keys, MotionKeys& motion) {
  using Kind = MotionKeys::Kind;
  using model::RadiusBasis;
  motion_link::MotionSettings& settings = motion.settings;
  motion_offset::OffsetLimits& limits = settings.limits;
  keys.Add(
      "enabled", settings.enabled,
      {"false: no port is opened. Even if true, nothing moves unless the PLC holds coil 1002"});
  keys.Add("only_taught_targets", motion.only_taught_targets,
           {"required with [push] or [[point]]: true says that coil 1002 is 0 whenever the robot "
            "moves to a corrected target, which would be corrected twice"});
  keys.Choose("kind", motion.kind,
              {{"rsi", Kind::kRsi}, {"egm", Kind::kEgm}, {"egm_guidance", Kind::kEgmGuidance}},
              {"KUKA RSI, or ABB EGM path correction; EGM guidance is refused"});
  keys.Add("robot", settings.robot,
           {"required: IPv4 address of the controller; packets from others are ignored",
            "\"192.168.1.10\""});
  keys.Add("listen", settings.listen,
           {"IPv4 address of this computer in the controller's network"});
  keys.Add("port", motion.port, {1024, 65535},
           {.description = "UDP port that the controller sends to",
            .example = "59152",
            .default_text = "59152, of \"egm\" 6510"});
  keys.Add("cycle_ms", limits.cycle_s, {1, 100, kSecondPerMs},
           {"time between two packets of the controller: 4 or 12; required for \"egm\": its "
            "SampleRate"});
  keys.Add("timeout_ms", motion.timeout_s, {1, 10000, kSecondPerMs},
           {"required: after this long without an answer the controller stops by itself; not less "
            "than what is set there",
            "120.0"});
  keys.Add("holds_last", limits.holds_last,
           {"what the controller does for a missing answer. true: keeps the last value (HOLDON=1); "
            "false: takes 0, and max_offset_mm must not exceed max_jump_mm"});
  keys.Add("max_lost_packets", limits.max_lost, {0, 50},
           {"after more packets lost in a row nothing is answered until the stream ends"});
  keys.Add("max_offset_mm", limits.max_translation_m, {0.001, 20, kMetrePerMm},
           {"largest offset; a larger one is refused, not clipped"});
  keys.Add("max_rotation_deg", limits.max_rotation_rad, {0, 5, kRadPerDeg},
           {"largest rotation, with the rate of the same share; 0: the orientation is not "
            "corrected"});
  keys.Add("rate_mm_per_s", limits.rate_m_per_s, {0.01, 100, kMetrePerMm},
           {"fastest change of the offset"});
  keys.Add("max_jump_mm", limits.max_jump_m, {0.001, 5, kMetrePerMm},
           {"largest change that the controller may see at once after lost answers"});
  keys.Add("max_jump_deg", limits.max_jump_rad, {0.001, 5, kRadPerDeg},
           {"the same of the rotation"});
  keys.Add("ramp_s", limits.ramp_s, {0.1, motion_offset::kLongestReturn_s},
           {"from nothing to the whole offset, and back"});
  keys.Add("hold_ms", limits.hold_s, {0, 2000, kSecondPerMs},
           {"how long the offset is kept when robot data are missing, before it returns to 0"});
  keys.Add("widest_radius_mm", settings.rules.widest_radius_m, {0.001, 100, kMetrePerMm},
           {"a correction whose 95 % radius is wider is not applied"});
  keys.Choose("weakest_basis", settings.rules.weakest_basis,
              {{"measured", RadiusBasis::kMeasured},
               {"propagated", RadiusBasis::kPropagated},
               {"assumed", RadiusBasis::kAssumed}},
              {"nor one whose radius has a weaker basis"});
  keys.Choose("frame", motion.frame, {{"base", OffsetFrame::kBase}, {"tool", OffsetFrame::kTool}},
              {"axes of the offset: those of the robot's base or of its tool; not confirmed on a "
               "controller, see motion.md",
               "\"base\"", "\"base\", of \"egm\" \"tool\""});
  keys.Add("frame_rpy_deg", motion.frame_rpy_rad, kTurnRange,
           {"orientation of the controller's correction frame in that frame"});
  keys.Choose("mode", motion.relative, {{"absolute", false}, {"relative", true}},
              {"of RSI_ON; \"relative\" is refused because it drifts"});
  keys.Add("sen_type", settings.codec.rsi.sen_type, {"for \"rsi\": SENTYPE of the controller"});
  keys.Add("joints_tag", settings.codec.rsi.joints_tag,
           {"for \"rsi\": element with the joint values A1, A2, .."});
  keys.Add("correction_tag", settings.codec.rsi.correction_tag,
           {"for \"rsi\": element that the correction is sent in"});
  keys.Add("needs_running", settings.codec.egm_needs_running,
           {"for \"egm\": correct only while mciState is RUNNING"});
}

}  // namespace plumbline::config
