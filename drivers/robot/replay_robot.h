// Robot device that replays recorded joint values, to run the daemon without a controller.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "drivers/robot/robot.h"
#include "firmware-like/result.h"

namespace plumbline::robot {

/// One recorded row; all rows have the same number of joints.
struct ReplayRow {
  model::JointVector q;  ///< [rad] or [m]
  std::optional<double> payload_kg;
  std::optional<Vec3> payload_cog_F;
  std::optional<double> temp_C;
  std::optional<int> tool_number{}, payload_item{};

  bool operator==(const ReplayRow& other) const {
    return q.size() == other.q.size() && q == other.q && payload_kg == other.payload_kg &&
           payload_cog_F == other.payload_cog_F && temp_C == other.temp_C &&
           tool_number == other.tool_number && payload_item == other.payload_item;
  }
};

struct ReplayRows {
  std::vector<ReplayRow> rows;
  double rows_per_s = 1;  ///< recorded poses are separate stations, not a trajectory
  bool loop = true;       ///< if false, the last row is held

  bool operator==(const ReplayRows&) const = default;
};

/// The first Read() returns the first row; each row lasts 1 / rows_per_s. While the last row is
/// held, readings are still fresh, as those of a robot at standstill. Push() is refused.
class ReplayRobot : public RobotDevice {
 public:
  /// Fails without rows, with more than kMaxJoints joints, with rows of different length, or with a
  /// rate that is not positive.
  static Result<std::unique_ptr<RobotDevice>> Create(ReplayRows replay, Clock clock);

  LinkResult Read(model::RobotState& state) override;
  LinkResult Push(std::span<const PushPoint> points) override;
  LinkResult WithdrawAll(double /*within_s*/) override { return LinkResult::kOk; }
  std::string_view problem() const override { return problem_; }

 private:
  ReplayRobot(ReplayRows replay, Clock clock);

  ReplayRows replay_;
  Clock clock_;
  std::optional<double> start_s_;
  std::uint64_t sequence_ = 0;
  std::string_view problem_;
};

}  // namespace plumbline::robot
