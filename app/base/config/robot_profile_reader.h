// Reader of robot profiles, config/profiles/*.toml; generic.toml there explains every key.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "app/base/config/fault.h"
#include "drivers/robot/profile.h"

namespace plumbline::config {

/// Parses the text of a profile. Pure function; `file` is only the name used in faults.
///
/// Required: schema, name, source, at least one [[read]] and one [[joints]]; everything else is
/// optional. A value at a register that no [[read]] covers is a fault.
///
/// @return the profile, converted to SI, or nullopt if this text has a fault
std::optional<robot::RobotProfile> RobotProfileFromText(std::string_view text,
                                                        const std::string& file, FaultList& faults);

}  // namespace plumbline::config
