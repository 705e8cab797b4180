// Sandbox: restricts the process to its memory and its open descriptors.
#pragma once

#include <cstdint>

#include "firmware-like/result.h"

namespace plumbline::scene {

/// Applies irrevocable limits: no new descriptors (hence no files or sockets), no file growth, no
/// new processes, core dumps or privileges, bounded memory and CPU time. A seccomp filter allows
/// only system calls that use open descriptors, manage memory or exit; any other fails with EPERM.
/// In sanitizer builds, whose runtime needs more, only CPU time, processes and core dumps are
/// limited.
/// @return  or the limit that could not be set; untrusted input must then not be parsed
Result<void> EnterSandbox(std::uint64_t memory_bytes, unsigned cpu_s);

}  // namespace plumbline::scene
