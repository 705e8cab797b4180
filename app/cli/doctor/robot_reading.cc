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
std::string_view WhyUntrusted(InputFault fault) {
  return fault == InputFault::kMissing ? "it was not refreshed" : Describe(fault);
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
  const Reading reading = ReadUntilTrusted(*robot.value(), config, arm);
  const std::string place = PlaceOf(link);
  if (reading.state.sequence == 0 || !reading.problem.empty()) {
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
                      WhyUntrusted(reading.fault), joints),
          RemedyOf(reading.fault)};
}

}  // namespace plumbline::cli
