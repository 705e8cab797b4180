#include "app/cli/doctor/robot_reading.h"

#include <fmt/format.h>

#include <cmath>

#include "drivers/clock.h"
#include "drivers/robot/registry.h"
#include "firmware-like/loads/numbered_load.h"
#include "firmware-like/model/joint_columns.h"
#include "firmware-like/plausibility_filter.h"

namespace plumbline::cli {
namespace {

constexpr double kRobotWait_s = 3, kPause_s = 0.02;

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

/// The newest reading, whether it is trusted, and why the link failed if it did.
struct Reading {
  model::RobotState state;
  InputFault fault = InputFault::kMissing;
  robot::LinkResult failed = robot::LinkResult::kWaiting;
  std::string problem;
};

Reading ReadUntilTrusted(robot::RobotDevice& robot, const MachineConfig& machine,
                         const deflection::LoadedArm& arm) {
  Reading reading;
  PlausibilityFilter filter(machine.plausibility);
  const double until_s = MonotonicSeconds() + kRobotWait_s;
  while (reading.fault != InputFault::kOk && MonotonicSeconds() < until_s) {
    const robot::LinkResult result = robot.Read(reading.state);
    if (result == robot::LinkResult::kOk) {
      const std::optional<int> mounted =
          arm.tools() == 1 ? 0 : loads::ToolIndexOf(machine.cell, reading.state.tool_number);
      reading.fault = filter.Check(arm, reading.state, reading.state.timestamp_s, mounted);
    } else if (result != robot::LinkResult::kWaiting) {
      reading.problem = robot.problem();
      reading.failed = result;
    }
    if (reading.fault != InputFault::kOk) SleepSeconds(kPause_s);
  }
  return reading;
}

}  // namespace

CheckResult CheckRobot(const config::DaemonConfig& config) {
  const config::RobotLinkConfig& link = config.robot;
  if (link.transport == "replay") {
    return {Health::kNotChecked, "robot", "recording " + link.replay_file, {}};
  }
  auto robot = robot::MakeRobot(link.transport, link.connection);
  if (!robot) return {Health::kFault, "robot", robot.error(), "fix [robot] in the configuration"};
  const deflection::LoadedArm arm(config.machine.cell);
  const Reading reading = ReadUntilTrusted(*robot.value(), config.machine, arm);
  const std::string place = PlaceOf(link);
  if (reading.state.sequence == 0) {
    const std::string_view remedy = robot::LinkRemedy(reading.failed);
    return {Health::kFault, "robot",
            reading.problem.empty() ? place + " does not answer" : reading.problem,
            remedy.empty() ? "check robot.host" : std::string(remedy)};
  }
  const std::string joints = JointsText(arm.chain(), reading.state.q);
  if (reading.fault == InputFault::kOk) {
    return {Health::kGood, "robot", fmt::format("{} answers: {}", place, joints), {}};
  }
  return {Health::kFault, "robot",
          fmt::format("{} answers, but its reading is not trusted: {}. {}", place,
                      Describe(reading.fault), joints),
          RemedyOf(reading.fault)};
}

}  // namespace plumbline::cli
