// Detection of threads that wait for a device inside the kernel.
#pragma once

#include <sys/types.h>

namespace plumbline::cell {

/// Whether a thread of this process is in uninterruptible sleep (state D): it waits for a disk, or
/// for a USB device's timeouts. A thread that hangs in our own code, or that a debugger has
/// stopped, is not. [proc(5), /proc/pid/stat]
/// @return  false also if there is no such thread
bool IsWaitingForDevice(pid_t thread);

}  // namespace plumbline::cell
