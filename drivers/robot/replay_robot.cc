#include "drivers/robot/replay_robot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace plumbline::robot {

Result<std::unique_ptr<RobotDevice>> ReplayRobot::Create(ReplayRows replay, Clock clock) {
  if (replay.rows.empty()) return Error{"replay: no rows"};
  if (!std::isfinite(replay.rows_per_s) || replay.rows_per_s <= 0) {
    return Error{fmt::format("replay: {} rows per second is not positive", replay.rows_per_s)};
  }
  const auto joints = replay.rows.front().q.size();
  for (std::size_t i = 0; i < replay.rows.size(); ++i) {
    const auto found = replay.rows[i].q.size();
    if (found != joints || found == 0) {
      return Error{
          fmt::format("replay: row {} has {} joints, the first has {}", i + 1, found, joints)};
    }
  }
  return std::unique_ptr<RobotDevice>(new ReplayRobot(std::move(replay), clock));
}

ReplayRobot::ReplayRobot(ReplayRows replay, Clock clock)
    : replay_(std::move(replay)), clock_(clock) {}

LinkResult ReplayRobot::Read(model::RobotState& state) {
  const double now_s = clock_();
  if (!start_s_) start_s_ = now_s;
  const auto count = static_cast<double>(replay_.rows.size());
  const double elapsed_rows = std::floor(std::max(0.0, now_s - *start_s_) * replay_.rows_per_s);
  const double place =
      replay_.loop ? std::fmod(elapsed_rows, count) : std::min(elapsed_rows, count - 1);
  const ReplayRow& row = replay_.rows[static_cast<std::size_t>(place)];

  state = model::RobotState{};
  state.timestamp_s = now_s;
  state.sequence = ++sequence_;
  state.q = row.q;
  state.payload_kg = row.payload_kg;
  state.payload_cog_F = row.payload_cog_F;
  state.temp_C = row.temp_C;
  state.tool_number = row.tool_number;
  state.payload_item = row.payload_item;
  state.mode = model::RobotMode::kRunning;
  return LinkResult::kOk;
}

LinkResult ReplayRobot::Push(std::span<const PushPoint> /*points*/) {
  problem_ = "a replay has no registers to write to";
  return LinkResult::kPushRefused;
}

}  // namespace plumbline::robot
