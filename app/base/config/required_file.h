// Reading of a text file that must exist: if it cannot be read, that is a fault of the input.
#pragma once

#include <optional>
#include <string>

#include "app/base/config/fault.h"
#include "drivers/files/text_file.h"

namespace plumbline::config {

/// @param faults  receives a fault with reason and remedy if the file cannot be read
/// @return        the content; nullopt with a fault
std::optional<std::string> ReadRequiredFile(
    const std::string& path, FaultList& faults,
    const files::SizeLimit& limit = files::kConfigurationSize);

}  // namespace plumbline::config
