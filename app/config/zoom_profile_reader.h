// config/profiles/zoom/*.toml -> HidProfile. Every key is explained in generic-hid.toml there.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "app/config/fault.h"
#include "drivers/zoom/hid_codec.h"

namespace plumbline {

/// Reads a profile by its text; a pure function. `file` only names it in faults.
/// @return the profile, sound by FaultOf(); nothing where this text has a fault
std::optional<HidProfile> HidProfileFromText(std::string_view text, const std::string& file,
                                             FaultList& faults);

/// HidProfileFromText of a file's content; a file that cannot be read is a fault.
std::optional<HidProfile> ReadHidProfile(const std::string& path, FaultList& faults);

}  // namespace plumbline
