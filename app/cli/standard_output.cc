#include "app/cli/standard_output.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <cstdio>
#include <iostream>

namespace plumbline::cli {

void ReserveClosedOutputs() {
  // open() returns the lowest free number, so the order matters. A write to a descriptor opened for
  // reading fails with EBADF.
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(descriptor, F_GETFD) != -1) continue;
    static_cast<void>(open("/dev/null", O_RDONLY));  // NOLINT(cppcoreguidelines-pro-type-vararg)
  }
}

bool FlushStandardOutput() {
  std::cout.flush();
  if (std::cout && std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return true;
  pollfd out{.fd = STDOUT_FILENO, .events = POLLOUT, .revents = 0};
  if (poll(&out, 1, 0) == 1 && (out.revents & POLLERR) != 0) return true;  // the reader has exited
  std::cerr
      << "plumbline: standard output cannot be written; check whether the disk is full or the "
         "descriptor is closed\n";
  return false;
}

}  // namespace plumbline::cli
