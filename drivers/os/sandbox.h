// Sandbox: restricts the process to its memory and its open descriptors.
#pragma once

#include <cstdint>
#include <optional>

#include "firmware-like/result.h"

namespace plumbline::os {

/// Applies irrevocable limits: no new descriptors (hence no files or sockets), no file growth, no
/// new processes, core dumps or privileges, bounded memory and CPU time. A seccomp filter allows
/// only system calls that use open descriptors, manage memory or exit; any other fails with EPERM.
/// In sanitizer builds, whose runtime needs more, only CPU time, processes and core dumps are
/// limited.
/// @param cpu_s  limit on the process's total CPU time [s], including what it has already used;
///               nullopt if not limited: the process that waits for the answers must then limit the
///               time of each
/// @return       an error that names the limit that could not be set; untrusted input must then not
///               be parsed
Result<void> EnterSandbox(std::uint64_t memory_bytes, std::optional<unsigned> cpu_s);

}  // namespace plumbline::os
