// The session of a probe: what the configuration says, and the boot of this computer.
#pragma once

#include <string>

namespace plumbline {

/// "day 1 boot 3fa9c1d2": t_s of probes counts from the boot, so each boot is a session of its own.
/// The mark is the beginning of the kernel's boot_id.
/// @param session  as configured; may be empty
/// @return         `session` itself where the kernel tells no boot_id
std::string SessionOfBoot(const std::string& session);

}  // namespace plumbline
