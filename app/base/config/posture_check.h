// Posture check of the configured points: posture other than near_deg, angles written in radians.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>

#include "app/base/config/toml_reader.h"
#include "firmware-like/machine.h"

namespace plumbline::config {

inline constexpr std::size_t kAllPostures = std::numeric_limits<std::size_t>::max();

/// Warns about each point that the arm does not reach, or reaches in a posture that differs from
/// the taught one by more than kTaughtBound_rad on any axis. If the point shows that near_deg, its
/// own rpy_deg, that of its frame or the robot's base_rpy_deg was written in radians (read as
/// radians, the arm reaches the point in the taught posture; read as degrees, it does not), the
/// warning is about that key instead.
///
/// @param robot       [robot] of the cell file; nullopt if its base is not the one in use
/// @param config      read from `root` without faults
/// @param max_points  number of points to check, each taking up to tens of milliseconds; a warning
///                    states how many were skipped. If 0, no point is checked and none reported
void WarnAboutUnlikelyPostures(const TomlTable& root, const std::optional<TomlTable>& robot,
                               const MachineConfig& config, std::size_t max_points = kAllPostures);

}  // namespace plumbline::config
