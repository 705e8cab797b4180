// Reader of HID zoom profiles, config/profiles/zoom/*.toml; generic-hid.toml explains every key.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "app/base/config/fault.h"
#include "drivers/zoom/hid_codec.h"

namespace plumbline::config {

/// Parses the text of a profile. Pure function; `file` is only the name used in faults.
/// @return a profile that passes FaultOf(), or nullopt if this text has a fault
std::optional<zoom::HidProfile> HidProfileFromText(std::string_view text, const std::string& file,
                                                   FaultList& faults);

}  // namespace plumbline::config
