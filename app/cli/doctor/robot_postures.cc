#include "app/cli/doctor/robot_postures.h"

#include <string>

#include "app/cli/doctor/robot_reading.h"
#include "app/measure/controller/posture_collector.h"
#include "app/measure/controller/reported_steps.h"
#include "drivers/clock.h"
#include "drivers/robot/registry.h"
#include "firmware-like/loads/numbered_load.h"
#include "firmware-like/payload_selection.h"

namespace plumbline::cli {
namespace {

constexpr double kPeriod_s = 0.05;

}  // namespace

Result<measure::ControllerSample> CollectPostures(
    const config::DaemonConfig& config, const model::CellModel& cell, double seconds, bool moving,
    std::optional<int> tool, const std::function<bool(double share, std::size_t kept)>& progress) {
  const config::RobotLinkConfig& link = config.robot;
  auto made = RobotToRead(link);
  if (!made) return Error{made.error()};
  robot::RobotDevice& device = *made.value();
  measure::ControllerSample sample;
  measure::StepsOf(link.connection.profile, sample);
  measure::PostureCollector collector;
  measure::ReadingFilter filter(moving);
  PayloadSelector selector(config.machine.payload, cell.payload_cog_F);
  model::RobotState state;
  std::string problem = "no reading";
  bool read = false, posed = false, known_tool = false;
  const double start_s = MonotonicSeconds();
  for (double now_s = start_s; now_s < start_s + seconds; now_s = MonotonicSeconds()) {
    if (!progress((now_s - start_s) / seconds, collector.postures().size())) break;
    const robot::LinkResult result = device.Read(state);
    if (result == robot::LinkResult::kOk) {
      read = true;
      posed = posed || state.X_BT.has_value();
      sample.joint_step = state.q_resolution;
      if (tool) state.tool_number = tool;
      known_tool = known_tool || loads::ToolIndexOf(cell, state.tool_number);
      if (state.q.size() != cell.robot.size()) {
        return Error{"the robot profile has another number of joints than the cell: check both"};
      }
      if (auto posture = filter.Observe(state, cell)) {
        selector.Select(&state, cell);
        posture->payload = selector.present();
        collector.Add(*posture);
      }
    } else if (result != robot::LinkResult::kWaiting) {
      problem = device.problem();
    }
    if (collector.postures().size() >= measure::kUsualPostures) break;
    SleepSeconds(kPeriod_s);
  }
  if (!read) return Error{"the robot was not read: " + problem + "; run plumbline doctor"};
  if (!posed) {
    return Error{
        "the robot profile has no tool pose, with which joints could be compared: add [tcp]"};
  }
  if (!known_tool) {
    return Error{"the robot reports no tool number that the cell declares: state the tool, --tool"};
  }
  sample.postures = collector.postures();
  return sample;
}

}  // namespace plumbline::cli
