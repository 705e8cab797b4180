// A process that has nothing left but its memory and the descriptors that it holds.
#pragma once

#include <cstdint>

#include "firmware-like/result.h"

namespace plumbline {

/// From now on, for good: no new descriptor (so no file, no socket), no file grows, no process
/// starts, no core, no new privileges, at most that much memory and processor time; and of all
/// system calls only those that read and write open descriptors, manage memory and end. Any other
/// fails with EPERM. Built with a sanitizer, whose runtime needs more, it limits only time,
/// processes and cores.
/// @return  what could not be had; nothing is to be parsed then
Result<void> CloseOff(std::uint64_t memory_bytes, unsigned cpu_s);

}  // namespace plumbline
