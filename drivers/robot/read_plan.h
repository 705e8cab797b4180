// Plan of the requests that make one reading: which block first, and how the reading is closed.
// Pure.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "drivers/robot/profile.h"

namespace plumbline::robot {

/// Blocks in the order in which they are requested, and the markers that may close a reading.
///
/// A marker is a short read inside one of the blocks. It has two uses:
///   - On a serial line, where a response names neither its request nor its registers, the length
///     of a marker's response differs from those of all blocks, of the push slots and of the other
///     markers. The answer to a marker therefore proves that every earlier answer has arrived.
///   - Where joints and load come from several blocks, it reads the refresh counter again: if that
///     has not changed, the controller has not refreshed its registers during the reading.
struct ReadPlan {
  struct Step {
    RegisterBlock block;
    std::size_t place = 0;  ///< of its first word in the buffer of the codec
  };
  std::vector<Step> steps;             ///< the block of the refresh counter first
  std::vector<RegisterBlock> markers;  ///< used in turn; none: a reading needs no closing
  /// Joints and load lie in several blocks, and a refresh counter shows whether they belong
  /// together.
  bool compares_refresh = false;
};

/// @param serial  Modbus RTU
/// @param push    corrected points are written into the slots of the profile
ReadPlan PlanReading(const RobotProfile& profile, bool serial, bool push);

/// Why a profile cannot be read over a serial line, with the remedy: responses that cannot be told
/// apart. nullopt if it can.
std::optional<std::string> SerialFault(const RobotProfile& profile, bool push);

}  // namespace plumbline::robot
