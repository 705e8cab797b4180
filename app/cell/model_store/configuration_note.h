// Record of the daemon's configuration path in its state directory.
#pragma once

#include <optional>
#include <string>

#include "firmware-like/result.h"

namespace plumbline::cell {

/// Writes the path of the daemon's configuration to `configuration` in its state directory, unless
/// it is recorded there already.
/// @return  why it could not be written
Result<void> RecordConfigurationPath(const std::string& state_directory, const std::string& file);

/// Whether a daemon has used this state directory before: its configuration path is recorded there,
/// or it contains a journal.
bool HasBeenUsed(const std::string& state_directory);

/// The path recorded at the daemon's last start; nullopt if there is none.
std::optional<std::string> RecordedConfigurationPath(const std::string& state_directory);

}  // namespace plumbline::cell
