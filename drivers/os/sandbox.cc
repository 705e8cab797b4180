#include "drivers/os/sandbox.h"

#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>

#include <cerrno>
#include <cstddef>
#include <cstring>
#include <string>
#include <vector>

namespace plumbline::os {
namespace {

#ifdef PLUMBLINE_SANITIZED
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

#if defined(__x86_64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_AARCH64;
#else
#error "name this processor's AUDIT_ARCH_..."
#endif

/// @param grace  by how much the hard limit exceeds the soft limit
bool Limit(__rlimit_resource what, rlim_t most, rlim_t grace = 0) {
  const rlimit limit{most, most + grace};
  return setrlimit(what, &limit) == 0;
}

sock_filter Statement(unsigned code, std::uint32_t k) {
  return {static_cast<std::uint16_t>(code), 0, 0, k};
}

/// Skips the next statement unless the loaded word is k.
sock_filter UnlessEqual(std::uint32_t k) {
  return {BPF_JMP | BPF_JEQ | BPF_K, 0, 1, k};
}

/// Installs the seccomp filter.
bool AllowFewCalls() {
  constexpr std::uint32_t kAllowed[] = {
      __NR_read,   __NR_write,      __NR_close,         __NR_lseek,        __NR_fstat,
      __NR_mmap,   __NR_munmap,     __NR_mremap,        __NR_mprotect,     __NR_madvise,
      __NR_brk,    __NR_futex,      __NR_rt_sigreturn,  __NR_rt_sigaction, __NR_rt_sigprocmask,
      __NR_exit,   __NR_exit_group, __NR_clock_gettime, __NR_getrandom,    __NR_gettid,
      __NR_getpid, __NR_tgkill,  // abort() of a library
  };
  std::vector<sock_filter> program = {
      Statement(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, arch)),
      {BPF_JMP | BPF_JEQ | BPF_K, 1, 0, kArchitecture},
      Statement(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS),
      Statement(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
  };
  for (const std::uint32_t call : kAllowed) {
    program.push_back(UnlessEqual(call));
    program.push_back(Statement(BPF_RET | BPF_K, SECCOMP_RET_ALLOW));
  }
  program.push_back(Statement(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM));
  const sock_fprog filter{static_cast<std::uint16_t>(program.size()), program.data()};
  return prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) == 0;
}

}  // namespace

Result<void> EnterSandbox(std::uint64_t memory_bytes, std::optional<unsigned> cpu_s) {
  const bool limited = Limit(RLIMIT_CORE, 0) && Limit(RLIMIT_NPROC, 0) &&
                       (!cpu_s || Limit(RLIMIT_CPU, *cpu_s, 1)) &&
                       prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0;
  if (limited && kSanitized) return {};
  if (limited && Limit(RLIMIT_NOFILE, 0) && Limit(RLIMIT_FSIZE, 0) &&
      Limit(RLIMIT_AS, memory_bytes) && AllowFewCalls()) {
    return {};
  }
  return Error{std::string("the process cannot be sandboxed: ") + std::strerror(errno)};
}

}  // namespace plumbline::os
