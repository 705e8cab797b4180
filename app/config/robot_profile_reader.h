// config/profiles/*.toml -> RobotProfile. Every key is explained in config/profiles/generic.toml.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "app/config/fault.h"
#include "drivers/robot/profile.h"

namespace plumbline {

/// Reads a profile by its text; a pure function. `file` only names it in faults.
///
/// Required are schema, name, source, at least one [[read]] and one [[joints]]; whatever else a
/// controller does not offer is left out. A value outside everything that is read is a fault.
///
/// @return the profile in SI; nothing where this text has a fault
std::optional<RobotProfile> RobotProfileFromText(std::string_view text, const std::string& file,
                                                 FaultList& faults);

/// RobotProfileFromText of a file's content; a file that cannot be read is a fault.
std::optional<RobotProfile> ReadRobotProfile(const std::string& path, FaultList& faults);

}  // namespace plumbline
