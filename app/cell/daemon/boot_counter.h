// Counter of the daemon's starts in a file that survives a power cut.
#pragma once

#include <cstdint>
#include <string>

#include "firmware-like/result.h"

namespace plumbline::cell {

/// The number of this start: one more than the count in `directory`/boot_count. 1 if the file is
/// missing or holds no number. Changes nothing on disk.
std::uint16_t NextBootCount(const std::string& directory);

/// Stores the count, once the start has succeeded: write, fsync, rename, fsync of the folder, so
/// that a power cut leaves the old number or the new one. @return  why it could not be stored
Result<void> StoreBootCount(const std::string& directory, std::uint16_t count);

}  // namespace plumbline::cell
