// How often the daemon was started: a number that survives a power cut.
#pragma once

#include <cstdint>
#include <string>

#include "firmware-like/result.h"

namespace plumbline {

/// Raises the counter in `directory`/boot_count and returns it (1 at the first start; a file that
/// holds no number counts as 0). Written by write, fsync, rename, fsync of the folder, so that a
/// power cut leaves the old number or the new one. @return the number, or why it was not kept
Result<std::uint16_t> RaiseBootCounter(const std::string& directory);

}  // namespace plumbline
