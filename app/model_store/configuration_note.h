// Which configuration the daemon of a state directory runs with.
#pragma once

#include <optional>
#include <string>

#include "firmware-like/result.h"

namespace plumbline {

/// Keeps the path of the daemon's configuration in its state directory, `configuration`, where it
/// is not the one that is there already.
/// @return why it could not be kept
Result<void> RecordConfigurationPath(const std::string& state_directory, const std::string& file);

/// Whether a daemon, or its journal, has used this state directory before: the configuration is
/// noted there, or a journal lies there.
bool HasBeenUsed(const std::string& state_directory);

/// The path that was noted at the daemon's last start; nothing where there is none.
std::optional<std::string> NotedConfiguration(const std::string& state_directory);

}  // namespace plumbline
