#include "app/cli/doctor/robot_reading.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "app/measure/controller/posture_collector.h"
#include "app/measure/controller/reported_steps.h"
#include "drivers/clock.h"
#include "drivers/robot/register_survey.h"
#include "drivers/robot/registry.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/loads/numbered_load.h"
#include "firmware-like/model/joint_columns.h"
#include "firmware-like/plausibility_filter.h"

namespace plumbline::cli {
namespace {

constexpr double kRobotWait_s = 3;

std::string PlaceOf(const config::RobotLinkConfig& link) {
  return link.transport == "rtu"
             ? link.connection.serial.device
             : fmt::format("{}:{}", link.connection.tcp.host, link.connection.tcp.port);
}

/// "q1 12.5 deg (-180 to 180), q2 ..": what a person compares with the teach pendant.
std::string JointsText(const kinematics::Chain& chain, const model::JointVector& q) {
  std::string text;
  for (int j = 0; j < q.size(); ++j) {
    const bool known = j < chain.size();
    const auto type = known ? chain.type(j) : model::JointType::kRevolute;
    const double unit = model::PositionForm(type).to_SI;
    text += fmt::format("{}q{} {:.6g} {}", j == 0 ? "" : ", ", j + 1, q[j] / unit,
                        type == model::JointType::kRevolute ? "deg" : "mm");
    if (known && std::isfinite(chain.lower()[j]) && std::isfinite(chain.upper()[j])) {
      text += fmt::format(" ({:.6g} to {:.6g})", chain.lower()[j] / unit, chain.upper()[j] / unit);
    }
  }
  return text;
}

/// The newest reading, whether it is trusted, and why the link failed if it did last.
struct Reading {
  model::RobotState state;
  InputFault fault = InputFault::kMissing;
  robot::LinkResult failed = robot::LinkResult::kWaiting;
  std::string problem;
};

/// Reads as often as the daemon, and judges as it does: while a reading is on its way, the one
/// before it ages.
Reading ReadUntilTrusted(robot::RobotDevice& robot, const config::DaemonConfig& config,
                         const deflection::LoadedArm& arm) {
  Reading reading;
  PlausibilityFilter filter(config.machine.plausibility);
  const auto judge = [&](double now_s) {
    const std::optional<int> mounted =
        arm.tools() == 1 ? 0 : loads::ToolIndexOf(config.machine.cell, reading.state.tool_number);
    reading.fault = filter.Check(arm, reading.state, now_s, mounted);
  };
  double now_s = MonotonicSeconds();
  const double until_s = now_s + kRobotWait_s;
  while (reading.fault != InputFault::kOk && now_s < until_s) {
    SleepSeconds(now_s + config.cycle_period_s - MonotonicSeconds());
    now_s = MonotonicSeconds();
    model::RobotState newest = reading.state;
    const robot::LinkResult result = robot.Read(newest);
    judge(MonotonicSeconds());
    if (result == robot::LinkResult::kOk) {
      reading.state = newest;
      reading.problem.clear();
      judge(MonotonicSeconds());
    } else if (result != robot::LinkResult::kWaiting) {
      reading.problem = robot.problem();
      reading.failed = result;
    }
  }
  return reading;
}

/// What is wrong with a reading of a robot that answers.
std::string WhyUntrusted(InputFault fault, const model::RobotState& state) {
  if (fault == InputFault::kMissing) return "it was not refreshed";
  if (fault != InputFault::kNotFinite || state.q.allFinite()) return Describe(fault);
  std::vector<int> joints;
  for (int j = 0; j < state.q.size(); ++j) {
    if (!std::isfinite(state.q[j])) joints.push_back(j + 1);
  }
  return fmt::format("joint {} is not a number", fmt::join(joints, ", "));
}

robot::RegisterClient ClientOf(const config::RobotLinkConfig& link) {
  return robot::RegisterClient({link.connection.tcp.host, link.connection.tcp.port,
                                std::max(1.0, link.connection.timeout_s), 0.01, 200});
}

constexpr int kAround = 4;  // registers before and behind a block, in which shifted joints may lie

/// The registers of the joints' table that the profile reads, and those around them.
robot::RegisterImage ImageOf(const config::RobotLinkConfig& link) {
  const robot::RobotProfile& profile = link.connection.profile;
  robot::RegisterClient client = ClientOf(link);
  robot::RegisterImage image;
  image.table = profile.joints.front().value.table;
  bool answers = true;
  const auto read = [&](int first, int count) {
    if (!answers || first < 0 || first + count > 65536) return;
    const auto answer =
        robot::ReadTwice(client, link.connection.unit_id, {image.table, first, count});
    if (answer.ok()) image.Set(first, answer.words);
    answers = answer.ok() || answer.kind == robot::ReadOutcome::Kind::kException;
  };
  for (const robot::RegisterBlock& block : profile.blocks) {
    if (block.table != image.table) continue;
    read(block.first, block.count);
    for (int k = 1; k <= kAround; ++k) {
      read(block.first - k, 1);
      read(block.first + block.count + k - 1, 1);
    }
  }
  return image;
}

/// What would make the joints plausible; the general remedy if nothing does.
std::string RemedyOfReading(const config::RobotLinkConfig& link, const deflection::LoadedArm& arm,
                            InputFault fault, const model::RobotState& state) {
  const std::string general = RemedyOf(fault);
  const bool of_decoding = fault == InputFault::kNotFinite || fault == InputFault::kTooSmall ||
                           fault == InputFault::kJointLimit || fault == InputFault::kAllZero ||
                           fault == InputFault::kTcpMismatch;
  if (!of_decoding || link.transport != "tcp") return general;
  std::vector<Pose> tools;
  for (int tool = 0; tool < arm.tools(); ++tool) tools.push_back(arm.X_FT(tool));
  const auto remedies =
      robot::RemediesOf(link.connection.profile, arm.chain(), ImageOf(link), tools);
  std::string text;
  for (const robot::ProfileRemedy& remedy : remedies) {
    // Plausible joints that contradict the pose as well are no explanation.
    if (fault == InputFault::kTcpMismatch && !remedy.agrees) break;
    text += fmt::format("{}{}: set {}", text.empty() ? "" : "; or ", remedy.what, remedy.change);
  }
  if (text.empty()) {
    if (fault == InputFault::kNotFinite && !state.q.allFinite()) {
      return "no other decoding explains it, so the controller itself may hold no number there: "
             "check the program that fills its registers, and the profile's addresses";
    }
    if (fault == InputFault::kAllZero)
      return "the robot was never referenced, or the addresses are wrong: " + general;
    return general + "; plumbline registers scan searches for the joints";
  }
  return text + (remedies.size() > 1 ? "; compare with the teach pendant which of them it is"
                                     : "; then compare the joints with the teach pendant");
}

/// How far the tool pose of a reading is from the cell's rigid table, if its resolution does not
/// explain it.
std::optional<measure::PoseError> PoseDifference(const config::DaemonConfig& config,
                                                 const model::RobotState& state) {
  const measure::RelationContext context(config.machine.cell);
  measure::ControllerSample sample;
  measure::StepsOf(config.robot.connection.profile, sample);
  sample.joint_step = state.q_resolution;
  const auto posture = measure::PostureFromReading(state, config.machine.cell);
  if (!posture) return std::nullopt;
  sample.postures.push_back(*posture);
  return UnexplainedDifference(context, sample);
}

/// Why the device does not give the blocks of the profile; nullopt if it does or does not answer.
std::optional<CheckResult> LinkFault(const config::RobotLinkConfig& link) {
  if (link.transport != "tcp") return std::nullopt;
  robot::RegisterClient client = ClientOf(link);
  const robot::LinkRemedyText found =
      robot::ExamineLink(client, link.connection.unit_id, link.connection.profile.blocks);
  if (found.what.empty()) return std::nullopt;
  return CheckResult{Health::kFault, "robot", fmt::format("{}: {}", PlaceOf(link), found.what),
                     found.remedy};
}

}  // namespace

Result<std::unique_ptr<robot::RobotDevice>> RobotToRead(const config::RobotLinkConfig& link) {
  robot::RobotConnection connection = link.connection;
  connection.push.enabled = false;
  return robot::MakeRobot(link.transport, connection);
}

CheckResult CheckRobot(const config::DaemonConfig& config) {
  const config::RobotLinkConfig& link = config.robot;
  if (link.transport == "replay") {
    return {Health::kNotChecked, "robot", "recording " + link.replay_file, {}};
  }
  auto robot = RobotToRead(link);
  if (!robot) return {Health::kFault, "robot", robot.error(), "fix [robot] in the configuration"};
  const deflection::LoadedArm arm(config.machine.cell);
  const Reading reading = ReadUntilTrusted(*robot.value(), config, arm);
  std::string notice;
  for (auto one = robot.value()->TakeNotice(); !one.empty(); one = robot.value()->TakeNotice())
    notice += fmt::format(". {}", one);
  robot.value().reset();  // a controller may accept one connection only
  const std::string place = PlaceOf(link);
  if (reading.state.sequence == 0 || !reading.problem.empty()) {
    if (reading.failed != robot::LinkResult::kRefused &&
        reading.failed != robot::LinkResult::kUnknownName) {
      if (const auto found = LinkFault(link)) return *found;
    }
    const std::string_view remedy = robot::LinkRemedy(reading.failed);
    return {Health::kFault, "robot",
            reading.problem.empty() ? place + " does not answer" : reading.problem,
            remedy.empty() ? "check robot.host" : std::string(remedy)};
  }
  const std::string joints = JointsText(arm.chain(), reading.state.q);
  if (reading.fault == InputFault::kOk) {
    if (const auto difference = PoseDifference(config, reading.state)) {
      return {
          Health::kWarning, "robot",
          fmt::format("{} answers: {}{}. Its tool pose is {:.3f} mm and {:.4f} deg from the cell's "
                      "table, more than its resolution explains",
                      place, joints, notice, kMmPerMetre * difference->distance_m,
                      kDegPerRad * difference->angle_rad),
          "if the robot stands still, name the difference: plumbline identify-controller CELL "
          "--robot CONFIG"};
    }
    return {Health::kGood, "robot", fmt::format("{} answers: {}{}", place, joints, notice), {}};
  }
  return {Health::kFault, "robot",
          fmt::format("{} answers, but its reading is not trusted: {}. {}{}", place,
                      WhyUntrusted(reading.fault, reading.state), joints, notice),
          RemedyOfReading(link, arm, reading.fault, reading.state)};
}

}  // namespace plumbline::cli
