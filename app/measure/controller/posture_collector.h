// Postures that a robot visits, as a bounded set that is spread as widely as possible.
#pragma once

#include "app/measure/controller/identify.h"
#include "firmware-like/model/robot_state.h"

namespace plumbline::measure {

/// Keeps a posture if it differs from the kept ones; once it is full, if it replaces one of the two
/// that are nearest to each other by one that is farther from all.
class PostureCollector {
 public:
  explicit PostureCollector(std::size_t most = kUsualPostures) : most_(most) {}

  /// @return true if the posture was kept
  bool Add(const ControllerPosture& posture);
  void Clear() { postures_.clear(); }
  /// Forgets postures that were read before a time.
  void Expire(double before_s);
  const std::vector<ControllerPosture>& postures() const { return postures_; }

 private:
  std::size_t most_;
  std::vector<ControllerPosture> postures_;
};

/// A reading with its tool as a posture, without payload and velocities.
/// @return  nullopt if it has no finite joints and pose, or a tool that the cell does not declare
std::optional<ControllerPosture> PostureFromReading(const model::RobotState& reading,
                                                    const model::CellModel& cell);

/// Finds postures at standstill in a stream of readings, or with `moving` in any motion, in which
/// joint velocities follow from the readings before and after.
class ReadingFilter {
 public:
  explicit ReadingFilter(bool moving) : moving_(moving) {}

  /// The posture of an earlier reading, if it can be used; without payload.
  /// @param reading  the newest; one that was passed before is ignored
  std::optional<ControllerPosture> Observe(const model::RobotState& reading,
                                           const model::CellModel& cell);

 private:
  bool moving_;
  std::vector<model::RobotState> last_;  ///< at most three
};

}  // namespace plumbline::measure
