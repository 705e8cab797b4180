// How often the daemon was started: a number that survives a power cut.
#pragma once

#include <cstdint>
#include <string>

#include "firmware-like/result.h"

namespace plumbline {

/// The number of a start that follows those that `directory`/boot_count tells: 1 at the first; a
/// file that holds no number counts as 0.
std::uint16_t NextBootCount(const std::string& directory);

/// Keeps it, once the start counts: by write, fsync, rename, fsync of the folder, so that a power
/// cut leaves the old number or the new one. @return why it was not kept
Result<void> KeepBootCount(const std::string& directory, std::uint16_t count);

}  // namespace plumbline
