// Whether a thread waits for a device, as the kernel sees it.
#pragma once

#include <sys/types.h>

namespace plumbline {

/// Whether a thread of this process sleeps where no signal wakes it, state D: it waits for a disk,
/// or for a USB device's time-outs. One that hangs in our own code, or is held by a debugger, does
/// not. [proc(5), /proc/pid/stat]
/// @return  false too where there is no such thread
bool WaitsForDevice(pid_t thread);

}  // namespace plumbline
