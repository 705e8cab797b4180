// Whether each configured point is reached in the posture that its near_deg names, and if not,
// which of the configured angles was probably written in radians.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>

#include "app/config/toml_reader.h"
#include "firmware-like/machine.h"

namespace plumbline {

inline constexpr std::size_t kEveryPosture = std::numeric_limits<std::size_t>::max();

/// Adds a warning for each point that the arm does not reach, or reaches in another posture than
/// the one that it was taught in, by more than kTaughtBound_rad on an axis. Where the point shows
/// that near_deg, its rpy_deg, that of its frame or the robot's base_rpy_deg was meant in radians
/// (read so, the arm reaches the point in that posture; read as degrees, it does not), the warning
/// is of that key instead.
///
/// Only for a configuration without faults: its points are those of `root`, in order.
/// @param robot  [robot] of the cell file; absent where its base is not the one in use
/// @param most   checks the first so many points, each of which takes up to tens of milliseconds,
/// and
///               says so where there are more; 0: none, and says nothing
void WarnOfUnlikelyPostures(const TomlTable& root, const std::optional<TomlTable>& robot,
                            const MachineConfig& config, std::size_t most = kEveryPosture);

}  // namespace plumbline
